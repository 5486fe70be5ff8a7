"""Poses of all bones together: joint fit, restarts, rejection."""
