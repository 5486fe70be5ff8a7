"""Whether labels lie on the CT's bones; refused where most lie beside, with the place where they would fit.

The limits were measured on labels of a pelvis and a chest, as structures, as single bones, and as random sets of some
of these.  Sound: bone of half or a quarter of its density, a soft-tissue window, noise, contrast, metal, everything
else air, labels of 6 mm, and labels one or two voxels (of 3 mm) too small or too large.  Wrong: mirrored along any
axis, turned by half a turn, or shifted by 12 to 36 mm along any axis, all of them or one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.label_fit import CoarseScene, LabelFit
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError

GROWN_CELLS = 3
"""By how much labels are thickened for a second opinion: ones that are far too small then fit where they are."""

SHARES_OF_BEST = {1: (0.2, 0.4), 2: (0.3, 0.6)}
MANY_SHARES = (0.8, 0.95)
"""By number of structures: the share of the best fit that their own place must reach, as they are or else thickened.

Of three or more structures, sound ones reach 0.97 (as they are or thickened), except labels that are 6 mm too small;
wrong ones at most 0.71 and 0.97.  One or two bones may by chance fit better elsewhere: down to 0.27 and 0.35 were seen.
"""

CERTAIN = 12.0
"""How far the best place must stand out from chance, in standard deviations: noise reaches 6, bones 40 to 580."""

TOO_SMALL, CLEARLY_LARGER, FROM_CHANCE = 0.75, 0.4, 75.0
"""Labels may be too small to tell when the best fit does not fall below the first share as they are thickened.

Below the second share they are not; between both, the best fit must stand out from chance by so many standard
deviations.  Labels that are 6 mm too small keep 0.55 to 1.2 and stand out by 17 to 66; others keep 0.2 to 0.6, and
wrong ones of three or more structures stand out by 87 to 580.
"""

BESIDE_SHARE = 0.7
"""A structure lies beside its bone when its fit is below this share of that at the best place of all."""

SINGLE_SHARE, FEWEST_FOR_SINGLE = 0.15, 3
"""A structure holds no bone when its fit, as it is and thickened, is below this share of the mean of all; and how many
structures a mean needs.  Sound ones reach 0.18 (a cut rib of twice its thickness), else 0.34; soft
organs -0.4 to 0.4."""

_ALONG = ("left-right", "front-back", "head-foot")


@dataclass(frozen=True)
class LabelVerdict:
    """misplaced: where the labels would fit, for a sentence, when most lie beside bone.

    warnings: about single structures, or all where too few can be judged to refuse them.
    """

    misplaced: str | None
    warnings: tuple[str, ...] = ()


def judge_labels(ct: Volume, structures: Structures) -> LabelVerdict:
    """Compare labels with the CT's bone where they are, mirrored and shifted.

    Parameters
    ----------
    ct
        Hounsfield units.
    structures
        On its grid.

    """
    scene = CoarseScene(ct, structures.labels, len(structures))
    fit = scene.fit()
    if fit is None or fit.best < CERTAIN * fit.noise:
        return LabelVerdict(None)
    count = int(np.count_nonzero(np.isfinite(fit.structures_own)))
    plain_share, grown_share = SHARES_OF_BEST.get(count, MANY_SHARES)
    weak = fit.structures_own < SINGLE_SHARE * fit.own
    if fit.own >= plain_share * fit.best and not weak.any():
        return LabelVerdict(None)
    grown = scene.fit(GROWN_CELLS)
    if grown is None:
        return LabelVerdict(None)
    beside = int(np.count_nonzero(fit.structures_own < BESIDE_SHARE * fit.structures_best))
    if (
        fit.own < plain_share * fit.best
        and grown.own < grown_share * grown.best
        and _is_large_enough(fit, grown)
        and 2 * beside > count
    ):
        place = _place(ct, fit)
        if count > 1:
            return LabelVerdict(place)
        return LabelVerdict(
            None, (_sentence(structures.names[int(np.nanargmax(fit.structures_own))], place),)
        )
    if count < FEWEST_FOR_SINGLE or fit.own < plain_share * fit.best:
        return LabelVerdict(None)
    weak &= grown.structures_own < SINGLE_SHARE * grown.own
    return LabelVerdict(None, tuple(map(_sentence, np.array(structures.names)[weak].tolist())))


def check_labels(ct: Volume, structures: Structures) -> tuple[str, ...]:
    """Warnings about structures that hold no bone.

    Raises
    ------
    InputError
        Most structures lie beside bone; the sentence says where they would fit.

    """
    verdict = judge_labels(ct, structures)
    if verdict.misplaced is not None:
        raise InputError(
            f"Most labels lie beside the CT's bones; they would fit {verdict.misplaced}: check that the segmentation "
            "is of this CT, and was saved with its orientation and origin."
        )
    return verdict.warnings


def fits(ct: Volume, structures: Structures) -> bool:
    """Whether labels certainly lie on the CT's bones."""
    fit = CoarseScene(ct, structures.labels, len(structures)).fit()
    return fit is not None and fit.own >= max(MANY_SHARES[0] * fit.best, CERTAIN * fit.noise)


def _sentence(name: str, place: str = "") -> str:
    """A warning about one structure."""
    hint = f" and would fit {place}" if place else ""
    return (
        f'Structure "{name}" is hardly denser than what surrounds it{hint}: check that its labels are '
        "those of a bone of this CT."
    )


def _is_large_enough(fit: LabelFit, grown: LabelFit) -> bool:
    """Whether a bad fit cannot come from labels that are too small."""
    if fit.best > FROM_CHANCE * fit.noise:
        return grown.best < TOO_SMALL * fit.best
    return grown.best < CLEARLY_LARGER * fit.best


def _place(ct: Volume, fit: LabelFit) -> str:
    """Where labels fit best, for a sentence."""
    distance = float(np.linalg.norm(fit.shift_mm))
    if not fit.flipped:
        return f"{distance:.0f} mm away"
    axes = [_ALONG[int(np.argmax(np.abs(ct.affine[:3, 2 - axis])))] for axis in fit.flipped]
    turned = f"mirrored {axes[0]}" if len(axes) == 1 else "turned by half a turn"
    return turned + (f" and moved by {distance:.0f} mm" if distance > 2 * fit.cell_mm else "")
