"""Commands that list, acknowledge and reset alarms."""
