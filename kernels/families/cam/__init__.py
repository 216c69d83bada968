"""Cams with a roller follower that slides or swings, for a given law of motion.

``law`` gives the follower's motion, ``translating`` and ``swinging`` what it means for the follower and the cam.
"""
