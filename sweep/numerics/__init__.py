"""Numerical methods that know no mechanism: adaptive quadrature, distances of singularities."""
