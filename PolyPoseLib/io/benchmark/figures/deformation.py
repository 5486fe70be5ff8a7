"""A deformation as a picture: how far tissue moves, and which structures' motions it takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.options import Weighting
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import one_line
from PolyPoseLib.io.benchmark.figures.canvas import COLOURS, INK, PAGE, SMALL, TEXT, new_figure
from PolyPoseLib.io.benchmark.figures.straight import CORONAL, in_patient, richest_slice, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SCALE = "cividis"
"""Made for all kinds of colour vision (J. Nunez, C. Anderton and R. Renslow, PLOS ONE 2018)."""

OTHERS_COLOUR = "#b8bec4"
"""Of the structures that have no colour of their own."""

_DISTANCE_SPACING_MM = 3.0
_ARROWS = 26
"""Along the picture's longer side."""

_LEAST_SCALE_MM = 1.0


def draw_deformation(
    case: BenchmarkCase, motion: Motion, warped: Volume, labels: Volume, heading: str
) -> Figure:
    """The displacement in the coronal plane that shows most structures.

    Parameters
    ----------
    case : BenchmarkCase
        Its study has the structures.
    motion : Motion
        From fixed to moving points.
    warped : Volume
        The CT in the fixed frame on a straight grid, HU.
    labels : Volume
        Above 0 in structures in the fixed frame, on the same grid.
    heading : str
        Above the pictures.

    Returns
    -------
    Figure
        Magnitudes in mm; for a motion whose poses make the field, tissue coloured by its structures' weights beside it.

    """
    at = richest_slice(labels.voxels, CORONAL)
    hu = CORONAL.cut(warped.voxels, at)
    points = CORONAL.cut(_points(warped, at), 0)
    displacement = motion.field.sample(points)
    body = in_patient(hu)
    panels = 1 if motion.weighting is None else 2
    rows, columns = hu.shape
    width = PAGE if panels == 2 else 0.62 * PAGE
    figure = new_figure(width, (width - 0.9) / panels * rows / columns + (1.1 if panels == 2 else 0.6))
    places = figure.subplots(1, panels, squeeze=False)[0]

    def magnitude(place: Axes) -> None:
        _draw_magnitude(figure, place, hu, displacement, body)

    show(places[0], magnitude, CORONAL, warped, ruler=True)
    places[0].set_title("displacement, coronal", fontsize=TEXT, color=INK)
    places[0].set_xlabel(
        "arrows: its part in this plane, from the X-rayed posture to the CT's", fontsize=SMALL - 1
    )
    if motion.weighting is not None:
        names, weights = contributions(case, motion, motion.weighting, points)

        def shares(place: Axes) -> None:
            _draw_shares(figure, place, hu, body, names, weights)

        show(places[1], shares, CORONAL, warped)
        places[1].set_title("weights of the structures' motions", fontsize=TEXT, color=INK)
    figure.suptitle(heading, fontsize=TEXT + 1, color=INK, weight="bold")
    return figure


def _points(grid: Volume, at: int) -> np.ndarray:
    """Fixed points (k, 1, i, 3) of a coronal slice, LPS mm."""
    k, i = np.meshgrid(np.arange(grid.shape[0]), np.arange(grid.shape[2]), indexing="ij")
    return grid.to_world(np.stack([i, np.full_like(i, at), k], axis=-1))[:, None]


def contributions(
    case: BenchmarkCase, motion: Motion, weighting: Weighting, points: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray]:
    """Weights of the structures' motions at fixed points.

    Parameters
    ----------
    case : BenchmarkCase
        Its study has the structures; those of which the motion has no pose, as of the anchor, do not move.
    motion : Motion
        With poses.
    weighting : Weighting
        The motion's own.
    points : (..., 3) array
        Fixed LPS mm.

    Returns
    -------
    tuple of str
        The K structures.
    (..., K) array
        Weights that sum to 1, as the motion has them: the paper's are of other distances than the default's.

    """
    import torch

    from PolyPoseLib.warp.weights import distance_maps, weights

    structures, ct = case.study.structures, case.study.ct
    maps = distance_maps(structures, ct.affine, spacing_mm=_DISTANCE_SPACING_MM)
    poses = np.stack([np.asarray(motion.poses.get(name, np.eye(4)), np.float64) for name in structures.names])
    flat = torch.from_numpy(np.ascontiguousarray(points.reshape(-1, 3)))
    with torch.no_grad():
        distance = maps(flat) if weighting.frame == "fixed" else maps.under(flat, torch.from_numpy(poses))
        share = torch.as_tensor(structures.volume_share())
        found = weights(distance, share, weighting.form, weighting.epsilon)
    return structures.names, found.numpy().T.reshape(*points.shape[:-1], len(structures.names))


def _draw_magnitude(
    figure: Figure, place: Axes, hu: np.ndarray, displacement: np.ndarray, body: np.ndarray
) -> None:
    length = np.linalg.norm(displacement, axis=-1)
    inside = length[body]
    highest = max(float(np.percentile(inside, 99.5)) if inside.size else 0.0, _LEAST_SCALE_MM)
    _draw_grey(place, hu)
    shown = place.imshow(
        length, cmap=SCALE, vmin=0, vmax=highest, alpha=np.where(body, 0.75, 0.0), interpolation="nearest"
    )
    bar = figure.colorbar(shown, ax=place, shrink=0.8, aspect=30, pad=0.02, extend="max")
    bar.solids.set_alpha(1.0)  # pyright: ignore[reportOptionalMemberAccess]
    bar.set_label("displacement (mm)", fontsize=SMALL, color=INK)
    bar.ax.tick_params(labelsize=SMALL, colors=INK, width=0.6)
    step = max(max(body.shape) // _ARROWS, 1)
    row, column = np.meshgrid(
        np.arange(step // 2, body.shape[0], step), np.arange(step // 2, body.shape[1], step), indexing="ij"
    )
    kept = body[row, column] & (length[row, column] > 0.02 * highest)
    row, column = row[kept], column[kept]
    across, up = displacement[row, column, 0], displacement[row, column, 2]
    place.quiver(
        column, row, across, up, color="#ffffff", angles="uv", scale_units="xy", scale=highest / (1.6 * step),
        width=0.004, headwidth=4, edgecolor=INK, linewidth=0.35,
    )  # fmt: skip


def _draw_shares(
    figure: Figure, place: Axes, hu: np.ndarray, body: np.ndarray, names: tuple[str, ...], weights: np.ndarray
) -> None:
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    total = weights[body].mean(axis=0) if body.any() else weights.reshape(-1, len(names)).mean(axis=0)
    order = [int(k) for k in np.argsort(-total)]
    own = order if len(order) <= len(COLOURS) else order[: len(COLOURS) - 1]
    palette = np.tile(to_rgb(OTHERS_COLOUR), (len(names), 1))
    for colour, k in zip(COLOURS, own, strict=False):
        palette[k] = to_rgb(colour)
    picture = np.concatenate([weights @ palette, np.where(body, 0.8, 0.0)[..., None]], axis=-1)
    _draw_grey(place, hu)
    place.imshow(np.clip(picture, 0, 1), interpolation="nearest")
    handles = [
        Patch(facecolor=palette[k], label=f"{one_line(names[k])[:24]} {100 * total[k]:.0f} %") for k in own
    ]
    if len(own) < len(order):
        rest = 100 * float(sum(total[k] for k in order[len(own) :]))
        handles.append(Patch(facecolor=OTHERS_COLOUR, label=f"{len(order) - len(own)} others {rest:.0f} %"))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=4, fontsize=SMALL - 1, frameon=False, handlelength=1.2,
        title="mean weight in this slice", title_fontsize=SMALL, labelcolor=INK,
    )  # fmt: skip


def _draw_grey(place: Axes, hu: np.ndarray) -> None:
    place.set_facecolor("#000000")
    place.imshow(hu, cmap="gray", vmin=-250.0, vmax=600.0, interpolation="nearest")
