"""Mechanics only: jitted, floats in, arrays out; no files, no logging, no exceptions."""
