"""Many recordings and archives: cost of a scheduler, kills, speed of an index and of questions."""
