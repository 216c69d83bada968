"""Local search from one start: SLSQP, Newton rounds, polishing, and the optimality check of its end."""
