"""How time advances: tableaus, step control, impact instants and the block stepper."""
