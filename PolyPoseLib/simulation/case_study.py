"""The study that a simulated case poses, in memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.simulation.simulate import SimulatedCase


def case_to_study(
    case: SimulatedCase, options: Mapping[str, Any] | None = None, camera: str = "initial"
) -> Study:
    """The study that a case poses, without any file.

    camera: "initial" gives the perturbed cameras as a guess, "known" the true ones.
    """
    return Study(
        ct=case.ct,
        structures=case.structures,
        anchor=case.anchor,
        xrays=tuple(_xray(case, number, camera) for number in range(len(case.images))),
        options=dict(options or {}),
        source_segmentation=case.source_labels,
    )


def _xray(case: SimulatedCase, number: int, camera: str) -> Xray:
    """One view of the case as an X-ray that was read."""
    given = given_camera(case, number, camera)
    image = case.images[number]
    pitch = pixel_spacing(given, 1020.0)
    return Xray(
        image=image,
        mask=np.ones(image.shape, dtype=bool),
        intrinsics=given.intrinsics,
        extrinsic=None if camera == "absent" else given.extrinsic,
        camera=camera,
        pixel_spacing_mm=pitch,
        source_to_detector_mm=1020.0,
        name=f"view {number + 1}",
        provenance=("simulated",),
        warnings=(),
        initial_radius=None,
    )


def given_camera(case: SimulatedCase, number: int, camera: str) -> Camera:
    """What the study says of a camera."""
    return (case.cameras if camera == "known" else case.initial_cameras)[number]


def pixel_spacing(camera: Camera, source_to_detector_mm: float) -> tuple[float, float]:
    """Pitch at the detector in mm, (between rows, between columns), that gives the camera's focal lengths."""
    return tuple(float(source_to_detector_mm / camera.intrinsics[axis, axis]) for axis in (1, 0))
