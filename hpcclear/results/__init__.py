"""What a run leaves: names and units, datasets, files, checkpoints, places and locks."""
