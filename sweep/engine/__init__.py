"""``run``: chunks over the cores, then the optimum and its front; estimates of a run's cost."""
