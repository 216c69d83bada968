"""Fronts: the objective minimised for each bound on a second output."""
