"""Whole Python calls against the reference, plain NumPy and a numba kernel, with every answer checked."""
