"""Starts of searches: from samples, datasets, and populations of descents."""
