"""Cost of accuracy: errors and times of every method, by region of the design space."""
