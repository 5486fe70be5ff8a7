"""Rigid motions, cameras and C-arm angles."""
