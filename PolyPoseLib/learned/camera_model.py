"""A trained regressor of cameras, tied to the CT that it was trained on."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass

import numpy as np
from torch import Tensor

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.network import Architecture, CameraNetwork
from PolyPoseLib.learned.view_range import ViewRange

USABLE_MM = 15.0
"""Median validation error up to which a model is usable.

The refinement that follows found the true camera from all starts that were 25 mm off or nearer, from 5 in 6 that were
30 mm off, and from 2 in 6 that were 40 mm off (``Testing/Benchmarks/camera_capture.py``, pelvis). The worst view of a
good model is about three times as far off as its median view (12.7 and 3.6 mm): beyond 15 mm many views start where the
refinement fails.
"""


@dataclass(frozen=True)
class CameraModel:
    """A regressor and what it is for.

    Attributes
    ----------
    fingerprint : str
        Of the CT and the anchor (:func:`ct_fingerprint`).
    views, detector : ViewRange
        What it was trained for.
    architecture, state : Architecture
        The network.
    validation_mm : float
        Median projection error on renderings that it was not trained on.

    """

    fingerprint: str
    views: ViewRange
    detector: VirtualDetector
    architecture: Architecture
    state: dict[str, Tensor]
    validation_mm: float

    @property
    def weakness(self) -> str | None:
        """Why the model's cameras are mostly too far off to be refined, in one clause; None when they are not."""
        if self.validation_mm <= USABLE_MM:
            return None
        return (
            f"its median error on renderings that it was not trained on is {self.validation_mm:.0f} mm, "
            f"where at most {USABLE_MM:.0f} mm is usable"
        )

    def network(self) -> CameraNetwork:
        """The network, ready to predict; raises InputError when the state does not fit or MONAI is missing."""
        network = CameraNetwork(self.architecture)
        try:
            network.load_state_dict(self.state)
        except RuntimeError as error:
            raise InputError(
                "The camera model's network does not fit its description: train it anew."
            ) from error
        return network.eval()

    def require(self, ct: Volume, structures: Structures, anchor: str) -> None:
        """Raise InputError when it was trained on another CT or anchor."""
        if ct_fingerprint(ct, structures, anchor) != self.fingerprint:
            raise InputError(
                "The camera model was trained on another CT, or on other labels of the anchor: train one for this "
                "study with python -m PolyPoseLib train."
            )


def ct_fingerprint(ct: Volume, structures: Structures, anchor: str) -> str:
    """SHA256 over the CT's voxels and affine (to 1e-4 mm) and the anchor's mask."""
    digest = hashlib.sha256()
    digest.update(json.dumps([list(ct.shape), np.round(ct.affine, 4).tolist()]).encode())
    for voxels, mask in zip(ct.voxels, structures.mask(anchor), strict=True):
        digest.update(np.ascontiguousarray(voxels, dtype="<f4").data)
        digest.update(np.packbits(mask).data)
    return digest.hexdigest()
