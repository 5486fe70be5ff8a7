"""Metal drawn into an X-ray."""

import numpy as np


def rod(shape, rng, half_width_px=2.5, half_length=0.3):
    """(H, W) bool: a straight rod in a random direction through an X-ray's middle; half_length: over its height."""
    angle = rng.uniform(0, np.pi)
    rows, columns = np.indices(shape)
    across = (rows - shape[0] / 2) * np.cos(angle) - (columns - shape[1] / 2) * np.sin(angle)
    along = (rows - shape[0] / 2) * np.sin(angle) + (columns - shape[1] / 2) * np.cos(angle)
    return (np.abs(across) <= half_width_px) & (np.abs(along) < half_length * shape[0])
