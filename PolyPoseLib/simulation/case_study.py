"""The study of a simulated case, in memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.simulation.simulate import SOURCE_TO_DETECTOR_MM, SimulatedCase


def case_to_study(
    case: SimulatedCase, options: Mapping[str, Any] | None = None, camera: str = "initial"
) -> Study:
    """The study of a case, without any file.

    Parameters
    ----------
    case : SimulatedCase
        Its CT, structures and X-rays are the study's.
    options : Mapping[str, Any], optional
        The study's options.
    camera : {"initial", "known", "absent"}
        "initial" gives the perturbed cameras as initial ones, "known" the true ones, "absent" none.

    Returns
    -------
    Study
        Ready to register.

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
    pitch = pixel_spacing(given, SOURCE_TO_DETECTOR_MM)
    return Xray(
        image=image,
        mask=np.ones(image.shape, dtype=bool),
        intrinsics=given.intrinsics,
        extrinsic=None if camera == "absent" else given.extrinsic,
        camera=camera,
        pixel_spacing_mm=pitch,
        source_to_detector_mm=SOURCE_TO_DETECTOR_MM,
        name=f"view {number + 1}",
        provenance=("simulated",),
        warnings=(),
        initial_radius=None,
    )


def given_camera(case: SimulatedCase, number: int, camera: str) -> Camera:
    """The camera that the study states for a view."""
    return (case.cameras if camera == "known" else case.initial_cameras)[number]


def pixel_spacing(camera: Camera, source_to_detector_mm: float) -> tuple[float, float]:
    """Pitch at the detector in mm, (between rows, between columns), that gives the camera's focal lengths."""
    columns, rows = (float(source_to_detector_mm / camera.intrinsics[axis, axis]) for axis in (0, 1))
    return rows, columns
