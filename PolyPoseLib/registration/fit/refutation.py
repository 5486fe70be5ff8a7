"""Whether the X-rays tell one set of poses from another."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.registration.fit.problem import RigidProblem, State

PATCHES_PER_CLUSTER = 2
"""Clusters are this many patches of the local contrast wide."""

DISTINGUISHABLE = 3.0
"""Standard deviations of the difference between two costs, beyond which the worse poses are refuted."""


def is_refuted(problem: RigidProblem, found: State, other: State) -> bool:
    """Whether the X-rays fit ``found`` significantly better than ``other``.

    The difference of the weighted squared residuals is summed within patches, over which the residual is correlated;
    the spread of these sums is that of their total.
    """
    total, variance = 0.0, 0.0
    for n, view in enumerate(problem.views):
        here, there = (problem.residual(state, n).astype(np.float64) ** 2 for state in (found, other))
        worse = (view.weight * (there - here))[None]
        sums = cluster_sums(worse, PATCHES_PER_CLUSTER * view.contrast.size)
        total += float(sums.sum())
        variance += float((sums**2).sum())
    return total > DISTINGUISHABLE * np.sqrt(variance)


def cluster_sums(images: np.ndarray, size: int) -> np.ndarray:
    """Sums (p, clusters) of (p, H, W) over square clusters of ``size`` pixels."""
    count, height, width = images.shape
    padded = np.pad(images, ((0, 0), (0, -height % size), (0, -width % size)))
    blocks = padded.reshape(count, -(-height // size), size, -(-width // size), size)
    return blocks.sum(axis=(2, 4), dtype=np.float64).reshape(count, -1)
