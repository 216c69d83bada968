"""Searches from many starts, in this process or in several, and the reliability of their result."""
