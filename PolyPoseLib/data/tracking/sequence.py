"""What is tracked: one CT, its structures, and the X-ray sequences of calibrated cameras."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from PolyPoseLib.data.segmentation import checked_source
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.data.tracking.track_inputs import TrackInputs, inputs_of
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import require_rigid


class FrameImages(Protocol):
    """The images of one camera, read one at a time so that memory stays bounded."""

    @property
    def count(self) -> int:
        """Number of images."""
        ...

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        """One image (H, W) float32 line integrals and its mask (H, W) bool; raises InputError."""
        ...


@dataclass(frozen=True, eq=False)
class TrackView:
    """One calibrated camera with its images.

    Parameters
    ----------
    name : str
        Shown to people, and in results.
    camera : Camera
        Of every image, undistorted; its extrinsic maps the rig's world (mm) to the camera.
    images : FrameImages
        In the order of time.
    first : int
        Index of the image that belongs to the sequence's first frame; the offset between cameras.

    """

    name: str
    camera: Camera
    images: FrameImages
    first: int = 0


@dataclass(frozen=True, eq=False)
class Sequence:
    """Everything that tracking needs; a sequence that exists is valid.

    Parameters
    ----------
    ct : Volume
        Hounsfield units.
    structures : Structures
        On the CT's grid; every one is tracked.
    views : tuple of TrackView
        At least one.
    frames_per_second : float
        Of all cameras.
    initial_poses : mapping of str to (4, 4) array
        Of structures in the first frame, the rig's world (fixed) to the CT's LPS mm (moving). Structures without one
        start where the CT has them relative to the reference, or to the first structure that has one where the
        reference has none; or as ``options.start`` says.
    reference : str
        The structure relative to which others are reported, and the anchor where the first frame is registered.
    still : tuple of str
        Structures that do not move during the sequence.
    landmarks : mapping of str to (3,) array
        Points of the CT, LPS mm, that name the axes of joint coordinate systems, each under the name of its structure
        and its own: "femur_left.medial_epicondyle".
    options : TrackOptions
        How to track.
    warnings : tuple of str
        What was odd but not wrong.
    joints : tuple of Joint
        Whose motion is reported; without any, that of every structure relative to the reference.
    source_segmentation : Volume or None
        The label map that the structures were made of, on the CT's grid; None when it has overlapping layers.
    label_names : mapping of int to str
        Names of its labels as far as they are known, for messages.

    Raises
    ------
    InputError
        The parts do not fit together; the sentence names them and the fix.

    """

    ct: Volume
    structures: Structures
    views: tuple[TrackView, ...]
    frames_per_second: float
    reference: str
    initial_poses: Mapping[str, np.ndarray] = field(default_factory=dict)
    still: tuple[str, ...] = ()
    landmarks: Mapping[str, np.ndarray] = field(default_factory=dict)
    options: TrackOptions = field(default_factory=TrackOptions)
    warnings: tuple[str, ...] = ()
    joints: tuple[Joint, ...] = ()
    source_segmentation: Volume | None = None
    label_names: Mapping[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the parts fit together; raises InputError."""
        if not self.views:
            raise InputError("A sequence needs the images of at least one camera, or better of two.")
        if self.structures.labels.shape != self.ct.shape:
            raise InputError(
                f"The structures have {self.structures.labels.shape} voxels but the CT has {self.ct.shape}: "
                "resample the labels onto the CT's grid."
            )
        object.__setattr__(self, "source_segmentation", checked_source(self.source_segmentation, self.ct))
        if not (np.isfinite(self.frames_per_second) and self.frames_per_second > 0):
            raise InputError('"frames_per_second" must be a number above 0.')
        for name in (self.reference, *self.still):
            self.structures.index(name)
        if set(self.structures.names) <= set(self.still):
            raise InputError(
                '"still" names every structure, so that nothing is left to track: leave one out.'
            )
        self._check_joints()
        poses = {}
        for name, pose in self.initial_poses.items():
            self.structures.index(name)
            poses[name] = require_rigid(pose, f'"initial_poses"."{name}"')
        object.__setattr__(self, "initial_poses", poses)
        if self.frame_count < 1:
            short = min(self.views, key=lambda view: view.images.count - view.first)
            raise InputError(
                f'The camera "{short.name}" has {short.images.count} images, none of them in the range of frames: '
                "check its offset, and the first and the last frame."
            )

    def _check_joints(self) -> None:
        """Raise InputError where a joint's bone is no structure, or two joints have one name."""
        for number, joint in enumerate(self.joints):
            self.structures.index(joint.proximal)
            self.structures.index(joint.distal)
            if joint.name in [other.name for other in self.joints[:number]]:
                raise InputError(f'Two joints have the name "{joint.name}": give each its own.')

    @property
    def available(self) -> int:
        """Frames that every camera has, counted from the sequence's first."""
        return min(view.images.count - view.first for view in self.views)

    @property
    def frames(self) -> range:
        """Numbers of the frames that are tracked, those of the sequence, from 0."""
        last = self.available - 1 if self.options.last is None else min(self.options.last, self.available - 1)
        return range(self.options.first, last + 1)

    @property
    def frame_count(self) -> int:
        """How many frames are tracked."""
        return len(self.frames)

    @cached_property
    def inputs(self) -> TrackInputs:
        """Digests by which the sequence is known again, made when they are first asked for; raises InputError."""
        return inputs_of(self)

    def seconds(self, frame: int) -> float:
        """Time of a frame since the sequence's first."""
        return frame / self.frames_per_second
