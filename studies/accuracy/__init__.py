"""What accuracy costs in time: errors and times of every way to a number, by region of the design space."""
