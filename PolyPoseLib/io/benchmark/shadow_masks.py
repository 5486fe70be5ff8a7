"""Masks of a held-out view, rendered when the first of them is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.simulation.label_shadows import label_shadows


class ShadowMasks(Mapping[str, np.ndarray]):
    """{structure: (H, W) bool}, True where a ray of the camera meets the structure.

    A case has dozens of held-out views, of which the process that fits needs none.

    Parameters
    ----------
    labels : Volume
        Whole numbers.
    camera : Camera
        In the labels' world.
    groups : {str: sequence of int}
        Labels of each structure.

    """

    def __init__(self, labels: Volume, camera: Camera, groups: Mapping[str, Sequence[int]]) -> None:
        self._labels, self._camera, self._groups = labels, camera, dict(groups)

    @cached_property
    def _masks(self) -> dict[str, np.ndarray]:
        return label_shadows(self._labels, self._camera, self._groups)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._groups:
            raise KeyError(name)
        return self._masks[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._groups)

    def __len__(self) -> int:
        return len(self._groups)
