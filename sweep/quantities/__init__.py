"""Design outputs as data: reductions of pose outputs, limits, and the grammar of their names."""
