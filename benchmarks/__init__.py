"""What rigwatch reaches, measured on this machine beside published figures: `make bench`."""
