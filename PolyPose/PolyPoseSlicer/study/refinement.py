"""What a registration starts from when it refines a result whose bones a person has moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..scene.cameras import camera_of
from ..scene.motions import Motion
from .camera_source import CameraSource
from .results import OutputNodes
from .xray_source import XraySource

_OTHER_CAMERAS = ("extrinsic", "landmarks", "standard_view")
"""Fields of an X-ray that would give another initial camera than the one that was found."""


def adjusted_poses(
    motions: Mapping[str, Motion], adjustments: Mapping[str, np.ndarray], anchor: str
) -> dict[str, np.ndarray]:
    """Initial poses of all bones but the anchor, (4, 4) from the X-rays' posture to the CT, LPS mm.

    motions: of a result. adjustments: how bones were moved by hand in the X-rays' posture, (4, 4) LPS mm.
    """
    return {
        name: np.linalg.inv(adjustments.get(name, np.eye(4)) @ motion.matrix)
        for name, motion in motions.items()
        if name != anchor
    }


def with_found_cameras(sources: Sequence[XraySource], outputs: OutputNodes) -> list[XraySource]:
    """The X-rays, each with the camera that a result found for it as its initial one.

    Those whose camera is known keep it; where the result was made from other X-rays, all keep what they have.
    """
    if tuple(source.identity for source in sources) != outputs.sources:
        return list(sources)
    return [
        source
        if source.fields.get("camera") == "known" or camera_of(node) is None
        else _started(source, node)
        for source, node in zip(sources, outputs.cameras, strict=True)
    ]


def _started(source: XraySource, camera: Any) -> XraySource:
    """An X-ray whose initial camera is a transform node."""
    fields = {key: value for key, value in source.fields.items() if key not in _OTHER_CAMERAS}
    return replace(
        source,
        fields={**fields, "camera": "initial"},
        camera_transform=camera,
        camera_source=CameraSource.CARM,
        found=None,
    )
