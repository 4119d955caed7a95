"""Surrogates of an expensive function: response surfaces, Kriging, and their accuracy."""
