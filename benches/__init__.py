"""Whole Python calls against the reference, plain NumPy, numba, C++ and others, with every answer checked."""
