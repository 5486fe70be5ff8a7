"""Digitally reconstructed radiographs: rays, projector and fused kernels."""
