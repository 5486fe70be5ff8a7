"""What lies in the beam of every frame of a sequence: leaves, letters, rails and cables that stand still before a
camera, and screws that move with a bone.

The stationary ones are those of :mod:`PolyPoseLib.simulation.degradations`, made once for the first frame: neither a
collimator nor a table follows a patient.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.simulation.degradations.anatomy import long_axis
from PolyPoseLib.simulation.degradations.degraded_case import View, stated_of, undegraded
from PolyPoseLib.simulation.degradations.detector import measure_view
from PolyPoseLib.simulation.degradations.registry import DEGRADATIONS
from PolyPoseLib.simulation.degradations.solids import TITANIUM, Rod, Solid, metal_line
from PolyPoseLib.simulation.motion import structure_points
from PolyPoseLib.simulation.moving_scene import seen_from_ct
from PolyPoseLib.simulation.simulate import SOURCE_TO_DETECTOR_MM, SimulatedCase, SimulationOptions
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.geometry.camera import Camera

STANDING = (
    "collimation_square",
    "collimation_tilted",
    "collimation_round",
    "collimation_black",
    "lead_letters",
    "table_rails",
    "ecg_leads",
)
"""Of DEGRADATIONS, those that stand still before a camera."""

SCREWS = "bone_screws"
"""Titanium screws in the largest bone that moves against the reference; the CT does not show them."""

NAMES = (*STANDING, SCREWS)

SCREW_RADIUS_MM, SCREW_HEAD_RADIUS_MM = 2.25, 4.0


@dataclass(frozen=True)
class Surroundings:
    """What lies in one camera's beam besides the patient.

    Attributes
    ----------
    added : (H, W) array
        Line integrals of what stands still.
    leaves : (H, W) array or None
        Share of the beam that the collimator lets through.
    blanked : (H, W) array of bool or None
        Pixels that the workstation paints over.

    """

    added: np.ndarray
    leaves: np.ndarray | None
    blanked: np.ndarray | None

    def measured(
        self,
        body: np.ndarray,
        line: np.ndarray,
        camera: Camera,
        physics: XrayPhysics,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """What the detector reports, (H, W) float32, of line integrals of the patient alone and with metal."""
        view = View(
            camera, body, line + self.added, line, stated_of(camera, SOURCE_TO_DETECTOR_MM), self.leaves
        )
        image = measure_view(view, physics, rng)
        return (
            image if self.blanked is None else np.where(self.blanked, np.float32(physics.saturation), image)
        )


@dataclass(frozen=True)
class Screws:
    """Metal in bones.

    Attributes
    ----------
    bone : int
        Of the K bones.
    solids : tuple of Solid
        In the CT, LPS mm.

    """

    bone: int
    solids: tuple[Solid, ...]

    def line(self, poses: np.ndarray, camera: Camera) -> np.ndarray:
        """Line integrals (H, W) in a posture, poses (K, 4, 4) rig to CT."""
        return metal_line(self.solids, TITANIUM, seen_from_ct(camera, poses[self.bone])).astype(np.float32)


def require_moving_degradations(names: Sequence[str]) -> None:
    """Raise InputError for a name that is none of NAMES, or is given twice."""
    for number, name in enumerate(names):
        if name not in NAMES:
            raise InputError(unknown_name("degradation of a sequence", name, NAMES))
        if name in names[:number]:
            raise InputError(f'The degradation "{name}" is given twice: give it once.')


def surroundings(
    names: Sequence[str],
    patient: tuple[Volume, Structures, str],
    views: Sequence[tuple[Camera, np.ndarray]],
    seed: int,
) -> list[Surroundings]:
    """What stands in the beams.

    Parameters
    ----------
    names : sequence of str
        Of STANDING.
    patient : (Volume, Structures, str)
        The CT, its structures and the reference.
    views : sequence of (Camera, (H, W) array)
        Cameras as the reference is seen in the first frame, in the CT's world, and its line integrals.
    seed : int
        Of every random choice; a kind draws the same numbers whatever others there are.

    """
    degraded = undegraded(_case(patient, views, seed))
    for name in names:
        rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
        degraded = DEGRADATIONS[name].change(degraded, rng)
    return [
        Surroundings((view.line - view.body).astype(np.float32), view.leaves, view.blanked)
        for view in degraded.views
    ]


def bone_screws(ct: Volume, structures: Structures, reference: str, seed: int) -> Screws:
    """Two screws across the middle of the largest bone but the reference, or of that where it is the only one."""
    counts = structures.voxel_counts()
    others = [n for n, name in enumerate(structures.names) if name != reference]
    bone = max(others or [0], key=lambda n: int(counts[n]))
    points = structure_points(structures, ct.affine)[structures.names[bone]]
    rng = np.random.default_rng([seed, zlib.crc32(SCREWS.encode())])
    axis = long_axis(points)
    along = points @ axis
    low, high = np.quantile(along, (0.4, 0.6))
    middle = points[(along >= low) & (along <= high)].mean(0)
    across = np.cross(axis, rng.normal(size=3))
    across /= np.linalg.norm(across)
    solids: list[Solid] = []
    for offset in (-9.0, 9.0):
        at = middle + (offset + rng.uniform(-2, 2)) * axis
        solids.append(Rod(at - 22 * across, at + rng.uniform(12, 20) * across, SCREW_RADIUS_MM))
        solids.append(Rod(at - 26 * across, at - 22 * across, SCREW_HEAD_RADIUS_MM))
    return Screws(bone, tuple(solids))


def bare(
    body: np.ndarray, line: np.ndarray, camera: Camera, physics: XrayPhysics, rng: np.random.Generator
) -> np.ndarray:
    """As `Surroundings.measured`, of a beam with nothing else in it."""
    if line is body:
        return measure(body, physics, rng)
    nothing = Surroundings(np.zeros_like(body), None, None)
    return nothing.measured(body, line, camera, physics, rng)


def _case(
    patient: tuple[Volume, Structures, str], views: Sequence[tuple[Camera, np.ndarray]], seed: int
) -> SimulatedCase:
    """The first frame as a case whose patient lies as in the CT."""
    ct, structures, reference = patient
    cameras, lines = [camera for camera, _ in views], [line for _, line in views]
    still = DisplacementField(np.zeros((2, 2, 2, 3), np.float32), ct.affine)
    return SimulatedCase(
        ct=ct,
        structures=structures,
        anchor=reference,
        images=lines,
        clean_images=lines,
        cameras=cameras,
        initial_cameras=cameras,
        fixed_to_moving={name: np.eye(4) for name in structures.names},
        fixed_ct=ct,
        fixed_labels=Volume(structures.labels, ct.affine),
        field=still,
        source_labels=None,
        fixed_source_labels=None,
        joints={},
        soft=None,
        statistics={},
        options=replace(SimulationOptions(), physics=XrayPhysics()),
        seed=seed,
    )
