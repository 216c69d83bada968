"""Searches from many starts, here or in processes, and how far they can be relied upon."""
