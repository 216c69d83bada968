"""``run``: chunks over the cores, then the optimum and its front; what a run will cost."""
