"""Numerical methods without mechanics: adaptive quadrature, roots, interpolation, distances of singularities."""
