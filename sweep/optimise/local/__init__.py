"""The search from one start: SLSQP, Newton rounds, polish, and what is known of its end."""
