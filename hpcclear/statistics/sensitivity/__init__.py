"""Sensitivity of a function to its inputs: derivatives at a point, their trust, global indices."""
