"""Whole Python calls against the reference, plain NumPy, numba, C++ and others, with every answer checked."""

TWO_THREADS = "ttc_fast, 2 threads"
