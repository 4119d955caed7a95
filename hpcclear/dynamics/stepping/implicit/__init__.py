"""Radau IIA steps of lanes that are stiff."""
