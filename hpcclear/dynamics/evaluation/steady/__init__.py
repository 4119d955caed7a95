"""The steady mean of the objective with its confidence interval, of regular, settling, unsteady and chaotic motion."""
