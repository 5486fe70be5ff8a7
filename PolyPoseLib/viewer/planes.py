"""Axial, coronal and sagittal slices of a volume, as radiologists look at them.

Axial slices are seen from the feet, coronal ones from the front: the patient's right is on the left of the picture.
Sagittal ones are seen from the patient's left: the front is on the left of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from PolyPoseLib.data.volume import Volume

Plane = Literal["axial", "coronal", "sagittal"]
PLANES: tuple[Plane, ...] = ("axial", "coronal", "sagittal")

STRAIGHT_COSINE = 0.9999
"""Axes of a volume within 0.8 degrees of the patient's are shown as they are; others are resampled first."""

MOST_VOXELS = 200_000_000
"""Of a volume that had to be resampled."""


@dataclass(frozen=True)
class _Layout:
    """axis: of (x, y, z), along which slices lie; across, down: axes of the picture; upward: whether the picture's rows
    run against the second; sides: letters at its left, right, top and bottom.
    """

    axis: int
    across: int
    down: int
    upward: bool
    sides: tuple[str, str, str, str]


_LAYOUTS: dict[Plane, _Layout] = {
    "axial": _Layout(2, 0, 1, False, ("R", "L", "A", "P")),
    "coronal": _Layout(1, 0, 2, True, ("R", "L", "S", "I")),
    "sagittal": _Layout(0, 1, 2, True, ("A", "P", "S", "I")),
}

_TOWARD = (("right", "left"), ("front", "back"), ("feet", "head"))
"""Where the coordinates x, y, z fall and grow."""


@dataclass(frozen=True)
class Frame:
    """How one picture of a slice lies in the patient.

    Attributes
    ----------
    plane
        Which of the three.
    position
        Of the slice along the plane's axis, LPS mm.
    left, top, width, height
        Of the picture in mm: columns run along LPS x or y; rows along LPS y, or against LPS z.

    """

    plane: Plane
    position: float
    left: float
    top: float
    width: float
    height: float

    @property
    def axis(self) -> int:
        """Of (x, y, z), across which the slice lies."""
        return _LAYOUTS[self.plane].axis

    def on_picture(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3), LPS mm, as (..., 2) mm across and down the picture."""
        layout = _LAYOUTS[self.plane]
        sign = -1.0 if layout.upward else 1.0
        return np.stack([points[..., layout.across], sign * points[..., layout.down]], axis=-1)


def sides(plane: Plane) -> tuple[str, str, str, str]:
    """Letters of the directions at the left, right, top and bottom of a picture."""
    return _LAYOUTS[plane].sides


def position_text(plane: Plane, position: float) -> str:
    """Where a slice lies, for people, such as "z = -120.0 mm"."""
    return f"{'xyz'[_LAYOUTS[plane].axis]} = {position:+.1f} mm"


def ends_text(plane: Plane) -> tuple[str, str]:
    """Where the slider of a plane leads, to its left and its right."""
    return _TOWARD[_LAYOUTS[plane].axis]


@dataclass(frozen=True)
class SliceStack:
    """A volume whose axes are the patient's, ready to be cut into slices.

    Attributes
    ----------
    voxels
        (z, y, x); x grows to the patient's left, y to the back, z to the head.
    origin, spacing
        (3,) LPS mm of the first voxel's centre and between centres, along x, y, z.

    """

    voxels: np.ndarray
    origin: np.ndarray
    spacing: np.ndarray

    @classmethod
    def from_volume(cls, volume: Volume, outside: float) -> SliceStack:
        """The same voxels in the patient's order; those of an oblique volume are resampled, `outside` beyond them."""
        axes = volume.affine[:3, :3] / volume.spacing
        order = np.abs(axes).argmax(axis=1)
        if len(set(order)) < 3 or np.abs(axes).max(axis=1).min() < STRAIGHT_COSINE:
            return cls._resampled(volume, outside)
        # order[a] is the index axis (i, j, k) along patient axis a.
        voxels = volume.voxels.transpose([2 - order[2], 2 - order[1], 2 - order[0]])
        turned = [axes[a, order[a]] < 0 for a in range(3)]
        voxels = voxels[tuple(slice(None, None, -1 if turned[a] else 1) for a in (2, 1, 0))]
        first = np.zeros(3)
        for a in range(3):
            if turned[a]:
                first[order[a]] = volume.shape[2 - order[a]] - 1
        return cls(voxels, volume.to_world(first), volume.spacing[order])

    @classmethod
    def _resampled(cls, volume: Volume, outside: float) -> SliceStack:
        import SimpleITK as sitk

        corners = volume.corners()
        low, high = corners.min(axis=0), corners.max(axis=0)
        spacing = max(float(volume.spacing.min()), float(np.prod(high - low) / MOST_VOXELS) ** (1 / 3))
        size = np.ceil((high - low) / spacing - 1e-6).astype(int) + 1
        image = sitk.Resample(
            volume.with_voxels(volume.voxels.astype(np.float32)).to_sitk(), [int(n) for n in size],
            sitk.Transform(3, sitk.sitkIdentity), sitk.sitkLinear, low.tolist(), [spacing] * 3,
            np.eye(3).ravel().tolist(), float(outside),
        )  # fmt: skip
        return cls(sitk.GetArrayFromImage(image), low, np.full(3, spacing))

    def count(self, plane: Plane) -> int:
        """Slices of a plane."""
        return self.voxels.shape[2 - _LAYOUTS[plane].axis]

    def frame(self, plane: Plane, index: int) -> Frame:
        """Where a slice lies; an index beyond the ends gives the slice there."""
        layout = _LAYOUTS[plane]
        index = min(max(index, 0), self.count(plane) - 1)
        size = np.array(self.voxels.shape[::-1])
        low = self.origin - self.spacing / 2
        extent = size * self.spacing
        top = -(low[layout.down] + extent[layout.down]) if layout.upward else low[layout.down]
        return Frame(
            plane,
            float(self.origin[layout.axis] + index * self.spacing[layout.axis]),
            float(low[layout.across]),
            float(top),
            float(extent[layout.across]),
            float(extent[layout.down]),
        )

    def picture(self, frame: Frame) -> np.ndarray:
        """The slice nearest to a frame's position, (H, W), as it is looked at."""
        layout = _LAYOUTS[frame.plane]
        place = (frame.position - self.origin[layout.axis]) / self.spacing[layout.axis]
        index = int(np.clip(np.rint(place), 0, self.count(frame.plane) - 1))
        picture = np.take(self.voxels, index, axis=2 - layout.axis)
        return picture[::-1] if layout.upward else picture

    def points(self, frame: Frame) -> np.ndarray:
        """LPS mm (H, W, 3) of a picture's pixels."""
        layout = _LAYOUTS[frame.plane]
        along = [self.origin[a] + np.arange(self.voxels.shape[2 - a]) * self.spacing[a] for a in range(3)]
        down = along[layout.down][::-1] if layout.upward else along[layout.down]
        points = np.empty((len(down), len(along[layout.across]), 3))
        points[..., layout.axis] = frame.position
        points[..., layout.across] = along[layout.across]
        points[..., layout.down] = down[:, None]
        return points
