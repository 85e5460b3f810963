"""The workbench on plants with hidden effects."""
