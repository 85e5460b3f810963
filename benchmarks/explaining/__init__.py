"""The workbench on plants that hide something."""
