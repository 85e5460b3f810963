"""Commands that start or prepare the processes of a rig."""
