"""Bones followed from frame to frame of X-ray sequences."""
