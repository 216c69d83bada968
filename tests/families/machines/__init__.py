"""Tests of machines: gaps of capsules, moments of a stitch, places of members and shafts."""
