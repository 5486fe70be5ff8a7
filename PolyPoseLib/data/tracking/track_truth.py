"""The truth of a simulated sequence: what a track is scored against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from PolyPoseLib.geometry.camera import Camera


@dataclass(frozen=True, eq=False)
class TrackTruth:
    """Where every bone really was.

    Parameters
    ----------
    names : tuple of str
        Of the K structures.
    reference : str
        The structure that the others move against.
    frames_per_second : float
        Of the sequence.
    poses : (F, K, 4, 4) ndarray
        The rig's world (fixed) to the CT's LPS mm (moving), from the sequence's frame 0 on.
    centroids : (K, 3) ndarray
        Of the structures in the CT, LPS mm.
    points : mapping of str to (N, 3) ndarray
        Of every structure's surface in the CT, LPS mm.
    cameras : mapping of str to Camera
        By the name of the view, in the rig's world.
    unseen : mapping of str to tuple of int
        {view: frames that it does not show}, as they are blank or an earlier one again.
    seed : int
        Of the simulation.
    description : str
        What moved how.

    """

    names: tuple[str, ...]
    reference: str
    frames_per_second: float
    poses: np.ndarray
    centroids: np.ndarray
    points: Mapping[str, np.ndarray]
    cameras: Mapping[str, Camera]
    unseen: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    seed: int = 0
    description: str = ""
