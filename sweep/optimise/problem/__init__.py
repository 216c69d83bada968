"""What is to be optimised, and the rows of its epigraph program."""
