"""Machine code from texts: statements and expressions straight to LLVM's language.

A text (`hpcclear.base.one_text`) holds numbers, vectors of eight, flat and two-dimensional arrays, and named tuples of these:
nothing that needs a general compiler. Numba, which inferred types, renamed every assignment and looked up each operation among
all that it knows, took 23 of 28 s of a first result; here it only optimises.
"""
