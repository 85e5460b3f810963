"""The monitor on simulated rigs: correct alarms, false alarms, and speed."""
