"""Synthesis of mechanisms from requirements: loci, acceptance tests, and the eight tasks of the engineering method."""
