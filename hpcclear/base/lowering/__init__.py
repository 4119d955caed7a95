"""Machine code from functions of the kernel: their syntax trees straight to LLVM's language.

They compute with numbers, vectors of eight, flat and two-dimensional arrays, and named tuples of these: nothing that needs a
general compiler. What is known beforehand (which effects are on, how many lanes) is computed at once, branches that it decides
are left out, and calls are written out where they stand. Numba, which inferred types, renamed every assignment and looked up
each operation among all that it knows, took 23 of 28 s of a first result.
"""
