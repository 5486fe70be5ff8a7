"""Whether a CT's values are Hounsfield units, told by where air, soft tissue and bone lie and not by extremes.

Registrations with values that are off by an intercept end several millimetres away, so they are refused.  What the
method survives, such as a CT clipped to a window, is a warning.  A CT need not hold everything: one cropped to a bone
has no air, and one of bones alone has no soft tissue.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.volume import AIR_HU, Volume

FEWEST_VOXELS = 3
"""Along each axis of a CT; smaller ones have no bone with an inside."""

HIGHEST_HU = 32767.0
"""Metal on the extended scale reaches about 30,000 HU; unsigned padding, 64,511."""

_SAMPLES = 2_000_000
"""Voxels that are looked at, at most (about)."""

_INTERCEPT = 1024.0
"""What nearly all scanners subtract; some programs 1000, which the ranges below admit."""

_SOFT = (-150.0, 150.0)
"""Fat to muscle: 86 to 92 % of the body (above -800 HU) in CTs of a chest and a pelvis, 5 to 8 % if shifted by it."""

_LEAST_SPREAD = 60.0
"""HU between the tenth and the ninetieth hundredth of soft tissue in its range."""

_ABOVE_AIR = -800.0
_BONE = 200.0
_DENSE_BONE = 700.0
_FEW_PADDINGS = 3
_CLIPPED_SHARE = 0.1
"""Of the voxels above 150 HU, those at the highest value: 0.3 % in whole CTs, 40 % when clipped to 400 HU."""


def impossible_size(ct: Volume) -> str | None:
    """Why a CT is too small for any registration, as the rest of a sentence with the fix; None when it is not."""
    if min(ct.shape) >= FEWEST_VOXELS:
        return None
    size = "x".join(map(str, ct.shape[::-1]))
    if min(ct.shape) == 1:
        return f"the CT has {size} voxels, which is one slice: give the whole stack."
    return f"the CT has {size} voxels, and a registration needs {FEWEST_VOXELS} along each axis: give the whole CT."


def impossible_highest_value(ct: Volume) -> str | None:
    """Why the highest value is no material's, as the rest of a sentence with the fix; None when it may be."""
    high = float(ct.voxels.max())
    if high <= HIGHEST_HU:
        return None
    return (
        f"its highest value is {high:.6g}, and no material exceeds {HIGHEST_HU:g} HU: padding or damaged voxels; "
        f"replace them by {AIR_HU:g} (air), or export the original CT."
    )


def impossible_hounsfield_values(ct: Volume) -> str | None:
    """Why the values of a CT cannot be Hounsfield units, as the rest of a sentence with the fix; None if they can be.

    Parameters
    ----------
    ct
        Finite voxels as they were read, padding included.

    """
    low, high = float(ct.voxels.min()), float(ct.voxels.max())
    if low == high:
        return f"every voxel is {low:g}: give the CT, not an empty image or a mask."
    if (fault := impossible_highest_value(ct)) is not None:
        return fault
    if high - low <= 2:
        return f"{_not_hounsfield(low, high)}: it was normalised; give the original CT."
    values = _Values.of(ct)
    if low >= 0 and high <= 255:
        return f"{_not_hounsfield(low, high)}: it was rescaled for display; export the original CT."
    if values.is_raw() or (low >= 0 and not values.may_be_cropped_to_bone()):
        return (
            f"{_not_hounsfield(low, high)}: its rescale intercept was not applied; add it (usually -1024) and save "
            "again."
        )
    if values.is_shifted_down():
        return (
            f"{_not_hounsfield(low, high)}: soft tissue lies near -1024 instead of 0, so the rescale intercept was "
            "likely applied twice; add 1024 and save again, or export the original CT."
        )
    return None


def odd_hounsfield_values(ct: Volume, name: str) -> tuple[str, ...]:
    """Warnings about a CT whose values are possible but unusual.

    Parameters
    ----------
    ct
        Hounsfield units.
    name
        Whose values they are, for the sentences.

    """
    values = _Values.of(ct)
    low, high = float(ct.voxels.min()), float(ct.voxels.max())
    if values.is_masked_with_water():
        return (
            f"{name}: everything around the bones is exactly 0 HU, which is water; if it was masked, save it again "
            f"with {AIR_HU:g} (air) there.",
        )
    if high < _BONE:
        return (f"{name}: no voxel is bone (highest value {high:g} HU); the CT may be clipped.",)
    if values.is_clipped(high):
        return (
            f"{name} was clipped to a window ({low:g} to {high:g} HU), so dense bone looks like soft bone and motions "
            "are less accurate; give the CT as the scanner stored it.",
        )
    tissue = values.tissue_mode()
    if tissue is None and not values.has_tissue_in_place():
        return (
            f"{name}: neither soft tissue (near 0 HU) nor bone (above {_BONE:g} HU) is where it should be; check that "
            "the values are Hounsfield units.",
        )
    if tissue is not None:
        return (
            f"{name}: most tissue lies at about {tissue:.0f} HU, where 0 is expected; the values are not well "
            "calibrated (cone-beam CT, for example), and motions may be less accurate.",
        )
    return ()


def bone_is_clipped(ct: Volume) -> bool:
    """Whether dense bone of a CT looks like soft bone, because its values were clipped to a window."""
    return _Values.of(ct).is_clipped(float(ct.voxels.max()))


def _not_hounsfield(low: float, high: float) -> str:
    """The middle of the sentences."""
    return f"its values run from {low:g} to {high:g} and so are not Hounsfield units (air is {AIR_HU:g})"


@dataclass(frozen=True)
class _Values:
    """Every n-th voxel of a CT, sorted."""

    sample: np.ndarray

    @classmethod
    def of(cls, ct: Volume) -> _Values:
        """Take voxels evenly along every axis."""
        step = max(1, int(np.ceil((ct.voxels.size / _SAMPLES) ** (1 / 3))))
        return cls(np.sort(ct.voxels[::step, ::step, ::step].ravel().astype(np.float32)))

    def count(self, low: float, high: float = np.inf) -> int:
        """Voxels from low to high."""
        start, end = np.searchsorted(self.sample, [low, high])
        return int(end - start)

    def is_raw(self) -> bool:
        """Whether air lies near 0 and soft tissue near 1024, whatever the padding.

        Of real negative values there are none then.  Above air, soft tissue outnumbers both what lies between (beyond
        lung) and bone: 3 to 37 times in CTs of a chest and a pelvis.  It spreads from fat to muscle, over 130 to 180 HU
        there, as bones that a program painted with one value do not; and bones under water are spread much farther.
        """
        if self._varied_below(-50) > 0.005 * len(self.sample):
            return False
        low, high = np.add(_SOFT, _INTERCEPT - 12)  # between the intercepts -1000 and -1024
        soft, between, bone = self.count(low, high), self.count(400, 800), self.count(1250, 2050)
        if soft <= 1.5 * between or soft <= 1.5 * bone:
            return False
        return self._spread(low, high) > _LEAST_SPREAD

    def _varied_below(self, value: float) -> int:
        """Voxels below a value that are not one of few constants, as padding is."""
        counts = np.sort(np.unique(self.sample[: np.searchsorted(self.sample, value)], return_counts=True)[1])
        return int(counts[:-_FEW_PADDINGS].sum())

    def may_be_cropped_to_bone(self) -> bool:
        """Whether values that are all positive may be the inside of a bone: most of them below dense bone's."""
        sample = self.sample
        at_lowest = np.searchsorted(sample, sample[0], "right") / len(sample)
        spread = at_lowest < 0.2 or sample[0] == 0  # water, or what was masked
        return bool(spread and sample[-1] >= 300 and self.count(-np.inf, 800) > 0.8 * len(sample))

    def is_masked_with_water(self) -> bool:
        """Whether a third of the voxels is exactly 0 and there is hardly any air: scans have noise and air."""
        exact, total = self.count(0, np.nextafter(np.float32(0), np.float32(1))), len(self.sample)
        return exact > total / 3 and self.count(-np.inf, -900) < 0.05 * total

    def is_shifted_down(self) -> bool:
        """Whether air lies near -2024 and soft tissue near -1024.

        Then far more lies there than above -800 HU: 9 and 35 times in CTs of a chest and a pelvis.  What is above is
        bone, whose share falls with its density, where sound CTs have soft tissue near 0.  And either the values near
        -1024 spread from fat to muscle, and those below -1200 are no padding, or there is hardly any bone.
        """
        low, high = np.subtract(_SOFT, _INTERCEPT)
        body, lung = self.count(_ABOVE_AIR), self.count(_ABOVE_AIR, -450)
        if self.count(low, high) <= 1.2 * body or lung < self.count(-450, _SOFT[0]):
            return False
        few, bone = 0.005 * len(self.sample), self.count(_BONE)
        if self._varied_below(-1200) >= few and self._spread(low, high) > _LEAST_SPREAD:
            return bone < 0.35 * body and self.count(*_SOFT) < self.count(_ABOVE_AIR, _SOFT[0])
        return self.count(-np.inf, -1060) >= few and bone < 0.02 * body

    def _spread(self, low: float, high: float) -> float:
        """HU between the tenth and the ninetieth hundredth of the values in a range, which holds some."""
        inside = self.sample[np.searchsorted(self.sample, low) : np.searchsorted(self.sample, high)]
        return float(np.subtract(*np.percentile(inside, [90, 10])))

    def has_tissue_in_place(self) -> bool:
        """Whether there is what any sound CT has above -800 HU: a share of bone, or some in much soft tissue."""
        body, bone, soft = self.count(_ABOVE_AIR), self.count(_BONE), self.count(*_SOFT)
        return body > 0 and (bone >= 0.15 * body or (soft >= 0.4 * body and bone >= 0.005 * body))

    def is_clipped(self, high: float) -> bool:
        """Whether many of the values above 150 HU are the highest one, and that is not dense bone's."""
        return high <= _DENSE_BONE and self.count(high - 0.5) / max(self.count(150), 1) > _CLIPPED_SHARE

    def tissue_mode(self) -> float | None:
        """Where the commonest tissue lies in HU, when that is far from 0; None for bones alone, lungs and sound CTs."""
        counts, edges = np.histogram(self.sample, bins=np.arange(-700, 3000, 20))
        smooth = np.convolve(counts, np.ones(5) / 5, "same")
        mode = float(edges[np.argmax(smooth)] + 10)
        narrow = self.count(mode - 100, mode + 100)
        near_zero = self.count(*_SOFT)
        if -600 < mode < -200 and narrow > 2 * near_zero and narrow > 0.3 * counts.sum():
            return mode
        if mode > 250 and self.count(mode - 150, mode + 150) > 0.7 * counts.sum():
            return mode
        return None
