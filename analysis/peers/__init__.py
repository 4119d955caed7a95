"""Other people's integrators on the same scene: one module each, loaded only when its package is there."""
