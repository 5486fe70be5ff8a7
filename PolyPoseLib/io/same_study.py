"""Whether a study is the one that a result came from, as far as names, sizes and pictures tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import rankdata

from PolyPoseLib.data.result import Result
from PolyPoseLib.errors import InputError, unknown_name

LEAST_CORRELATION = 0.95
"""Of the ranks of an X-ray's pixels with those of the X-ray that the result holds: the same picture has 1.00 in every
version, views of one pelvis 30 degrees apart 0.90."""

CLEARLY_BETTER = 0.02
"""By which another X-ray of the result may not fit better; even views some degrees apart differ by more."""

LEAST_SEEN = 0.05
"""Of the pixels, that are not 0 in the result; with fewer, all are compared."""

MOST_PIXELS = 256
"""Along either side, of the pictures that are compared."""

FIX = "give the study that was registered"


def require_same_study(
    path: Path, fields: Mapping[str, Any], result: Result, images: Sequence[np.ndarray] | None = None
) -> None:
    """Refuse a study that is not the one of a result.

    Parameters
    ----------
    path : Path
        The study's file.
    fields : mapping
        Of the study, as ``study_schema.read`` gives them.
    result : Result
        Read from its folder.
    images : sequence of (H, W) array, optional
        The study's X-rays, line integrals; not compared where absent, or where the result of an earlier version holds
        none.

    Raises
    ------
    InputError
        The result has structures that the study does not know, another anchor, or other X-rays, or has them in
        another order.

    """
    _require_names(path, fields, result)
    if images is None:
        return
    sizes = [(each.height, each.width) for each in result.cameras]
    if [image.shape for image in images] != sizes:
        raise InputError(
            f"{path}: the result is of another study: it has {len(sizes)} X-rays of "
            f"{', '.join(f'{width} x {height}' for height, width in sizes)} pixels: {FIX}."
        )
    if len(result.xray_images) == len(images):
        _require_pictures(path, images, result.xray_images)


def _require_names(path: Path, fields: Mapping[str, Any], result: Result) -> None:
    for name in result.structures:
        if name not in fields["structures"]:
            raise InputError(
                f"{path}: the result is of another study: "
                + unknown_name("structure", name, fields["structures"])
            )
    if result.anchor and fields["anchor"] != result.anchor:
        raise InputError(
            f'{path}: the result is of another study: its anchor is "{result.anchor}", not "{fields["anchor"]}".'
        )


def _require_pictures(path: Path, images: Sequence[np.ndarray], kept: Sequence[np.ndarray]) -> None:
    for n, image in enumerate(images):
        own = rank_correlation(image, kept[n])
        others = [
            rank_correlation(image, each)
            for m, each in enumerate(kept)
            if m != n and each.shape == image.shape
        ]
        if own >= LEAST_CORRELATION and own + CLEARLY_BETTER >= max(others, default=-1.0):
            continue
        raise InputError(
            f'{path}: "xrays"[{n}] does not look like xray_{n}.nii.gz of the result (correlation {own:.2f}): {FIX}, '
            "with its X-rays in the same order."
        )


def rank_correlation(image: np.ndarray, kept: np.ndarray) -> float:
    """Spearman's correlation of a picture (H, W) with the result's, which monotone changes leave; 0 where one is even.

    Its size, without its sign: registration inverts pictures that turn out to be negatives, and sets them to 0 outside
    of their masks, so that pixels of 0 in the result are left out.
    """
    step = tuple(slice(None, None, max(1, -(-size // MOST_PIXELS))) for size in image.shape)
    pixels = [np.nan_to_num(each[step]).ravel() for each in (image, kept)]
    seen = pixels[1] != 0
    if seen.mean() < LEAST_SEEN:
        seen[:] = True
    ranks = [rankdata(each[seen]) for each in pixels]
    ranks = [each - each.mean() for each in ranks]
    lengths = [float(np.linalg.norm(each)) for each in ranks]
    if min(lengths) == 0:
        return float(lengths[0] == lengths[1])
    return abs(float(ranks[0] @ ranks[1])) / (lengths[0] * lengths[1])
