"""Pieces of an HTML page: escaped texts, tables, and pictures with outlines over them."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

import numpy as np

from PolyPoseLib.errors import one_line
from PolyPoseLib.io.report.levels import LevelCurve
from PolyPoseLib.io.report.views import BoneOutline, Polygons, ReportView, name_places


def escaped(text: str) -> str:
    """A text from anywhere as HTML shows it, in elements and in attributes, on one line."""
    return html.escape(one_line(text.encode("utf-8", "replace").decode("utf-8")), quote=True)


def element(tag: str, text: str, kind: str = "") -> str:
    """An element that holds a text, which is escaped here."""
    return f"<{tag}{_class(kind)}>{escaped(text)}</{tag}>"


def _class(kind: str) -> str:
    return f' class="{escaped(kind)}"' if kind else ""


def table(caption: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table whose first column names the rows; texts are escaped here."""
    head = "".join(f'<th scope="col">{escaped(each)}</th>' for each in header)
    body = "".join(
        f'<tr><th scope="row">{escaped(row[0])}</th>'
        + "".join(element("td", each) for each in row[1:])
        + "</tr>"
        for row in rows
    )
    return (
        f'<div class="wide"><table><caption>{escaped(caption)}</caption><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def stored_image(identity: str, uri: str, shape: tuple[int, int]) -> str:
    """A picture that is kept once in the page and shown by ``picture`` in any number of places."""
    return (
        f'<image id="{identity}" x="-0.5" y="-0.5" width="{shape[1]}" height="{shape[0]}" '
        f'preserveAspectRatio="none" href="{uri}"/>'
    )


def picture(
    label: str,
    box: tuple[float, float, float, float],
    images: Sequence[tuple[str, str]],
    drawn: str,
    contrast: str = "",
) -> str:
    """A part of a picture with lines over it.

    Parameters
    ----------
    label : str
        Says what it shows, for those who do not see it.
    box : tuple of float
        Column, row, width and height, pixels.
    images : sequence of (str, str)
        Identity of stored images, the lowest first, and the class of each.
    drawn : str
        SVG over them.
    contrast : str
        Identity of a ``contrast`` for the images, or none.

    """
    uses = "".join(f'<use href="#{identity}"{_class(kind)}/>' for identity, kind in images)
    uses = f'<g filter="url(#{contrast})">{uses}</g>' if contrast else uses
    view_box = " ".join(f"{each:.2f}" for each in box)
    return f'<svg role="img" aria-label="{escaped(label)}" viewBox="{view_box}">{uses}{drawn}</svg>'


def contrast(identity: str, slope: float, offset: float) -> str:
    """A filter by which a part of an image uses the whole scale of grey."""
    functions = "".join(
        f'<feFunc{each} type="linear" slope="{slope:.3f}" intercept="{offset:.3f}"/>' for each in "RGB"
    )
    return (
        f'<filter id="{identity}" x="0" y="0" width="1" height="1" color-interpolation-filters="sRGB">'
        f"<feComponentTransfer>{functions}</feComponentTransfer></filter>"
    )


def outlines(bones: Iterable[BoneOutline], before: bool, after: bool) -> str:
    """Outlines of bones as SVG; a pointer over one of them shows the bone's name."""
    parts = []
    for bone in bones:
        if before and bone.kind != "anchor":
            parts.append(_path(bone.before, "before", f"{bone.name}, before"))
        if bone.kind == "anchor":
            parts.append(_path(bone.after, "anchor", f"{bone.name}, anchor"))
        elif after:
            kind = "after flagged" if bone.kind == "flagged" else "after"
            parts.append(_path(bone.after, kind, f"{bone.name}, after"))
    return "".join(parts)


def names(view: ReportView, before: bool) -> str:
    """The names of moving bones beside their outlines, as SVG."""
    size = max(view.shape) / 45
    parts = []
    for name, (column, row) in name_places(view, before, size).items():
        parts.append(f'<text x="{column:.0f}" y="{row:.0f}" font-size="{size:.1f}">{escaped(name)}</text>')
    return f'<g class="names">{"".join(parts)}</g>' if parts else ""


def _path(polygons: Polygons, kind: str, title: str) -> str:
    if not polygons:
        return ""
    steps = "".join("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in each) + "Z" for each in polygons)
    return f'<path class="{kind}" d="{steps}"><title>{escaped(title)}</title></path>'


_WIDTH, _HEIGHT = 260.0, 120.0
_LEFT, _TOP, _BOTTOM, _TEXT = 52.0, 12.0, 24.0, 12.0


def chart(curve: LevelCurve) -> str:
    """The similarity during one level as SVG with its own scale."""
    count = len(curve.values)
    share = np.arange(count) / (count - 1) if count > 1 else np.array([0.5])
    across = (_LEFT + (_WIDTH - _LEFT - 8) * share).tolist()
    places = list(zip(across, (_row_of(curve, value) for value in curve.values.tolist()), strict=True))
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2"/>' for x, y in places) if count <= 40 else ""
    label = f"Similarity, {curve.title}: {curve.summary}"
    ends = "iteration 1" if count == 1 else f"iterations 1 to {count}"
    return (
        f'<figure class="chart"><svg role="img" aria-label="{escaped(label)}" viewBox="0 0 {_WIDTH:.0f} {_HEIGHT:.0f}">'
        f'{_rules(curve)}<polyline points="{line}"/>{dots}'
        f'<text x="{_WIDTH - 8:.0f}" y="{_HEIGHT - 6:.0f}" text-anchor="end">{ends}</text></svg>'
        f"<figcaption><strong>{escaped(curve.title)}</strong><br>{escaped(curve.summary)}</figcaption></figure>"
    )


def _row_of(curve: LevelCurve, value: float) -> float:
    low, high = curve.limits
    return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (1 - (value - low) / (high - low))


def _rules(curve: LevelCurve) -> str:
    """Lines at the lowest and the highest value, with their numbers where these do not overlap."""
    parts, taken = "", -np.inf
    for value in (float(curve.values.max()), float(curve.values.min())):
        row = _row_of(curve, value)
        parts += f'<line x1="{_LEFT}" x2="{_WIDTH - 4}" y1="{row:.1f}" y2="{row:.1f}"/>'
        if row >= taken + _TEXT:
            parts += f'<text x="{_LEFT - 5}" y="{row + 4:.1f}" text-anchor="end">{value:.4f}</text>'
            taken = row
    return parts
