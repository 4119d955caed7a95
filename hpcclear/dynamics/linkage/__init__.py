"""What moves: accelerations, gaps and powers of a mechanism at a state."""
