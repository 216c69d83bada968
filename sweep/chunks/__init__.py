"""Chunks of a sweep: their cut from the design space, and the cascade of routes and limits that computes them."""
