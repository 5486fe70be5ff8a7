"""X-ray sequences with a known truth: bones of a CT in motion before cameras that stand still.

The truth shares no model with the tracking: bones move exactly rigidly by laws of their own, soft tissue follows
Laplace's equation, another program projects, and a detector model adds noise and scatter. Images are made when they
are read, so that long sequences need no memory; the same image is the same whenever it is read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.tracking.sequence import Sequence as TrackedSequence
from PolyPoseLib.data.tracking.sequence import TrackView
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import require_rigid
from PolyPoseLib.simulation.motion_laws import TimedMotion, motion_over_time
from PolyPoseLib.simulation.motions_in_time import GivenMotion, Joint, Motion, Waves
from PolyPoseLib.simulation.moving_degradations import SCREWS, STANDING, bone_screws, surroundings
from PolyPoseLib.simulation.moving_scene import MovingScene, seen_from_ct
from PolyPoseLib.simulation.named_motions import Anatomy
from PolyPoseLib.simulation.sequence_frames import KeptFrames, SimulatedFrames, Studio
from PolyPoseLib.simulation.sequence_options import SequenceOptions
from PolyPoseLib.simulation.simulate import structures_centre, view_cameras

if TYPE_CHECKING:
    from PolyPoseLib.geometry.camera import Camera

SWAY_HERTZ = 0.7, 1.3
"""Of the whole patient's slow motion, in cycles of a sequence."""

_ROOM_FRAMES = 25
"""Postures over the sequence that the grid of soft tissue is made wide enough for."""


@dataclass(frozen=True)
class SimulatedSequence:
    """One sequence: what a tracking gets, and the truth.

    Attributes
    ----------
    ct, structures, reference
        Given: the CT in HU, the structures on its grid, and the one relative to which others are reported.
    views : tuple of TrackView
        Given: cameras in the rig's world with images that are made when they are read.
    frames_per_second : float
        Given.
    poses : (F, K, 4, 4) array
        The truth in the middle of every frame's exposure, the rig's world to the CT's, LPS mm.
    initial_poses : dict[str, np.ndarray]
        Given: those of the first frame, off by a small error.
    options : SequenceOptions
        How the sequence was made.
    seed : int
        Of every random number.

    """

    ct: Volume
    structures: Structures
    reference: str
    views: tuple[TrackView, ...]
    frames_per_second: float
    poses: np.ndarray
    initial_poses: dict[str, np.ndarray]
    options: SequenceOptions
    seed: int

    def cut(self, reach_mm: float) -> SimulatedSequence:
        """The sequence whose CT is given only so far (mm) from the middle of the structures along its slices' normal.

        Images stay: bones go on beyond the CT, as a patient's do. Raises InputError where a structure vanishes.
        """
        middle = self.ct.to_index(structures_centre(self.structures, self.ct.affine))[2]
        reach = reach_mm / self.ct.spacing[2]
        first = int(max(np.ceil(middle - reach), 0))
        slices = slice(first, int(np.floor(middle + reach)) + 1)
        affine = self.ct.affine.copy()
        affine[:3, 3] = self.ct.to_world(np.array([0.0, 0.0, first]))
        structures = Structures(self.structures.names, self.structures.labels[slices])
        return replace(self, ct=Volume(self.ct.voxels[slices], affine), structures=structures)

    def tracked(self, options: TrackOptions | None = None, kept: bool = True, **fields) -> TrackedSequence:
        """What a tracking takes.

        Parameters
        ----------
        options : TrackOptions, optional
            Of the tracking.
        kept : bool
            Whether images that were read stay in memory, 1 MB each of 500 x 500 pixels.
        fields : object
            Others of :class:`PolyPoseLib.data.tracking.sequence.Sequence`, in place of those of this sequence.

        """
        views = tuple(
            TrackView(view.name, view.camera, KeptFrames(view.images) if kept else view.images, view.first)
            for view in self.views
        )
        given = {
            "ct": self.ct,
            "structures": self.structures,
            "views": views,
            "frames_per_second": self.frames_per_second,
            "reference": self.reference,
            "initial_poses": self.initial_poses,
            "options": options or TrackOptions(),
        }
        return TrackedSequence(**{**given, **fields})


def simulate_sequence(
    ct: Volume,
    structures: Structures,
    cameras: Sequence[Camera] | None = None,
    poses: np.ndarray | None = None,
    seed: int = 0,
    options: SequenceOptions | None = None,
    reference: str | None = None,
    anatomy: tuple[np.ndarray | None, Mapping[int, str]] = (None, {}),
    initial_error: tuple[float, float] = (1.0, 1.0),
) -> SimulatedSequence:
    """Make a sequence with a known truth.

    Parameters
    ----------
    ct : Volume
        Hounsfield units.
    structures : Structures
        Labels on the CT's grid; each moves as one rigid body.
    cameras : sequence of Camera, optional
        In the CT's world, as if the patient lay where the CT has them; the options' world takes them to the rig's. Two
        views by default, see :func:`rig_cameras`.
    poses : (F, K, 4, 4) array, optional
        Of every frame, the rig's world to the CT's, LPS mm; as the options' motion by default.
    seed : int
        Of every random number.
    options : SequenceOptions, optional
        How the sequence is made.
    reference : str, optional
        The structure that the others move against; the first one by default.
    anatomy : ((k, j, i) array or None, mapping of int to str)
        Labels of the full segmentation on the CT's grid and their names: breathing looks for lungs among them.
    initial_error : (float, float)
        Degrees and mm by which the initial poses are off.

    Returns
    -------
    SimulatedSequence
        The same arguments give the same images, bit for bit.

    Raises
    ------
    InputError
        Anything named above that is wrong.

    """
    options = options or SequenceOptions()
    reference = reference or structures.names[0]
    structures.index(reference)
    if structures.labels.shape != ct.shape:
        raise InputError(
            f"The labels have {structures.labels.shape} voxels but the CT {ct.shape}: use one grid."
        )
    draw, initial = (np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(2))
    if poses is None:
        seen = Anatomy(structures, ct.affine, reference, *anatomy)
        motion = _law(seen, options, draw)
    else:
        motion = TimedMotion(_table(ct, structures, np.asarray(poses, dtype=np.float64), options))
    rig = [
        each.with_extrinsic(each.extrinsic @ options.world) for each in cameras or rig_cameras(ct, structures)
    ]
    seconds = np.arange(options.frames) / options.frames_per_second
    true = poses_at(motion.bones, seconds, options.world)
    sampled = true[np.unique(np.linspace(0, len(true) - 1, _ROOM_FRAMES).astype(int))]
    scene = MovingScene.of(
        ct, structures, reference, sampled, options.soft_mm, options.node_mm, options.projector
    )
    motion = motion.on_coarser_voxels(ct, options.soft_mm)
    studio = Studio(scene, motion, tuple(rig), options, seed)
    _put_in_the_beam(studio, ct, structures, reference)
    views = tuple(
        TrackView(f"view {n + 1}", camera, SimulatedFrames(studio, n), options.first_of(n))
        for n, camera in enumerate(rig)
    )
    return SimulatedSequence(
        ct=ct,
        structures=structures,
        reference=reference,
        views=views,
        frames_per_second=options.frames_per_second,
        poses=true,
        initial_poses=_roughly(true[0], structures, ct, initial, initial_error),
        options=options,
        seed=seed,
    )


def _put_in_the_beam(studio: Studio, ct: Volume, structures: Structures, reference: str) -> None:
    """Give a studio what the options' degradations name."""
    names = studio.options.degradations
    if SCREWS in names:
        studio.screws = bone_screws(ct, structures, reference, studio.seed)
    standing = [name for name in names if name in STANDING]
    if standing:
        pose = studio.poses(np.zeros(1))[0, structures.index(reference)]
        views = [
            (seen_from_ct(camera, pose), studio.clean(number, 0.0)[0])
            for number, camera in enumerate(studio.cameras)
        ]
        found = surroundings(standing, (ct, structures, reference), views, studio.seed)
        studio.surroundings = tuple(found)


def rig_cameras(
    ct: Volume,
    structures: Structures,
    angles_deg: Sequence[float] = (20.0, 90.0),
    pixels: int = 500,
    detector_mm: float = 300.0,
    source_to_detector_mm: float = 1020.0,
    source_to_isocenter_mm: float = 750.0,
) -> list[Camera]:
    """Cameras about the middle of the structures, in the CT's world: biplane fluoroscopy, or one C-arm.

    Parameters as in :func:`PolyPoseLib.simulation.simulate.view_cameras`: 90 degrees look from the patient's left.
    """
    return view_cameras(
        ct,
        angles_deg,
        pixels,
        detector_mm,
        source_to_detector_mm,
        source_to_isocenter_mm,
        isocenter=structures_centre(structures, ct.affine),
    )


def poses_at(motion: Motion, seconds: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Poses (F, K, 4, 4), the rig's world to the CT's, at seconds (F,); world: (4, 4) rig to CT before any motion."""
    return np.linalg.inv(motion.at(seconds)) @ world


def _law(anatomy: Anatomy, options: SequenceOptions, rng: np.random.Generator) -> TimedMotion:
    """The motion that the options name."""
    times = (options.period_s, options.duration_s)
    sway = _sway(anatomy.points[anatomy.anchor].mean(0), options, rng)
    return motion_over_time(options.motion, options.amplitude, anatomy, times, rng, sway)


def _sway(centre: np.ndarray, options: SequenceOptions, rng: np.random.Generator) -> Joint:
    """A slow motion of the whole patient along and about every axis."""
    parts = []
    for size in [np.radians(options.sway_deg)] * 3 + [options.sway_mm] * 3:
        hertz = tuple(float(rng.uniform(0.8, 1.2) * f / options.duration_s) for f in SWAY_HERTZ)
        phases = tuple(float(phase) for phase in rng.uniform(0, 2 * np.pi, 2))
        parts.append(Waves((0.6 * size, 0.4 * size), hertz, phases))
    axes = np.eye(3)
    turns = list(zip(axes, parts[:3], strict=True))
    return Joint("", centre, turns, list(zip(axes, parts[3:], strict=True)))


def _table(ct: Volume, structures: Structures, poses: np.ndarray, options: SequenceOptions) -> GivenMotion:
    """The motion that poses (F, K, 4, 4) of all frames give; raises InputError when they are none."""
    if poses.shape != (options.frames, len(structures), 4, 4):
        raise InputError(
            f"The poses have the shape {poses.shape}: give one 4 x 4 matrix for each of {options.frames} frames and "
            f"{len(structures)} structures."
        )
    checked = np.array([[require_rigid(pose, "A pose") for pose in row] for row in poses])
    seconds = np.arange(options.frames) / options.frames_per_second
    motions = options.world @ np.linalg.inv(checked)
    return GivenMotion(structures.names, seconds, motions, structures.centroids(ct.affine))


def _roughly(
    poses: np.ndarray,
    structures: Structures,
    ct: Volume,
    rng: np.random.Generator,
    error: tuple[float, float],
) -> dict[str, np.ndarray]:
    """Poses (K, 4, 4) turned and shifted by degrees and mm about each structure's centroid."""
    from PolyPoseLib.simulation.motion import rigid_about

    rough = {}
    for name, pose, centre in zip(structures.names, poses, structures.centroids(ct.affine), strict=True):
        axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
        rough[name] = rigid_about(centre, np.radians(error[0]) * axis, error[1] * direction) @ pose
    return rough
