"""Random inputs: distributions, and the moments of an objective under them."""
