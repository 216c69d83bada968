"""Curves over a turn: samples, Fourier series, trigonometric polynomials, polynomials."""
