"""What becomes of teeth when a mouth is opened by a warp: two smooth ones, and a CT composed of rigid bones."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
from jaw_anatomy import Head, mouth
from scipy.ndimage import binary_dilation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.evaluation.metrics import dice
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.warp.composition import compose_warped_ct
from PolyPoseLib.warp.dense import warp_volume
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff
from PolyPoseLib.warp.weights import DistanceMaps, distance_maps

ENAMEL_HU = 1800.0
"""Crowns are at least so dense in this CT, and hardly any other bone of the mouth is."""

FORMS = ("paper", "smooth", "composed")
"""The published average with weights of the CT's frame, the default's, and bones laid rigidly over the latter."""


ABOVE_SLICES = 16
"""Slices above the mouth that are composed with it, so that its upper end sees the bones beyond."""


def warped_mouths(head: Head, poses: Mapping[str, np.ndarray]) -> dict[str, Volume]:
    """The mouth (`jaw_anatomy.mouth`) in the fixed frame in each of FORMS, HU; poses: fixed to moving (4, 4), mm."""
    structures, ct, place = head.structures, head.ct, mouth(head)
    given = np.stack([poses[name] for name in structures.names])
    maps, share = _distances(head), structures.volume_share()
    reach = PRESETS["default"].rotation_reach_mm
    falloff = None if reach is None else RotationFalloff(reach, structures.centroids(ct.affine))
    paper = PolyrigidWarp(maps, share, given, "fixed", "mass")
    smooth = PolyrigidWarp(maps, share, given, "moving", "rigid", rotation_falloff=falloff)
    top = len(place.voxels) + ABOVE_SLICES
    low = Structures(structures.names, np.ascontiguousarray(structures.labels[:top]))
    return {
        "paper": warp_volume(ct, paper, place),
        "smooth": warp_volume(ct, smooth, place),
        "composed": compose_warped_ct(Volume(ct.voxels[:top], ct.affine), low, given, smooth, place),
    }


@cache
def _distances(head: Head) -> DistanceMaps:
    return distance_maps(head.structures, head.ct.affine)


def true_mouth(head: Head, fixed_ct: Volume) -> Volume:
    """The same part of a simulated case's CT in the fixed frame, whose grid is the head's, widened by whole voxels."""
    place = mouth(head)
    start = np.rint(fixed_ct.to_index(place.affine[:3, 3])).astype(int)[::-1]
    part = tuple(slice(a, a + n) for a, n in zip(start.tolist(), place.shape, strict=True))
    return place.with_voxels(fixed_ct.voxels[part])


def teeth_numbers(rest: Volume, true: Volume, found: Volume) -> dict[str, float]:
    """How the teeth of a warped mouth differ from those of the truth.

    Returns
    -------
    dict[str, float]
        "volume_ratio": volume denser than ENAMEL_HU over that at rest; "dice": of these voxels against the truth's;
        "extra_ml": of them more than a voxel away from any of the truth's, which is a third row of teeth where it has
        their form; "missing_ml": of the truth's more than a voxel away from any of them.

    """
    dense = {name: each.voxels >= ENAMEL_HU for name, each in (("rest", rest), ("true", true), ("is", found))}
    millilitre = float(np.prod(rest.spacing)) / 1000
    around = {
        name: np.asarray(binary_dilation(mask, np.ones((3, 3, 3))), bool) for name, mask in dense.items()
    }
    return {
        "volume_ratio": float(dense["is"].sum() / max(dense["rest"].sum(), 1)),
        "dice": float(dice(dense["is"], dense["true"])),
        "extra_ml": float((dense["is"] & ~around["true"]).sum() * millilitre),
        "missing_ml": float((dense["true"] & ~around["is"]).sum() * millilitre),
    }
