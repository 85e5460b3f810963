"""The monitor on simulated rigs: alarms that are due, alarms that are false, and speed."""
