"""Commands that prepare or run the processes of a rig."""
