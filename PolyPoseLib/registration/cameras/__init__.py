"""Cameras from the anchor: initial cameras, search, refinement, rigs."""
