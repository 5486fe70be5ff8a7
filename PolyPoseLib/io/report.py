"""One picture by which a person can assess a registration: report.png."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.result import total_seconds
from PolyPoseLib.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    from PolyPoseLib.data.result import Result

_BACKGROUND = "#ffffff"
_INK = "#1d2733"
_MUTED = "#66727f"
_GOOD = "#1f7a3d"
_BAD = "#b3261e"
_ACCENT = "#2563a8"

_LARGEST_SIDE_PX = 640
_COLUMN_INCHES = 2.9
_LOWER_INCHES = 3.3
_TITLES = ("X-ray", "CT rendered before", "CT rendered after", "overlay before", "overlay after")


def write_report(result: Result, path: str | Path) -> None:
    """Draw the report into a PNG file; raises InputError when matplotlib is missing."""
    figure = draw_report(result)
    figure.savefig(path, dpi=120, facecolor=_BACKGROUND)


def draw_report(result: Result) -> Figure:
    """The report as a matplotlib figure that no window shows."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError(
            "The report needs matplotlib, which is not installed: pip install matplotlib."
        ) from error
    views = len(result.cameras)
    row_inches = _COLUMN_INCHES * _tallest(result)
    rows = max(len(result.structures), 1)
    lower = max(_LOWER_INCHES, 0.9 + 0.26 * (rows + 1))
    notes = _notes(result)
    height = 1.05 + views * (row_inches + 0.08) + lower + 0.2 * len(notes)
    figure = Figure(figsize=(5 * _COLUMN_INCHES + 0.6, height), facecolor=_BACKGROUND)
    FigureCanvasAgg(figure)
    top = 1 - 0.95 / height
    middle = (lower + 0.2 * len(notes)) / height
    _draw_header(figure, result, height)
    pictures = figure.add_gridspec(
        views, 5, left=0.035, right=0.995, top=top, bottom=middle + 0.05 / height,
        wspace=0.03, hspace=0.06,
    )  # fmt: skip
    for view in range(views):
        axes = [figure.add_subplot(pictures[view, column]) for column in range(5)]
        _draw_view(axes, result, view)
    bottom = figure.add_gridspec(
        1, 2, left=0.055, right=0.985, top=middle - 0.45 / height,
        bottom=(0.6 + 0.2 * len(notes)) / height, width_ratios=(1, 1.35), wspace=0.1,
    )  # fmt: skip
    _draw_similarity(figure.add_subplot(bottom[0, 0]), result)
    _draw_motions(figure.add_subplot(bottom[0, 1]), result)
    for number, (text, colour) in enumerate(reversed(notes)):
        figure.text(0.035, (0.12 + 0.2 * number) / height, text, fontsize=8.5, color=colour, va="bottom")
    for text in drawn_texts(figure):
        _take_literally(text)
    return figure


def drawn_texts(figure: Figure) -> Iterator[Text]:
    """Every text of a figure; those in the cells of tables are not among the children that matplotlib lists."""
    from matplotlib.table import Table
    from matplotlib.text import Text

    yield from figure.findobj(Text)
    for table in figure.findobj(Table):
        yield from (cell.get_text() for cell in table.get_celld().values())


def _take_literally(text: Text) -> None:
    """Show a text as it is: names are the user's, and "$" in one begins no formula.

    Half of a surrogate pair, which no font has, is shown as "?".
    """
    text.set_parse_math(False)
    text.set_usetex(False)
    text.set_text(text.get_text().encode("utf-8", "replace").decode("utf-8"))


def overlay(xray: np.ndarray, rendering: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """RGB (H, W, 3) in [0, 1]: the X-ray in magenta, the rendering in green; grey where both agree.

    Both are flattened first (local mean removed, local contrast made equal), so that edges of bones show whatever
    the exposure was.
    """
    first, second = flattened(xray, mask), flattened(rendering, mask)
    return np.stack([first, second, first], axis=-1)


def flattened(image: np.ndarray, mask: np.ndarray | None = None) -> np.ndarray:
    """An image (H, W) without its slow variation and with equal contrast everywhere, in [0, 1]; 0 outside mask."""
    from scipy.ndimage import gaussian_filter

    image = np.nan_to_num(np.asarray(image, dtype=np.float32))
    inside = np.ones(image.shape, np.float32) if mask is None else np.asarray(mask, np.float32)
    scale = max(image.shape) / 20
    share = gaussian_filter(inside, scale) + 1e-6
    detail = (image - gaussian_filter(image * inside, scale) / share) * inside
    contrast = np.sqrt(gaussian_filter(detail**2, 2 * scale) / (gaussian_filter(inside, 2 * scale) + 1e-6))
    floor = 0.15 * float(contrast.max()) + 1e-9
    return np.clip(0.42 + 0.28 * detail / (contrast + floor), 0, 1) * (inside > 0)


def _draw_view(axes: list[Axes], result: Result, view: int) -> None:
    """One row: the X-ray, the renderings, the overlays."""
    after = result.renderings_after[view]
    before = result.renderings_before[view] if view < len(result.renderings_before) else None
    xray = result.xray_images[view] if view < len(result.xray_images) else None
    mask = result.xray_masks[view] if view < len(result.xray_masks) else None
    small = [None if each is None else _shrunk(each) for each in (xray, before, after)]
    small_mask = None if mask is None else _shrunk(np.asarray(mask, np.float32)) > 0.5
    for place, image in zip(axes[:3], small, strict=True):
        _show(place, image, small_mask if place is axes[0] else None)
    for place, rendering in zip(axes[3:], small[1:], strict=True):
        if small[0] is None or rendering is None or rendering.shape != small[0].shape:
            _show(place, None, None)
        else:
            place.imshow(overlay(small[0], rendering, small_mask), interpolation="bilinear")
    for place, title in zip(axes, _TITLES, strict=True):
        place.set_xticks([])
        place.set_yticks([])
        for spine in place.spines.values():
            spine.set_visible(False)
        if view == 0:
            place.set_title(title, fontsize=10, color=_INK, pad=5)
    camera = result.cameras[view]
    name = textwrap.shorten(camera.name or f"view {view}", 40, placeholder="...")
    label = f"{name}\nsimilarity {camera.similarity:.3f}" if np.isfinite(camera.similarity) else name
    axes[0].set_ylabel(label, fontsize=9, color=_INK)


def _show(place: Axes, image: np.ndarray | None, mask: np.ndarray | None) -> None:
    """One image in grey, bone bright, windowed to what the mask keeps."""
    if image is None:
        place.text(0.5, 0.5, "not kept", transform=place.transAxes, ha="center", color=_MUTED, fontsize=9)
        return
    image = _sharpened(image)
    kept = image[mask] if mask is not None and mask.any() else image
    low, high = np.percentile(kept, (1, 99.8))
    place.imshow(image, cmap="gray", vmin=low, vmax=max(high, low + 1e-6), interpolation="bilinear")


def _sharpened(image: np.ndarray) -> np.ndarray:
    """The image with most of its slow variation taken away, as radiography consoles show it."""
    from scipy.ndimage import gaussian_filter

    image = np.nan_to_num(image)
    return image - 0.75 * gaussian_filter(image, max(image.shape) / 12)


def _draw_header(figure: Figure, result: Result, height: float) -> None:
    """Title, verdict and how the result came about."""
    figure.text(0.035, 1 - 0.14 / height, "PolyPose", fontsize=17, weight="bold", color=_INK, va="top")
    verdict, colour = (
        ("no sign of failure; judge the overlays yourself", _GOOD)
        if result.trusted
        else (f"NOT TO BE TRUSTED ({len(result.distrust)} reason(s), see below)", _BAD)
    )
    figure.text(0.13, 1 - 0.17 / height, verdict, fontsize=11, weight="bold", color=colour, va="top")
    total = total_seconds(result.seconds)
    origin = (
        f"{len(result.cameras)} views, {len(result.structures)} structures, {total:.0f} s on {result.device}"
    )
    version = result.versions.get("polypose", "")
    origin += f", PolyPose {version}" if version else ""
    figure.text(0.13, 1 - 0.44 / height, origin, fontsize=9, color=_MUTED, va="top")
    key = "overlays: magenta = X-ray only, green = CT only, grey = both agree (contrast flattened)"
    figure.text(0.995, 1 - 0.44 / height, key, fontsize=9, color=_MUTED, va="top", ha="right")


def _draw_similarity(axes: Axes, result: Result) -> None:
    """Similarity against the iteration, one line a stage."""
    start = 0
    stages: list[tuple[str, list[float]]] = []
    for step in result.history:
        value = step.get("similarity")
        stage = str(step.get("stage", ""))
        if stage == "done":
            continue
        if not stages or stages[-1][0] != stage:
            stages.append((stage, []))
        stages[-1][1].append(np.nan if value is None else float(value))
    for number, (stage, values) in enumerate(stages):
        where = np.arange(start, start + len(values))
        axes.plot(where, values, color=_ACCENT, linewidth=1.6, marker="o" if len(values) < 3 else None, ms=3)
        if number:
            axes.axvline(start - 0.5, color=_MUTED, linewidth=0.6, alpha=0.5)
        if len(stages) <= 12:
            axes.annotate(
                stage, (start, 0.02), xycoords=("data", "axes fraction"), fontsize=7, color=_MUTED, rotation=90,
                xytext=(2, 0), textcoords="offset points", va="bottom",
            )  # fmt: skip
        start += len(values)
    axes.set_title(
        "Similarity (1 is perfect; only steps within a stage compare)", fontsize=10, loc="left", color=_INK
    )
    axes.set_xlabel("iteration", fontsize=9, color=_INK)
    axes.tick_params(labelsize=8, colors=_MUTED)
    axes.grid(True, linewidth=0.4, alpha=0.5)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _draw_motions(axes: Axes, result: Result) -> None:
    """The table of motions."""
    axes.set_axis_off()
    axes.set_title("Motion from the CT to the X-rays (centroid, LPS)", fontsize=10, loc="left", color=_INK)
    header, rows = motion_rows(result)
    if not rows:
        return
    widths = [0.235, 0.1, 0.115, 0.115, 0.115, 0.115, 0.205][: len(header)]
    drawn = axes.table(rows, colLabels=header, colWidths=widths, loc="upper left", edges="horizontal")
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(8.5 if len(rows) <= 14 else 7)
    height = min(0.11, 0.97 / (len(rows) + 1))
    for (row, column), cell in drawn.get_celld().items():
        cell.set_height(height)
        cell.set_edgecolor("#d5dbe1")
        cell.set_text_props(color=_INK, weight="bold" if row == 0 else "normal")
        cell.get_text().set_horizontalalignment("left" if column == 0 else "right")


def motion_rows(result: Result) -> tuple[list[str], list[list[str]]]:
    """Header and rows of the table of motions as texts."""
    header = ["structure", "rotation", "to left", "to back", "to head", "distance"]
    uncertain = any(each.uncertainty for each in result.structures.values())
    rows = []
    for name, each in result.structures.items():
        still = name == result.anchor or (
            not result.anchor and np.array_equal(each.fixed_to_moving, np.eye(4))
        )
        shift = np.asarray(each.translation_mm, dtype=np.float64)
        numbers = [f"{each.rotation_deg:.1f}°", *(f"{value:+.1f} mm" for value in shift)]
        numbers.append(f"{np.linalg.norm(shift):.1f} mm")
        row = [f"{name} (anchor)" if still else name, *(["-"] * 5 if still else numbers)]
        rows.append([*row, _interval(each.uncertainty)] if uncertain else row)
    return ([*header, "95 % along/across"] if uncertain else header), rows


def _interval(uncertainty: Mapping[str, Any] | None) -> str:
    """A structure's 95 % intervals along and across the viewing direction in mm."""
    if not uncertainty or "along_mm" not in uncertainty or "across_mm" not in uncertainty:
        return "-"
    return f"±{uncertainty['along_mm']:.1f} / ±{float(np.max(uncertainty['across_mm'])):.1f} mm"


def _notes(result: Result) -> list[tuple[str, str]]:
    """Lines below everything: warnings and the standing caution."""
    lines = [(textwrap.shorten(text, 200, placeholder=" ..."), _BAD) for text in result.distrust[:6]]
    doubtful = [
        f"{name}: {'; '.join(each.doubts)}" for name, each in result.structures.items() if each.doubts
    ]
    lines += _first_six([f"Warning: {text}" for text in result.warnings], "warnings", _BAD)
    lines += _first_six(doubtful, "doubtful structures", _INK)
    return [*lines, ("Research software, not for clinical decisions.", _MUTED)]


def _first_six(texts: list[str], what: str, colour: str) -> list[tuple[str, str]]:
    """Lines of a list that may be long, and how many more there are."""
    lines = [(textwrap.shorten(text, 200, placeholder=" ..."), colour) for text in texts[:6]]
    return (
        [*lines, (f"... and {len(texts) - 6} more {what} in result.json", colour)]
        if len(texts) > 6
        else lines
    )


def _tallest(result: Result) -> float:
    """Largest ratio of height to width among the views, within reason."""
    ratios = [camera.height / camera.width for camera in result.cameras]
    return float(np.clip(max(ratios, default=1.0), 0.5, 1.6))


def _shrunk(image: np.ndarray) -> np.ndarray:
    """The image by block means, so that no side has more pixels than are drawn."""
    image = np.asarray(image, dtype=np.float32)
    factor = -(-max(image.shape) // _LARGEST_SIDE_PX)
    if factor <= 1:
        return image
    height, width = (n // factor * factor for n in image.shape)
    blocks = image[:height, :width].reshape(height // factor, factor, width // factor, factor)
    return blocks.mean(axis=(1, 3))
