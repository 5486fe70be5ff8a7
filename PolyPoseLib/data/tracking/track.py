"""What tracking found: a pose of every structure in every frame, with what is known of its error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.data.tracking.track_inputs import TrackInputs
from PolyPoseLib.geometry.camera import Camera

SOURCES = ("forward", "backward", "restart", "given", "corrected", "none")
"""Where a frame's pose comes from; "corrected" by hand, "none" where the structure was lost."""


@dataclass(frozen=True, eq=False)
class TrackedFrame:
    """One frame of K structures, the unit that is kept when a run is interrupted.

    Parameters
    ----------
    frame : int
        Its number in the sequence, from 0.
    poses : (K, 4, 4) ndarray
        The rig's world (fixed) to the CT's LPS mm (moving).
    covariances : (K, 6, 6) ndarray
        Of [rotation (rad), translation (mm)], a perturbation on the left of the pose about the structure's centroid in
        the CT, as in :class:`PolyPoseLib.registration.uncertainty.covariance.PoseUncertainty`.
    residuals : (K,) ndarray
        Disagreement of each structure with the X-rays where it projects, 0 (none) to 1.
    doubts : tuple of tuple of str
        For every structure why not to rely on its pose; empty where nothing speaks against it.
    sources : tuple of str
        For every structure one of SOURCES.
    cpu_seconds : float
        That this frame took, all passes.

    """

    frame: int
    poses: np.ndarray
    covariances: np.ndarray
    residuals: np.ndarray
    doubts: tuple[tuple[str, ...], ...]
    sources: tuple[str, ...]
    cpu_seconds: float = 0.0


@dataclass(frozen=True)
class Corrected:
    """A correction that is in a track.

    Parameters
    ----------
    frame : int
        Number of the frame that was corrected by hand.
    structures : tuple of str
        Which were.
    first, last : int
        Numbers of the frames that were tracked anew from there.

    """

    frame: int
    structures: tuple[str, ...]
    first: int
    last: int


@dataclass(frozen=True, eq=False)
class Track:
    """The whole sequence.

    Parameters
    ----------
    names : tuple of str
        Of the K structures, in the order of all arrays.
    reference : str
        The structure relative to which others are reported.
    centroids : (K, 3) ndarray
        Of the structures in the CT, LPS mm.
    frames : tuple of TrackedFrame
        In the order of time.
    frames_per_second : float
        Of the sequence.
    cameras : mapping of str to Camera
        By the name of the view, in the rig's world.
    smoothed : bool
        Whether the poses were smoothed.
    warnings : tuple of str
        What was odd but not wrong.
    distrust : tuple of str
        Reasons why the whole track must not be trusted.
    device : str
        What it was computed on.
    versions : mapping of str to str
        And with.
    inputs : TrackInputs, optional
        By which the sequence is known again; None where nobody kept them.
    corrections : tuple of Corrected
        By hand, in their order.

    """

    names: tuple[str, ...]
    reference: str
    centroids: np.ndarray
    frames: tuple[TrackedFrame, ...]
    frames_per_second: float
    cameras: Mapping[str, Camera]
    smoothed: bool = False
    warnings: tuple[str, ...] = ()
    distrust: tuple[str, ...] = ()
    device: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    inputs: TrackInputs | None = None
    corrections: tuple[Corrected, ...] = ()

    @property
    def distrust_clauses(self) -> str:
        """As of a ``Result``."""
        return "; ".join(reason.rstrip(".") for reason in self.distrust)

    @property
    def poses(self) -> np.ndarray:
        """(F, K, 4, 4) the rig's world to the CT's LPS mm."""
        return np.stack([each.poses for each in self.frames])

    @property
    def covariances(self) -> np.ndarray:
        """(F, K, 6, 6), see :class:`TrackedFrame`."""
        return np.stack([each.covariances for each in self.frames])

    @property
    def numbers(self) -> np.ndarray:
        """(F,) numbers of the frames in the sequence."""
        return np.array([each.frame for each in self.frames])

    @property
    def doubtful(self) -> np.ndarray:
        """(F, K) bool: flagged as uncertain."""
        return np.array([[bool(lines) for lines in each.doubts] for each in self.frames])
