"""Extrema of a design's curves, followed as it moves, and their gradients."""
