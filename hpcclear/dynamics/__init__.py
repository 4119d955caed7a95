"""A design through time: from a scene's numbers to outcome records, compiled and in lockstep lanes."""
