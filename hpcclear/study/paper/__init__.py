"""What belongs to the one paper: its printed figures, its claims and how they read."""
