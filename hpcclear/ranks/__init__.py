"""Samples handed out over MPI ranks; only `boundary` imports mpi4py."""
