"""Voxels with the values of CTs: air, lung, fat, muscle and bone in random shares, with noise and mixed edges."""

import numpy as np

from PolyPoseLib.data.volume import Volume

SHAPE = (24, 40, 40)


def random_ct(rng: np.random.Generator, air: float | None = None, bone: float | None = None) -> np.ndarray:
    """(k, j, i) float Hounsfield units; air: share of the voxels, bone: share of the body, random when None."""
    count = int(np.prod(SHAPE))
    air = rng.uniform(0.05, 0.9) if air is None else air
    bone = rng.uniform(0.02, 0.3) if bone is None else bone
    lung = rng.uniform(0, 0.3) * (rng.random() < 0.4)
    fat = rng.uniform(0.1, 0.5)
    tissue = np.array([lung, fat, 1 - fat])
    tissue = tissue / tissue.sum() * (1 - bone)
    shares = np.array([air, *(1 - air) * np.array([*tissue, 0.6 * bone, 0.4 * bone])])
    kinds = rng.choice(6, count, p=shares / shares.sum())
    dense = rng.uniform(400, 1600, count)
    values = np.choose(
        kinds,
        [
            np.full(count, -1000.0),
            rng.normal(-850, 60, count),
            rng.normal(-105, 15, count),
            rng.normal(55, 15, count),
            rng.normal(220, 90, count),
            dense,
        ],
    )
    mixed = rng.random(count) < rng.uniform(0.02, 0.15)
    values[mixed] += rng.random(mixed.sum()) * (rng.permutation(values)[mixed] - values[mixed])
    values += rng.normal(0, rng.uniform(5, 40), count)
    return np.clip(np.round(values), -1024, 3071).reshape(SHAPE)


def padded(values: np.ndarray, padding: float) -> np.ndarray:
    """The same with a padding outside the round field of view."""
    row, column = np.indices(values.shape[1:]) - (np.array(values.shape[1:]).reshape(2, 1, 1) - 1) / 2
    outside = np.hypot(row, column) > values.shape[1] / 2
    return np.where(outside, padding, values)


def as_volume(values: np.ndarray) -> Volume:
    """On a grid of 1 mm."""
    return Volume(values.astype(np.float32), np.eye(4))
