"""A design through the dynamics, on all ranks: samples and statistics."""
