"""One case of a benchmark: what every system is given, and what it is scored against."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera


@dataclass(frozen=True, eq=False)
class HeldOutView:
    """An X-ray that no system sees: warped labels are rendered through its camera and compared with these masks.

    Attributes
    ----------
    name
        Of the view, for the tables.
    camera
        The true one, world to camera.
    pixel_spacing_mm
        At the detector, (between rows, between columns).
    masks
        {structure or organ: (H, W) bool}, True where a ray meets it in the fixed posture.

    """

    name: str
    camera: Camera
    pixel_spacing_mm: tuple[float, float]
    masks: Mapping[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class CaseTruth:
    """What a case is scored against, as far as its data set tells; at least one of labels, held_out, field, poses.

    Attributes
    ----------
    labels
        Labels of the fixed posture, numbered as the study's source segmentation, on any grid; or None.
    ct
        HU in the fixed posture, for pictures; or None.
    field
        From fixed to moving points; None where nobody knows it.
    poses
        {structure: (4, 4)} fixed to moving, LPS mm; empty where nobody knows them.
    held_out
        Views for scores in 2D.
    ends
        {structure: (N, 4) array}: of it only points x of the fixed posture, LPS mm, with
        ``ends[:, :3] @ x <= ends[:, 3]`` are scored, in the truth, whose labels and masks end there already, and in
        what a system answers. Structures that are not in it are scored everywhere.
    cameras
        The true cameras of the study's X-rays, in their order.

    """

    cameras: tuple[Camera, ...]
    labels: Volume | None = None
    ct: Volume | None = None
    field: DisplacementField | None = None
    poses: Mapping[str, np.ndarray] = dataclasses.field(default_factory=dict)
    held_out: tuple[HeldOutView, ...] = ()
    ends: Mapping[str, np.ndarray] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class BenchmarkCase:
    """One subject and one set of views.

    Attributes
    ----------
    name
        Unique in its data set, fit for a folder's name, without anything of the patient: "subject01-2x30".
    dataset, subject, views
        The columns of the tables: "headneck", "subject01", "2x30" (number of views x arc in degrees).
    study
        All that a system sees. Cameras are "known" and true unless the case is about finding them; the whole label map
        is its source_segmentation.
    labels
        {structure or organ: its numbers in the source segmentation}: everything that is scored.
    groups
        {group: names out of `labels`}, as the tables have them: {"bones": (...), "soft organs": (...)}.
    truth
        For the scores alone.
    projector
        What rendered the study's X-rays, with its version; empty for X-rays that the data set holds.

    """

    name: str
    dataset: str
    subject: str
    views: str
    study: Study
    labels: Mapping[str, tuple[int, ...]]
    groups: Mapping[str, tuple[str, ...]]
    truth: CaseTruth
    projector: str = ""

    def __post_init__(self) -> None:
        """Check that the parts fit together; raises InputError."""
        if len(self.truth.cameras) != len(self.study.xrays):
            raise InputError(
                f"{self.name}: {len(self.study.xrays)} X-rays, {len(self.truth.cameras)} cameras."
            )
        for group, names in self.groups.items():
            missing = [name for name in names if name not in self.labels]
            if missing:
                raise InputError(
                    f'{self.name}: the group "{group}" names "{missing[0]}", which has no labels.'
                )
