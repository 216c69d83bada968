"""The optimisation problem, and the rows of its epigraph program."""
