"""A scene as numbers: what is common to its samples, their parameters, and where they start."""
