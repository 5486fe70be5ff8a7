"""Maps of the transform that are laid over slices: how far, how much volume, whose motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock

import numpy as np

from PolyPoseLib.data.displacement_field import DisplacementField, trilinear
from PolyPoseLib.errors import InputError
from PolyPoseLib.viewer.content import Content
from PolyPoseLib.viewer.pictures import FOLD_COLOUR, Scale, rgb

WEIGHT_NODE_MM = 4.0
"""Distance maps for weights are computed on a grid of this spacing: they are drawn, not computed with."""


@dataclass(frozen=True)
class Map:
    """One number at every node of the transform's grid, in the frame of the patient as X-rayed.

    Attributes
    ----------
    title
        With its unit.
    values
        (k, j, i) float32.
    affine
        (4, 4) index (i, j, k) to LPS mm.
    scale
        Its colours.
    ticks
        Texts at the left end, the middle and the right end of the colour bar.
    folds
        Whether numbers of 0 and less mean folding and get a colour of their own.

    """

    title: str
    values: np.ndarray
    affine: np.ndarray
    scale: Scale
    ticks: tuple[str, str, str]
    folds: bool = False

    def at(self, points: np.ndarray) -> np.ndarray:
        """Values at points (..., 3), LPS mm; NaN beyond the grid."""
        inverse = np.linalg.inv(self.affine)
        index = points.reshape(-1, 3) @ inverse[:3, :3].T + inverse[:3, 3]
        values = trilinear(self.values[..., None], index)[:, 0]
        last = np.array(self.values.shape[::-1]) - 1
        values[((index < -0.5) | (index > last + 0.5)).any(axis=1)] = np.nan
        return values.reshape(points.shape[:-1])

    def picture(self, points: np.ndarray) -> np.ndarray:
        """RGBA uint8 at points (H, W, 3); transparent beyond the grid."""
        values = self.at(points)
        known = np.isfinite(values)
        pixels = np.zeros((*values.shape, 4), np.uint8)
        shown = np.where(known, values, self.scale.low)
        pixels[..., :3] = self.scale.colours(shown)
        pixels[..., 3] = np.where(known, self.scale.opacities(shown), 0)
        if self.folds:
            pixels[known & (values <= 0)] = (*rgb(FOLD_COLOUR), 255)
        return pixels


def displacement(field: DisplacementField) -> Map:
    """How far each point of the patient as X-rayed lies from where the CT has it."""
    length = np.linalg.norm(field.vectors, axis=-1)
    high = max(float(np.percentile(length, 99.5)), 0.1)
    ticks = ("0", f"{high / 2:.1f}", f"{high:.1f} mm")
    return Map("displacement from the CT, mm", length, field.affine, Scale(0.0, high), ticks)


def volume_change(field: DisplacementField) -> Map:
    """The Jacobian determinant of the transform from the X-rays to the CT."""
    from PolyPoseLib.warp.dense import jacobian_determinant

    scale = Scale(0.5, 2.0, diverging=True, logarithmic=True)
    ticks = ("0.5 or less: grew", "1", "2 or more: shrank")
    title = "Jacobian determinant, X-rays to CT (1: volume kept; magenta: folded)"
    return Map(title, jacobian_determinant(field), field.affine, scale, ticks, folds=True)


def weight(content: Content, number: int) -> Map:
    """The weight of one structure's motion; raises InputError where it is not known where structures are."""
    from PolyPoseLib.data.structures import Structures
    from PolyPoseLib.warp.polyrigid import PolyrigidWarp
    from PolyPoseLib.warp.weights import distance_maps

    if content.labels is None:
        raise InputError("Weights need the structures' labels, which this result does not hold.")
    import torch

    result, field = content.result, content.result.transform
    structures = Structures(tuple(result.structures), content.labels.voxels)
    distances = distance_maps(structures, content.labels.affine, WEIGHT_NODE_MM)
    poses = np.stack([each.fixed_to_moving for each in result.structures.values()])
    chosen = content.weighting
    warp = PolyrigidWarp(
        distances, structures.volume_share(), poses, chosen.frame, form=chosen.form, epsilon=chosen.epsilon
    )
    values = np.empty(int(np.prod(field.shape)), np.float32)
    from PolyPoseLib.warp.field_grids import flat_points

    with torch.no_grad():
        for start in range(0, len(values), 1 << 17):
            stop = min(start + (1 << 17), len(values))
            points = torch.from_numpy(
                np.ascontiguousarray(flat_points(field.affine, field.shape, start, stop))
            )
            values[start:stop] = warp.weights(points.double())[number].cpu().numpy()
    name = result_name(content, number)
    title = f"weight of the motion of {name} (1: moves with it alone)"
    return Map(title, values.reshape(field.shape), field.affine, Scale(0.0, 1.0), ("0", "0.5", "1"))


def result_name(content: Content, number: int) -> str:
    """Name of the nth structure."""
    return list(content.result.structures)[number]


class Maps:
    """The maps of one result by key, computed when they are first asked for.

    Keys are "displacement", "jacobian", and "weight-N" for the structures that are known.
    """

    def __init__(self, content: Content) -> None:
        field = content.result.transform
        self._makers: dict[str, Callable[[], Map]] = {
            "displacement": lambda: displacement(field),
            "jacobian": lambda: volume_change(field),
        }
        self.choices = [
            ("", "nothing"),
            ("displacement", "displacement"),
            ("jacobian", "Jacobian determinant"),
        ]
        if content.labels is not None:
            for number, name in enumerate(content.result.structures):
                self._makers[f"weight-{number}"] = lambda number=number: weight(content, number)
                self.choices.append((f"weight-{number}", f"weight of {name}"))
        self._made: dict[str, Map] = {}
        self._lock = Lock()  # three pictures ask at once

    def __contains__(self, key: str) -> bool:
        return key in self._makers

    def __getitem__(self, key: str) -> Map:
        with self._lock:
            if key not in self._made:
                self._made[key] = self._makers[key]()
            return self._made[key]
