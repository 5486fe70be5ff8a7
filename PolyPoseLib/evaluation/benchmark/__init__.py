"""Scores of compared systems, and what is said of them over subjects."""
