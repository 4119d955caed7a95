"""What accuracy costs in time: every approximation of a study, its error and its price."""
