"""Descents of needle drives at fixed poses, compiled as a whole: motion, rows, programs and steps of one design."""
