"""Infrastructure of long computations: executors, signals that set a flag, progress with remaining time."""
