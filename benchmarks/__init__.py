"""Figures of rigwatch, measured on this machine and compared with published ones: `make bench`."""
