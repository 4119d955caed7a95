"""The stepper of a single response: the stages of a step side by side in a vector."""
