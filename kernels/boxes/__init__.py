"""Proofs about whole boxes of designs: Taylor models, rows of a linear program, motions in limited time, the search.

``taylor`` encloses a function over a box, rounding included; ``tape`` records formulas for it.  ``branching`` combines
such enclosures into a bound and keeps the queue of boxes.  ``tube`` bounds the follower's angle in time.  The enclosed
functions belong to a family (``kernels/families/rssr/box_*.py``).
"""
