"""Robust design of mechanisms with clearance joints, as an MPI-parallel batch study."""

__version__ = "0.1.0"
