"""Measures of accuracy, and simulated cases with a known truth."""
