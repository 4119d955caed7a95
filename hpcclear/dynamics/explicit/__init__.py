"""The block stepper: Runge-Kutta pairs over lanes in lockstep."""
