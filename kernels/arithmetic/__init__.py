"""Arithmetic that numba and its libraries do not have, or not as vector code."""
