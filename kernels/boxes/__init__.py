"""Proofs about whole boxes of designs: Taylor models, rows of a linear program, motions in limited time, the search.

``taylor`` encloses a function over a box, rounding included; ``tape`` records formulas for it.  ``branching`` combines
such enclosures into a bound and has what a search needs.  ``tube`` says where a follower can be in time.  What is
enclosed belongs to a family (``kernels/families/rssr/box_*.py``).
"""
