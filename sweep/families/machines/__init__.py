"""Machines: members on common shafts, and the relations between them: gaps, moments of a stitch, thread, shaking."""
