"""Proofs about whole boxes of designs: slope arithmetic with outward rounding, rows of a linear program, the search.

``slopes`` encloses a function over a box, ``program`` finds the multipliers that combine such enclosures into a bound.
What is enclosed belongs to a family (``kernels/families/X/boxes.py``), the search to ``branching``.
"""
