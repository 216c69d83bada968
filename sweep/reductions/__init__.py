"""From a motion to numbers of a design: extrema, limit positions, margins, means and times over the turn."""
