"""What is checked of a study's X-rays and given cameras together, before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from PolyPoseLib.data.camera_checks import check_camera, narrow_views, structure_points
from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.data.xray import Xray

MOST_COMPARED = 30
"""X-rays that are compared with each other, the first of a study: the time grows with their square."""


def odd_views(xrays: Sequence[Xray]) -> tuple[str, ...]:
    """Warnings about two X-rays that show one view.

    Raises
    ------
    InputError
        Two files hold the same picture, whatever their names, format and grey levels.

    """
    from PolyPoseLib.similarity.same_picture import SAME_PICTURE, SAME_VIEW, detail_of, likeness

    warnings: list[str] = []
    details = [detail_of(each.image, each.mask) for each in xrays[:MOST_COMPARED]]
    for number, detail in enumerate(details):
        for other, earlier in enumerate(details[:number]):
            fine, coarse = likeness(earlier, detail)
            if fine > SAME_PICTURE:
                raise InputError(
                    f'"xrays"[{number}] shows the same picture as "xrays"[{other}]: remove one of them, or give the '
                    "view that was meant."
                )
            if coarse > SAME_VIEW:
                warnings.append(
                    f'"{xrays[other].name}" and "{xrays[number].name}" show nearly the same view, as one X-ray twice '
                    "would: how far a structure moved along its rays is poorly known; check the files."
                )
    return tuple(warnings)


def odd_cameras(
    xrays: Sequence[Xray],
    entries: Sequence[Mapping[str, Any]],
    structures: Structures,
    affine: np.ndarray,
    anchor: str,
) -> tuple[str, ...]:
    """Warnings about given cameras.

    Parameters
    ----------
    xrays
        As read.
    entries
        Of the X-rays, as the study file has them.
    structures
        On the CT's grid.
    affine
        (4, 4) of the CT, maps (i, j, k, 1) to LPS mm.
    anchor
        The anchor's name.

    Raises
    ------
    InputError
        A camera that cannot have taken its X-ray, see `PolyPoseLib.data.camera_checks.check_camera`.

    """
    if all(xray.extrinsic is None for xray in xrays):
        return ()
    bones = structure_points(structures, affine)
    of_anchor = structure_points(structures, affine, anchor)
    found = [
        check_camera(xray, of_anchor, bones, _states_distance(entry))
        for xray, entry in zip(xrays, entries, strict=True)
    ]
    return (*(each for each in found if each is not None), *narrow_views(xrays))


def _states_distance(entry: Mapping[str, Any]) -> bool:
    """Whether an X-ray's distance to the detector is more than the nominal one that goes with intrinsics."""
    nominal = entry.get("intrinsics") is not None or entry.get("calibration") is not None
    return not nominal or any(
        entry.get(field) is not None for field in ("source_to_detector_mm", "pixel_spacing_mm")
    )
