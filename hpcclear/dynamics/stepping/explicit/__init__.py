"""The block stepper: Runge-Kutta pairs over a batch of lanes."""
