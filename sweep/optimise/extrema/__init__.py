"""Extrema of a design's curves, tracked while the design changes, and their gradients."""
