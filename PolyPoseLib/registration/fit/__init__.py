"""The least-squares problem at one resolution level, and its solver."""
