"""Figures, each a function of a dataset that returns a matplotlib Figure."""
