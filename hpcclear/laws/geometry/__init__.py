"""Elastic parts of normal forces by the shapes that touch, one file a geometry."""
