"""Data acquisition: a device becomes calibrated samples with quality on the bus."""
