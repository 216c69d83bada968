"""What long work needs whatever it computes: signals that set a flag, and progress with remaining time."""
