"""Clinic-like faults of X-rays and inputs, made on simulated cases: one small function a fault."""
