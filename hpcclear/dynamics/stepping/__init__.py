"""What all steppers share: step control, events, revolutions and their sums, time series."""
