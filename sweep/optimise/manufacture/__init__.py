"""Manufacture of a design: tolerances, margins of limits for them, and designs whose mechanisms keep the limits."""
