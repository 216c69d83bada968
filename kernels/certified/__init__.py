"""Proofs of peaks: polynomials with proven remainders, and the walk over cells that bounds a maximum."""
