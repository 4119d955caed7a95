"""Friction in joints with clearance, one file a law."""
