"""A design through time: from a scene's numbers to outcome records, compiled, in batches of lanes."""
