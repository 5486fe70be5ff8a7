"""CTs known again by their contents, wherever they lie and however they are stored."""

from __future__ import annotations

import hashlib
import json
from itertools import permutations

import numpy as np

from PolyPoseLib.data.volume import AIR_HU, Volume

_HIGHEST_HU = 32_767


def ct_digest(ct: Volume) -> str:
    """SHA256 (64 hexadecimal digits) of a CT's voxels in whole HU and their size.

    Where the CT lies in its world is left out: later scans are moved onto earlier ones, by a user for a training and by
    the benchmark for a case, and remain the same image. So is the order in which the axes are stored, the type of the
    numbers, and what padding below air is called. Images that were resampled are others.

    Parameters
    ----------
    ct : Volume
        HU.

    """
    axes = ct.affine[:3, :3] / ct.spacing
    # The grid's axis that runs most along each of the patient's: left, posterior, superior.
    order = max(permutations(range(3)), key=lambda each: sum(abs(axes[n, each[n]]) for n in range(3)))
    flips = tuple(slice(None, None, 1 if axes[n, order[n]] > 0 else -1) for n in range(3))
    voxels = ct.voxels.transpose([2 - axis for axis in order])[flips]
    sizes = [voxels.shape, np.round(ct.spacing[list(order)], 3).tolist()]
    digest = hashlib.sha256(json.dumps(sizes).encode())
    for slab in voxels:
        whole = np.clip(np.rint(np.nan_to_num(slab)), AIR_HU, _HIGHEST_HU)
        digest.update(np.ascontiguousarray(whole, dtype="<i2").data)
    return digest.hexdigest()
