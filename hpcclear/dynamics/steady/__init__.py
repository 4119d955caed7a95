"""The steady mean of the objective with its limits, whatever the motion does: regular, settling, unsteady or chaotic."""
