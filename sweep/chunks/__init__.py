"""What one chunk of a sweep holds: the cut of the design space, and designs on their way through outputs and limits."""
