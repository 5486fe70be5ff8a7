"""The report as one HTML page that needs no other file and no network: report.html."""

from __future__ import annotations

import base64
import hashlib

from PolyPoseLib.io.report.encoding import jpeg_uri
from PolyPoseLib.io.report.page_parts import (
    chart,
    contrast,
    element,
    escaped,
    names,
    outlines,
    picture,
    stored_image,
    table,
)
from PolyPoseLib.io.report.page_style import SCRIPT, STYLE
from PolyPoseLib.io.report.pictures import window
from PolyPoseLib.io.report.summary import Summary
from PolyPoseLib.io.report.views import CloseUp, ReportView, close_ups
from PolyPoseLib.io.report.words import (
    BEFORE,
    CAUTION,
    CELLS,
    CELLS_MEAN,
    INTERVALS,
    SIMILARITY,
    UNKNOWN,
    BoneLine,
    number,
)

NAMES_UP_TO = 12
"""Bones whose names are shown from the start; with more they would hide the X-ray."""


def page_of(summary: Summary) -> str:
    """The whole page."""
    # Names come from files: besides being escaped, no script but the page's own could run, and nothing be fetched.
    digest = base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>PolyPose report</title>\n<style>{STYLE}</style>\n</head>\n<body>",
            _header(summary),
            "<main>",
            _notes(summary),
            _controls(summary),
            _store(summary.views),
            _views(summary),
            _bones(summary),
            _motions(summary),
            _similarity(summary),
            f"</main>\n<footer>{element('p', CAUTION)}</footer>",
            f"<script>{SCRIPT}</script>\n</body>\n</html>\n",
        ]
    )


def _header(summary: Summary) -> str:
    verdict = element("p", summary.headline.text, f"verdict {summary.headline.tone}")
    return f"<header><h1>PolyPose report</h1>{verdict}{element('p', summary.facts, 'muted')}</header>"


def _notes(summary: Summary) -> str:
    if not summary.notes:
        return ""
    items = "".join(element("li", text, tone) for text, tone in summary.notes)
    return f'<section><h2>Reasons and warnings</h2><ul class="notes">{items}</ul></section>'


def _controls(summary: Summary) -> str:
    checked = " checked" if len(summary.bones) <= NAMES_UP_TO else ""
    return (
        '<div class="controls" role="group" aria-label="What the pictures show" hidden>'
        '<label><input type="checkbox" name="before" checked> outlines before</label>'
        '<label><input type="checkbox" name="after" checked> outlines after</label>'
        '<label><input type="checkbox" name="anchor" checked> anchor</label>'
        f'<label><input type="checkbox" name="names"{checked}> names</label>'
        '<label>X-ray <input type="range" min="0" max="100" value="0" '
        'aria-label="Blend from the X-ray to the CT\'s rendering, percent"> rendered CT</label></div>'
    )


def _store(views: list[ReportView]) -> str:
    """Every large picture once."""
    parts = []
    for n, view in enumerate(views):
        for kind, image in (("xray", view.xray), ("before", view.before), ("after", view.after)):
            if image is not None:
                parts.append(stored_image(f"{kind}-{n}", jpeg_uri(image), view.shape))
    return f'<svg class="store" aria-hidden="true" focusable="false"><defs>{"".join(parts)}</defs></svg>'


def _images(views: list[ReportView], view: ReportView, rendering: str) -> list[tuple[str, str]]:
    """The X-ray, and over it the rendering that the slider brings out; where only one was kept, that."""
    n = next(n for n, each in enumerate(views) if each is view)
    rendered = view.before if rendering == "before" else view.after
    if view.xray is None:
        return [] if rendered is None else [(f"{rendering}-{n}", "")]
    return [(f"xray-{n}", ""), *([(f"{rendering}-{n}", "blend")] if rendered is not None else [])]


def _views(summary: Summary) -> str:
    parts = ["<section><h2>X-rays with the outlines of the bones</h2>", element("p", BEFORE), _key(summary)]
    for view in summary.views:
        parts += [
            element("h3", view.name),
            element("p", similarity_text(view), "muted"),
            '<div class="pair">',
        ]
        for when, caption in (("before", "Before: bones as in the CT"), ("after", "After: bones as found")):
            before = when == "before"
            drawn = outlines(view.outlines, before, not before) + names(view, before)
            label = f"{view.name}, {caption[0].lower()}{caption[1:]}"
            box = (-0.5, -0.5, float(view.shape[1]), float(view.shape[0]))
            shown = picture(label, box, _images(summary.views, view, when), drawn)
            parts.append(f"<figure>{shown}{element('figcaption', caption)}</figure>")
        parts += ["</div>", _overlays(view)]
    return "".join([*parts, "</section>"])


def _key(summary: Summary) -> str:
    kinds = {each.kind for view in summary.views for each in view.outlines}
    if not kinds:
        return element("p", "No outlines: the result does not hold the structures' labels.", "muted")
    words = [
        ('<b class="before">orange, dashed</b> before', kinds & {"moving", "flagged"}),
        ('<b class="after">blue</b> after', "moving" in kinds),
        ('<b class="flagged">pink</b> after, uncertain', "flagged" in kinds),
        (
            f'<b class="anchor">yellow</b> the anchor {escaped(_anchor(summary))}, which does not move',
            "anchor" in kinds,
        ),
    ]
    lines = ", ".join(text for text, there in words if there)
    judge = "Lines after must lie on the edges of their bones; where the anchor's do not, the camera is off."
    return f'<p class="key">Lines: {lines}. {escaped(judge)}</p>'


def _anchor(summary: Summary) -> str:
    return next((f"({bone.name})" for bone in summary.bones if bone.still), "")


def _overlays(view: ReportView) -> str:
    figures = []
    for when, image in (("before", view.overlay_before), ("after", view.overlay_after)):
        if image is not None:
            alt = f"{view.name}, X-ray and rendered CT over each other, {when}"
            figures.append(
                f'<figure><img alt="{escaped(alt)}" src="{jpeg_uri(image)}">'
                f"{element('figcaption', f'Overlay {when}')}</figure>"
            )
    if not figures:
        return ""
    key = "Magenta: in the X-ray only; green: in the CT only; grey: both agree. The contrast is made equal everywhere."
    return (
        f"<details><summary>X-ray and rendered CT over each other</summary>{element('p', key)}"
        f'<div class="pair">{"".join(figures)}</div></details>'
    )


def similarity_text(view: ReportView) -> str:
    """The similarity of one X-ray with what the number means."""
    value = number(view.similarity, 3)
    if value == UNKNOWN:
        return "Similarity not known."
    return f"Similarity {value}: local correlation around the bones, 1 is perfect, below 0.5 is not trusted."


def _bones(summary: Summary) -> str:
    moving = [bone for bone in summary.bones if not bone.still]
    if not moving:
        return ""
    parts = ["<section><h2>Every moving bone, close up</h2>"]
    for bone in moving:
        parts += [element("h3", bone.name), element("p", f"{bone.motion} {bone.interval}")]
        parts += (
            [element("p", f"Uncertain: {'; '.join(bone.doubts)}.", "caution note")] if bone.doubts else []
        )
        found = close_ups(summary.views, bone.name)
        if not found:
            why = "It shows in no X-ray." if any(view.outlines for view in summary.views) else ""
            parts += [element("p", why, "muted")] if why else []
            continue
        parts.append('<div class="closeups">')
        parts += [_close_up(summary, each) for each in found]
        parts.append("</div>")
    return "".join([*parts, "</section>"])


def _close_up(summary: Summary, each: CloseUp) -> str:
    """One bone in one view, with the contrast of that part."""
    images = _images(summary.views, each.view, "after")
    label = f"{each.bone.name} in {each.view.name}, close up: outlines before and after"
    identity = (
        f"{images[0][0]}-{next(n for n, bone in enumerate(summary.bones) if bone.name == each.bone.name)}"
    )
    stretch = contrast(identity, *window(each.part))
    shown = picture(label, each.box, images, stretch + outlines([each.bone], True, True), identity)
    return f"<figure>{shown}{element('figcaption', each.view.name)}</figure>"


def _motions(summary: Summary) -> str:
    if not summary.bones:
        return ""
    rows = [_row(bone) for bone in summary.bones]
    return (
        "<section><h2>Motions and intervals</h2>"
        + table(INTERVALS, ("bone", *CELLS, "reasons for doubt"), rows)
        + element("p", CELLS_MEAN, "muted")
        + "</section>"
    )


def _row(bone: BoneLine) -> tuple[str, ...]:
    doubts = "; ".join(bone.doubts) or ("anchor, does not move" if bone.still else "none")
    return (bone.name, *bone.cells, *bone.intervals, doubts)


def _similarity(summary: Summary) -> str:
    if not summary.curves:
        return ""
    charts = "".join(chart(curve) for curve in summary.curves)
    text = element("p", SIMILARITY)
    return f'<section><h2>Similarity, level by level</h2>{text}<div class="charts">{charts}</div></section>'
