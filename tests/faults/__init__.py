"""What can go wrong while studies run, as a suite: ``python -m tests.faults`` prints a table of kinds, counts, losses.

A trial makes one fault happen to a run, looks at what the fault has left, and lets the next run finish the work.
Nothing finished may be lost, and nothing may be wrong without a word.
"""
