"""What the forces are: contact, friction and geometry as functions of plain floats."""
