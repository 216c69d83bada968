"""Reductions of poses to design outputs: extrema, limit positions, margins, means and events over the turn."""
