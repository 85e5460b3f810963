"""Several effects at once: pairs along the measured motion, sets of up to three in free runs."""
