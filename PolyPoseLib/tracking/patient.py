"""Everything that stays the same from frame to frame: the CT taken apart, its soft tissue, and the cameras."""

from __future__ import annotations

from copy import copy

import numpy as np

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.magnification import magnification_of, magnified_motion, magnified_volume
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene, body_points
from PolyPoseLib.rendering.select import resolve_device, select_backend, torch_device_of

BODY_MM = 3.0
"""Voxels of the points by which a bone's size and place are known."""


class Patient:
    """A sequence's CT, structures and cameras, larger than the patient by one factor where the anatomy is small.

    Poses of this class and of everything that is fitted are those of the larger scene; :meth:`at_true_size` and
    :meth:`enlarged` go between it and the patient's millimetres.

    Parameters
    ----------
    sequence : Sequence
        What is tracked.
    monitor : Monitor
        Takes the progress.

    Attributes
    ----------
    run : Run
        The scene with its smooth warp, the renderer and the monitor.
    factor : float
        How many times the scene is larger than the patient.
    points : list of (N, 3) ndarray
        Of every structure in the CT, LPS mm of the scene.
    radii : (K,) ndarray
        Root mean square distance of every structure's points from its centroid, mm of the scene.
    voxel_mm : float
        Of the CT, the mean of its three sides, in the scene.
    has_soft_tissue : bool
        Whether the CT holds more than bones.
    still, moving : list of int
        Indices of the structures that keep their first pose, and of all others.
    vouched : list of int
        Those of the still ones whose pose somebody gave.

    """

    def __init__(self, sequence: Sequence, monitor: Monitor) -> None:
        options = sequence.options
        self.sequence = sequence
        self.factor = magnification_of(sequence)
        ct = magnified_volume(sequence.ct, self.factor)
        scene = Scene(ct, sequence.structures, sequence.reference)
        self.device = resolve_device("auto" if options.kernel == "torch" else "cpu")
        backend = select_backend(options.kernel, self.device, options.threads)
        preset = PRESETS["default"]
        reach = preset.rotation_reach_mm
        device = torch_device_of(backend)
        soft = SoftTissue(scene, preset.weight_frame, preset.weights, rotation_reach_mm=reach, device=device)
        self.run = Run(soft, backend, monitor, "tracking", magnification=self.factor)
        self.points = [body_points(body, 500) for body in scene.bodies(BODY_MM)]
        self.radii = np.array([_radius(each) for each in self.points])
        self.voxel_mm = float(ct.spacing.mean())
        self.has_soft_tissue = bool(scene.soft.voxels.any())
        self.still = [k for k, name in enumerate(scene.names) if name in sequence.still]
        self.vouched = [k for k in self.still if scene.names[k] in sequence.initial_poses]
        self.moving = [k for k in range(len(scene.names)) if k not in self.still]

    @property
    def scene(self) -> Scene:
        """The CT taken apart for rendering."""
        return self.run.scene

    @property
    def reference(self) -> int:
        """Index of the structure that the soft tissue is tied to."""
        return self.scene.anchor

    def enlarged(self, poses: np.ndarray) -> np.ndarray:
        """Poses (..., 4, 4) of the patient in the scene."""
        return _scaled(poses, self.factor)

    def at_true_size(self, poses: np.ndarray) -> np.ndarray:
        """Poses (..., 4, 4) of the scene in the patient's mm."""
        return _scaled(poses, 1 / self.factor)

    def covariances_at_true_size(self, covariances: np.ndarray) -> np.ndarray:
        """Covariances (..., 6, 6) of poses of the scene for the patient's mm."""
        scale = np.r_[np.ones(3), np.full(3, 1 / self.factor)]
        return covariances * np.outer(scale, scale)

    def observations(self, frame: int) -> list[Observation]:
        """The X-rays of a frame of the sequence, in the scene; raises InputError when an image cannot be used."""
        found = []
        for view in self.sequence.views:
            index = view.first + frame
            image, mask = view.images.read(index)
            camera = view.camera
            if image.shape != (camera.height, camera.width) or mask.shape != image.shape:
                raise InputError(
                    f'Image {index} of the camera "{view.name}" has {image.shape[0]} x {image.shape[1]} pixels, its '
                    f"calibration {camera.height} x {camera.width}: give images of the size that was calibrated."
                )
            mask = mask & np.isfinite(image)
            image = np.where(mask, image, 0).astype(np.float32) * np.float32(self.factor)
            larger = camera.with_extrinsic(magnified_motion(camera.extrinsic, self.factor))
            found.append(Observation(image, mask, larger))
        return found


def seen_from(observations: list[Observation], base: np.ndarray) -> list[Observation]:
    """X-rays in the world in which a pose (4, 4), rig to moving, is the identity.

    Parameters
    ----------
    observations : list of Observation
        In the rig's world.
    base : (4, 4) ndarray
        The pose; other poses T are T base^-1 in that world.

    Returns
    -------
    list of Observation
        With their cameras in it.

    """
    back = rigid_inverse(base)
    return [
        each.with_camera(each.camera.with_extrinsic(each.camera.extrinsic @ back)) for each in observations
    ]


def cropped(observation: Observation, rows: slice, columns: slice) -> Observation:
    """A part of an X-ray; its noise is that of the whole."""
    part = copy(observation)
    fields = {
        "image": observation.image[rows, columns],
        "mask": observation.mask[rows, columns],
        "noise": observation.noise[rows, columns],
        "camera": observation.camera.cropped(rows.start, rows.stop, columns.start, columns.stop),
    }
    for name, value in fields.items():
        object.__setattr__(part, name, value)
    return part


def _scaled(poses: np.ndarray, factor: float) -> np.ndarray:
    scaled = np.array(poses, dtype=np.float64)
    scaled[..., :3, 3] *= factor
    return scaled


def _radius(points: np.ndarray) -> float:
    return float(np.sqrt(points.var(axis=0).sum()))
