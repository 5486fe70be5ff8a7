"""Cases with a known truth: a CT whose bones were moved, X-rays of it, and cameras known only roughly.

The truth shares no model with the registration: bones move exactly rigidly about their joints, soft tissue
follows Laplace's equation or that of elasticity, another program projects, and a detector model adds noise,
scatter, saturation and rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import find_objects

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.simulation import independent_projector, simulation_limits
from PolyPoseLib.simulation.case_statistics import case_statistics
from PolyPoseLib.simulation.motion import JointMotion, apply, draw_motions, rigid_about
from PolyPoseLib.simulation.named_motions import Anatomy, Posture, named_posture
from PolyPoseLib.simulation.posed_ct import pose_ct
from PolyPoseLib.simulation.simulation_limits import (
    DRAWN,
    require_distances,
    require_few_pixels,
    require_in_range,
    require_motion,
)
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

if TYPE_CHECKING:
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.simulation.soft_motion import SoftMotion

INITIAL_ROTATION_DEG = 4.0
INITIAL_TRANSLATION_MM = 15.0
"""Error of the initial cameras."""

SOURCE_TO_DETECTOR_MM = 1020.0
"""Distance from the source to the detector of a common C-arm."""


@dataclass(frozen=True)
class SimulationOptions:
    """How a case is made; lengths in mm.

    Attributes
    ----------
    physics : XrayPhysics
        What the detector makes of clean line integrals.
    node_mm : float
        Grid of the soft field.
    pad_mm : float
        Least room around the CT for anatomy that moves out of it; it grows where a bone moves farther.
    ends : str
        "cut" or "continued" (the end slices go on beyond the CT).
    slide_mm : float
        Random shift of joints.
    motion_scale : float
        Factor on drawn motions.
    rotation_deg, translation_mm : float
        Error of the initial cameras.
    projector : str
        "auto", "rtk" or "sum".
    tissue : str
        Law of the soft tissue, "harmonic" or "elastic" (which is slower: give a node_mm of 8 or so).
    motion : str
        "drawn" turns every bone about its joint at random; "breathing", "gait", "flexion" and "jaw" are named ones, see
        :mod:`PolyPoseLib.simulation.named_motions`.
    amplitude : float, optional
        Of a named motion: mm by which the diaphragm descends, degrees of the others; the usual one by default.

    """

    physics: XrayPhysics = field(default_factory=XrayPhysics)
    node_mm: float = 3.0
    pad_mm: float = 20.0
    ends: str = "cut"
    slide_mm: float = 1.0
    motion_scale: float = 1.0
    rotation_deg: float = INITIAL_ROTATION_DEG
    translation_mm: float = INITIAL_TRANSLATION_MM
    projector: str = "auto"
    tissue: str = "harmonic"
    motion: str = DRAWN
    amplitude: float | None = None

    def __post_init__(self) -> None:
        """Check the ranges; raises InputError."""
        for name, limits in simulation_limits.OPTIONS.items():
            require_in_range(getattr(self, name), limits, f"The simulation's {name}")
        require_motion(self.motion, self.amplitude, ("its motion", "The simulation's amplitude"))
        if self.ends not in ("cut", "continued"):
            raise InputError('The simulation\'s ends must be "cut" or "continued".')
        if self.tissue not in ("harmonic", "elastic"):
            raise InputError('The simulation\'s tissue must be "harmonic" or "elastic".')


@dataclass(frozen=True)
class SimulatedCase:
    """One case in memory: what a registration gets, and the truth.

    Attributes
    ----------
    ct, structures, anchor
        Given to a registration: the CT in HU, the structures on its grid, and the one that stays.
    images : list[np.ndarray]
        Given: (H, W) float32 line integrals as measured.
    clean_images : list[np.ndarray]
        The same before the detector.
    cameras : list[Camera]
        The true ones.
    initial_cameras : list[Camera]
        Given: the perturbed ones.
    fixed_to_moving : dict[str, np.ndarray]
        {structure: true motion (4, 4), LPS mm}.
    fixed_ct, fixed_labels : Volume
        The CT in HU and the structure numbers in the fixed posture, on the CT's grid, which is widened where a bone
        moves out of it.
    field : DisplacementField
        The true displacement, fixed to moving, on the nodes of the soft field; rigid in bones.
    source_labels, fixed_source_labels : Volume, optional
        The full segmentation in both postures, when one was given.
    joints : dict[str, JointMotion]
        How the motions were drawn; empty when they were given.
    soft : SoftMotion, optional
        What soft organs did by themselves, in a named motion.
    statistics : dict
        Numbers per structure and for the case (rest TRE in mm, overlap, share in each view, folds in percent).
    options : SimulationOptions
        How the case was made.
    seed : int
        Of every random number.

    """

    ct: Volume
    structures: Structures
    anchor: str
    images: list[np.ndarray]
    clean_images: list[np.ndarray]
    cameras: list[Camera]
    initial_cameras: list[Camera]
    fixed_to_moving: dict[str, np.ndarray]
    fixed_ct: Volume
    fixed_labels: Volume
    field: DisplacementField
    source_labels: Volume | None
    fixed_source_labels: Volume | None
    joints: dict[str, JointMotion]
    soft: SoftMotion | None
    statistics: dict
    options: SimulationOptions
    seed: int


def simulate_case(
    ct: Volume,
    structures: Structures,
    motions: dict[str, np.ndarray] | None = None,
    cameras: Sequence[Camera] | None = None,
    seed: int = 0,
    options: SimulationOptions | None = None,
    anchor: str | None = None,
    source_labels: Volume | None = None,
    organ_names: Mapping[int, str] | None = None,
) -> SimulatedCase:
    """Make a case with a known truth.

    Parameters
    ----------
    ct : Volume
        Hounsfield units.
    structures : Structures
        Labels on the CT's grid.
    motions : dict[str, np.ndarray], optional
        {structure: (4, 4) moving to fixed, LPS mm}; a structure that is missing stays. As the options' motion by
        default.
    cameras : Sequence[Camera], optional
        True cameras; two views of the structures 30 degrees apart by default.
    seed : int
        Of every random number (motions, noise and initial cameras each have a stream of their own).
    options : SimulationOptions, optional
        How the case is made.
    anchor : str, optional
        The structure that stays; the first one by default.
    source_labels : Volume, optional
        The full segmentation on the CT's grid, to be moved likewise (for soft organs).
    organ_names : Mapping[int, str], optional
        Names of its labels: breathing looks for the lungs, the liver and the heart among them.

    Returns
    -------
    SimulatedCase
        The same arguments give the same case, bit for bit.

    Raises
    ------
    InputError
        Anything named above that is wrong, a moved anchor included.

    """
    options = options or SimulationOptions()
    anchor = anchor or structures.names[0]
    _check(ct, structures, motions, anchor, source_labels)
    draw, noise, initial = (np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(3))
    posture = Posture({})
    if motions is None:
        posture = _posture(ct, structures, anchor, draw, options, source_labels, organ_names or {})
        motions = {name: joint.moving_to_fixed for name, joint in posture.joints.items()}
    fixed_to_moving = {name: np.linalg.inv(motions.get(name, np.eye(4))) for name in structures.names}
    posed = pose_ct(
        ct,
        structures,
        fixed_to_moving,
        None if source_labels is None else source_labels.voxels,
        options.node_mm,
        options.pad_mm,
        options.ends,
        options.tissue,
        posture.soft,
    )
    centre = structures_centre(structures, ct.affine)
    cameras = list(cameras) if cameras is not None else view_cameras(ct, isocenter=centre)
    attenuation = Volume(hounsfield_to_attenuation(posed.hu), posed.grid.affine)
    clean = [independent_projector.project(attenuation, camera, options.projector) for camera in cameras]
    grid = posed.grid
    box = grid.box_with(posed.labels > 0)
    affine = ct.affine if box == grid.core_box else grid.affine_of(box)
    return SimulatedCase(
        ct=ct,
        structures=structures,
        anchor=anchor,
        images=[measure(image, options.physics, noise) for image in clean],
        clean_images=clean,
        cameras=cameras,
        initial_cameras=[
            perturbed_camera(camera, centre, initial, options.rotation_deg, options.translation_mm)
            for camera in cameras
        ],
        fixed_to_moving=fixed_to_moving,
        fixed_ct=Volume(np.ascontiguousarray(posed.hu[box]), affine),
        fixed_labels=Volume(np.ascontiguousarray(posed.labels[box]), affine),
        field=DisplacementField(np.ascontiguousarray(np.moveaxis(posed.nodes, 0, -1)), grid.node_affine),
        source_labels=source_labels,
        fixed_source_labels=None
        if posed.source_labels is None
        else Volume(np.ascontiguousarray(posed.source_labels[box]), affine),
        joints=posture.joints,
        soft=posture.soft,
        statistics=case_statistics(ct, structures, fixed_to_moving, cameras, posed),
        options=options,
        seed=seed,
    )


def _posture(
    ct: Volume,
    structures: Structures,
    anchor: str,
    rng: np.random.Generator,
    options: SimulationOptions,
    source_labels: Volume | None,
    organ_names: Mapping[int, str],
) -> Posture:
    """The posture that the options ask for."""
    if options.motion == DRAWN:
        return Posture(
            draw_motions(structures, ct.affine, anchor, rng, options.slide_mm, options.motion_scale)
        )
    labels = None if source_labels is None else source_labels.voxels
    anatomy = Anatomy(structures, ct.affine, anchor, labels, organ_names)
    return named_posture(options.motion, options.amplitude, anatomy, rng)


def view_cameras(
    ct: Volume,
    angles_deg: Sequence[float] = (0.0, 30.0),
    pixels: int = 400,
    detector_mm: float = 430.0,
    source_to_detector_mm: float = SOURCE_TO_DETECTOR_MM,
    source_to_isocenter_mm: float = 750.0,
    isocenter: np.ndarray | None = None,
) -> list[Camera]:
    """Cameras on an arc about the cranio-caudal axis through the isocenter.

    Parameters
    ----------
    ct : Volume
        Its middle is the isocenter, unless one is given.
    angles_deg : Sequence[float]
        0 is antero-posterior (source in front); positive turns the source to the patient's left.
    pixels : int
        Rows and columns of the square detector.
    detector_mm : float
        Side of the detector.
    source_to_detector_mm : float
        Distance from the source to the detector.
    source_to_isocenter_mm : float
        Distance from the source to the isocenter.
    isocenter : (3,) array, optional
        LPS mm.

    Returns
    -------
    list[Camera]
        One for each angle.

    Raises
    ------
    InputError
        More views or pixels than can be made, or distances that do not fit.

    """
    require_few_pixels(len(angles_deg), pixels)
    require_distances(
        source_to_detector_mm, source_to_isocenter_mm, ("source_to_detector_mm", "source_to_isocenter_mm")
    )
    centre = ct.bounds_center if isocenter is None else np.asarray(isocenter, dtype=np.float64)
    intrinsics = intrinsics_matrix(source_to_detector_mm, detector_mm / pixels, pixels, pixels)
    cameras = []
    for angle in np.radians(angles_deg):
        source = centre + source_to_isocenter_mm * np.array([np.sin(angle), -np.cos(angle), 0.0])
        cameras.append(Camera(intrinsics, look_at(source, centre), pixels, pixels))
    return cameras


def structures_centre(structures: Structures, affine: np.ndarray) -> np.ndarray:
    """Middle (3,) in LPS mm of the box that holds all structures: where a person would put the isocenter."""
    boxes = find_objects((structures.labels > 0).astype(np.int8))
    return apply(affine, np.array([(part.start + part.stop - 1) / 2 for part in boxes[0]])[::-1])


def arc_angles(views: int, arc_deg: float) -> list[float]:
    """Angles of views spread evenly over an arc, starting at 0: two over 30 give 0 and 30; raises InputError."""
    require_in_range(views, simulation_limits.VIEWS, "views", "whole number")
    return [0.0] if views == 1 else np.linspace(0, arc_deg, views).tolist()


def perturbed_camera(
    camera: Camera, centre: np.ndarray, rng: np.random.Generator, rotation_deg: float, translation_mm: float
) -> Camera:
    """The camera rotated by rotation_deg about a random axis through centre and shifted by translation_mm."""
    axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    error = rigid_about(np.asarray(centre), np.radians(rotation_deg) * axis, translation_mm * direction)
    return camera.with_extrinsic(camera.extrinsic @ error)


def _check(
    ct: Volume,
    structures: Structures,
    motions: dict[str, np.ndarray] | None,
    anchor: str,
    source_labels: Volume | None,
) -> None:
    """Refuse arguments that do not fit together."""
    if structures.labels.shape != ct.shape:
        raise InputError(
            f"The labels have {structures.labels.shape} voxels but the CT {ct.shape}: use one grid."
        )
    if source_labels is not None and not source_labels.same_grid(ct):
        raise InputError("source_labels must lie on the CT's grid: resample them onto it first.")
    if anchor not in structures.names:
        raise InputError(f"The anchor {anchor!r} is not among the structures {', '.join(structures.names)}.")
    for name in motions or {}:
        if name not in structures.names:
            raise InputError(
                f"There is a motion for {name!r}, which is not among {', '.join(structures.names)}."
            )
    if motions and not np.allclose(motions.get(anchor, np.eye(4)), np.eye(4)):
        raise InputError(f"The anchor {anchor!r} defines the cameras and cannot move: leave out its motion.")
