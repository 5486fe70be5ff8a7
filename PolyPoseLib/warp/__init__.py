"""Polyrigid warps: weights, points, dense fields."""
