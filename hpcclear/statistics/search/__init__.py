"""The multi-objective swarm, and what dominates what."""
