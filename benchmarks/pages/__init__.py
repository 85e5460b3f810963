"""The workbench in a browser: speed of display and replies, and safety against kills."""
