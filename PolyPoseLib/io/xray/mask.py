"""Which pixels show the patient: shutters, collimators, padding and plain borders are masked out."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.io.xray.shutter import find_field
from PolyPoseLib.io.xray.tags import XrayTags

SMALLEST_SHARE = 0.05
"""A shape that leaves less than this share of the image is implausible and ignored."""

LARGEST_BORDER = 0.7
"""A detected border that would remove more than this share is ignored."""

_EDGES = ("LeftVerticalEdge", "RightVerticalEdge", "UpperHorizontalEdge", "LowerHorizontalEdge")


def tagged_mask(tags: XrayTags, shape: tuple[int, int], stored: np.ndarray, notes: Notes) -> np.ndarray:
    """Mask from the display shutter, the collimator and the padding value.

    Sources: Display Shutter (PS3.3 C.7.6.11), Bitmap Display Shutter (C.7.6.15), X-Ray Collimator (C.8.7.3
    and C.8.19.6.12), Pixel Padding Value (0028,0120). Coordinates of shapes count from 1.

    Parameters
    ----------
    tags
        The frame's attributes.
    shape
        (H, W).
    stored
        (H, W) stored values, for the padding.
    notes
        Receives what was removed and what was ignored.

    Returns
    -------
    np.ndarray
        (H, W) bool, True inside everything.

    """
    mask = np.ones(shape, dtype=bool)
    for name, part in (
        ("display shutter", _shapes(tags, "Shutter", shape)),
        ("bitmap shutter", _bitmap(tags, shape)),
        ("collimator", _shapes(tags, "Collimator", shape)),
        ("pixel padding", _padding(tags, stored)),
    ):
        if part is None or part.all():
            continue
        if part.mean() < SMALLEST_SHARE or not (mask & part).any():
            notes.warn(
                f"the {name} would leave {part.mean():.1%} of the image and was ignored; check the mask."
            )
            continue
        mask &= part
        notes.say(f"mask: {name} removes {1 - part.mean():.1%}")
    return mask


def _shapes(tags: XrayTags, kind: str, shape: tuple[int, int]) -> np.ndarray | None:
    """Intersection of the shapes of a "Shutter" or "Collimator", None without any that can be used."""
    parts = []
    for name in tags.texts(f"{kind}Shape"):
        if name == "RECTANGULAR":
            parts.append(_rectangle(tags, kind, shape))
        elif name == "CIRCULAR":
            parts.append(_circle(tags, kind, shape))
        elif name == "POLYGONAL":
            parts.append(_polygon(tags.numbers(f"VerticesOfThePolygonal{kind}"), shape))
    parts = [part for part in parts if part is not None]
    return np.logical_and.reduce(parts) if parts else None


def _rectangle(tags: XrayTags, kind: str, shape: tuple[int, int]) -> np.ndarray | None:
    """Pixels from the left to the right edge and from the upper to the lower."""
    edges = [tags.number(f"{kind}{edge}") for edge in _EDGES]
    if None in edges:
        return None
    left, right, upper, lower = edges
    row, column = np.ogrid[1 : shape[0] + 1, 1 : shape[1] + 1]
    return (row >= upper) & (row <= lower) & (column >= left) & (column <= right)


def _circle(tags: XrayTags, kind: str, shape: tuple[int, int]) -> np.ndarray | None:
    """Pixels within the radius, which counts columns (pixels along the row direction)."""
    center = tags.pair(f"CenterOfCircular{kind}")
    radius = tags.number(f"RadiusOfCircular{kind}")
    if center is None or not radius or radius <= 0:
        return None
    spacing = tags.pair("ImagerPixelSpacing") or tags.pair("PixelSpacing") or (1.0, 1.0)
    aspect = spacing[0] / spacing[1] if min(spacing) > 0 else 1.0
    row, column = np.ogrid[1 : shape[0] + 1, 1 : shape[1] + 1]
    return ((row - center[0]) * aspect) ** 2 + (column - center[1]) ** 2 <= radius**2


def _polygon(vertices: tuple[float, ...] | None, shape: tuple[int, int]) -> np.ndarray | None:
    """Pixels inside a closed polygon given as row, column, row, column, ... (even-odd rule)."""
    if vertices is None or len(vertices) < 6 or len(vertices) % 2:
        return None
    corner = np.array(vertices).reshape(-1, 2)
    row, column = np.ogrid[1 : shape[0] + 1, 1 : shape[1] + 1]
    inside = np.zeros(shape, dtype=bool)
    for (r0, c0), (r1, c1) in zip(corner, np.roll(corner, -1, axis=0), strict=True):
        if r0 == r1:
            continue
        crosses = (row < r0) != (row < r1)
        inside ^= crosses & (column <= c0 + (row - r0) * (c1 - c0) / (r1 - r0))
    return inside


def _bitmap(tags: XrayTags, shape: tuple[int, int]) -> np.ndarray | None:
    """Pixels where the shutter's overlay bit is 0 (PS3.3 C.7.6.15); parts outside the image are cut off."""
    group = tags.number("ShutterOverlayGroup")
    if "BITMAP" not in tags.texts("ShutterShape") or group is None:
        return None
    try:
        overlay = tags.dataset.overlay_array(int(group))
        origin = [int(part) for part in tags.dataset[int(group), 0x0050].value]
    except Exception:
        return None
    if overlay.ndim != 2:
        return None
    mask = np.ones(shape, dtype=bool)
    top, left = origin[0] - 1, origin[1] - 1
    rows = slice(max(top, 0), min(top + overlay.shape[0], shape[0]))
    columns = slice(max(left, 0), min(left + overlay.shape[1], shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        part = overlay[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        mask[rows, columns] = part == 0
    return mask


def _padding(tags: XrayTags, stored: np.ndarray) -> np.ndarray | None:
    """Pixels that are not padding; only padding that touches the image's edge counts."""
    value = tags.number("PixelPaddingValue")
    if value is None:
        return None
    limit = tags.number("PixelPaddingRangeLimit")
    low, high = sorted((value, value if limit is None else limit))
    return ~_touching_edge((stored >= low) & (stored <= high))


def _touching_edge(region: np.ndarray, smallest: int = 1) -> np.ndarray:
    """Connected parts of a region (H, W) that touch the image's edge and have `smallest` pixels or more."""
    labels = np.zeros(region.shape, dtype=np.int32)
    ndimage.label(region, output=labels)
    count = int(labels.max())
    edge = np.zeros(count + 1, dtype=bool)
    for side in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        edge[side] = True
    edge &= np.bincount(labels.ravel(), minlength=count + 1) >= smallest
    edge[0] = False
    return edge[labels]


def border_mask(values: np.ndarray, blocked: str, processed: bool, notes: Notes) -> np.ndarray:
    """Mask out plain borders that no tag mentions, conservatively.

    A border is (1) a part of at least 0.5 % of the image that touches its edge and holds the extreme value
    that an absent beam has, or (2), where the image was processed for display, whole rows and columns at
    the image's edge that hold the opposite extreme, as electronic shutters leave them. The direct beam of an
    unprocessed image is never removed.

    Parameters
    ----------
    values
        (H, W) pixel values.
    blocked
        "low" when an absent beam has the lowest value, "high" when the highest.
    processed
        Whether the image was processed for display.
    notes
        Receives what was removed.

    Returns
    -------
    np.ndarray
        (H, W) bool, True inside.

    """
    low, high = float(values.min()), float(values.max())
    tolerance = 0.004 * (high - low)
    extremes = {"low": values <= low + tolerance, "high": values >= high - tolerance}
    border = _touching_edge(extremes[blocked], max(int(0.005 * values.size), 16))
    if border.any():
        border = np.asarray(ndimage.binary_dilation(border, iterations=2), dtype=bool)
    if processed:
        border |= _full_lines(extremes["high" if blocked == "low" else "low"])
    share = float(border.mean())
    if share == 0:
        return np.ones(values.shape, dtype=bool)
    if share > LARGEST_BORDER:
        notes.warn(
            f"a plain border of {share:.0%} was found and ignored as implausible; give a mask if it is one."
        )
        return np.ones(values.shape, dtype=bool)
    notes.say(f"mask: plain border, detected, removes {share:.1%}")
    return ~border


def field_mask(values: np.ndarray, meaning: str, border: np.ndarray, notes: Notes) -> np.ndarray:
    """Mask out what lies behind collimators and shutters that no tag mentions, whatever its colour.

    Where the values are proportional to the beam, the outside must be what an absent beam gives; elsewhere it may be
    black, white, grey, or scatter and noise.

    Parameters
    ----------
    values
        (H, W) pixel values.
    meaning
        What a value means, see `PolyPoseLib.io.xray.intensity`.
    border
        (H, W) bool, the mask of plain borders, which this one is to be combined with.
    notes
        Receives what was removed.

    Returns
    -------
    np.ndarray
        (H, W) bool, True inside.

    """
    whole = np.ones(values.shape, dtype=bool)
    outside_is = {"transmission": "low", "inverse_transmission": "high"}.get(meaning)
    field = find_field(values, meaning == "transmission", outside_is)
    if field is None:
        return whole
    inside = field.mask((values.shape[0], values.shape[1]))
    share = 1 - float(inside.mean())
    if share > LARGEST_BORDER or (inside & border).mean() < SMALLEST_SHARE:
        notes.warn(
            f"a collimator or shutter that hides {share:.0%} was found and ignored as implausible; give a mask if it "
            "is one."
        )
        return whole
    notes.say(f"mask: collimator or shutter, detected, removes {share:.1%}")
    return inside


def _full_lines(region: np.ndarray) -> np.ndarray:
    """Rows and columns from the image's edge inward that lie in the region altogether (99 % of their pixels)."""
    border = np.zeros_like(region)
    for axis in (0, 1):
        plain = region.mean(axis=1 - axis) >= 0.99
        before = len(plain) if plain.all() else int(np.argmin(plain))
        after = 0 if plain.all() else int(np.argmin(plain[::-1]))
        view = border if axis == 0 else border.T
        view[:before] = True
        view[len(plain) - after :] = True
    return border
