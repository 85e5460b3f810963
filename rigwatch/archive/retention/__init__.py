"""What leaves an archive: old sessions, whole or but for their figures per second."""
