"""A result as one HTML page that needs no other file."""

from __future__ import annotations

import base64
import datetime
import html
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

_STYLE = (
    "body{font-family:sans-serif;max-width:70em;margin:2em auto;color:#222}"
    "table{border-collapse:collapse}td,th{border:1px solid #bbb;padding:.3em .6em;text-align:right}"
    "td:first-child,th:first-child{text-align:left}img{max-width:32%;margin:.3em}"
    ".distrust{background:#b00020;color:#fff;padding:.6em}.warning{background:#fff3cd;padding:.6em}"
)


@dataclass
class ReportPage:
    """What the page holds: facts (name, value), a table with a header, pictures (title, RGB), warnings."""

    facts: list[tuple[str, str]] = field(default_factory=list)
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    pictures: list[tuple[str, np.ndarray]] = field(default_factory=list)
    warnings: Sequence[str] = ()
    distrust: Sequence[str] = ()
    summary_png: bytes | None = None

    def html(self) -> str:
        """The whole page."""
        title = _("PolyPose report")
        parts = [
            f"<!DOCTYPE html><html><head><meta charset='utf-8'><title>{title}</title><style>{_STYLE}</style>"
            f"</head><body><h1>{title}</h1><p>{_today()} - "
            + _("Research software, not for clinical decisions.")
            + "</p>"
        ]
        parts += [
            _paragraph("distrust", _("Do not trust this result: {why}").format(why=each))
            for each in self.distrust
        ]
        parts += [_paragraph("warning", each) for each in self.warnings]
        parts.append("<table>" + "".join(_row(each) for each in self.facts) + "</table>")
        if self.rows:
            parts.append(f"<h2>{_('Motions of the bones')}</h2><table>" + _row(self.header, "th"))
            parts += [_row(each) for each in self.rows]
            parts.append("</table>")
        if self.pictures:
            parts.append(f"<h2>{_('X-rays and renderings')}</h2>")
            parts += [_image(title, png_of(rgb)) for title, rgb in self.pictures]
        if self.summary_png:
            parts.append(f"<h2>{_('Summary')}</h2>")
            parts.append(
                _image(_("Summary"), self.summary_png).replace("<img", "<img style='max-width:100%'")
            )
        return "\n".join([*parts, "</body></html>"])


def png_of(rgb: np.ndarray) -> bytes:
    """An image (H, W, 3) uint8, first row on top, as a PNG file."""
    image = vtk.vtkImageData()
    image.SetDimensions(rgb.shape[1], rgb.shape[0], 1)
    scalars = numpy_to_vtk(np.ascontiguousarray(rgb[::-1]).reshape(-1, 3), deep=True)
    image.GetPointData().SetScalars(scalars)
    writer = vtk.vtkPNGWriter()
    writer.WriteToMemoryOn()
    writer.SetInputData(image)
    writer.Write()
    return vtk_to_numpy(writer.GetResult()).tobytes()


def _today() -> str:
    return datetime.datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z")


def _paragraph(kind: str, text: str) -> str:
    return f"<p class='{kind}'>{html.escape(text)}</p>"


def _row(cells: Sequence[str], tag: str = "td") -> str:
    return "<tr>" + "".join(f"<{tag}>{html.escape(str(each))}</{tag}>" for each in cells) + "</tr>"


def _image(title: str, png: bytes) -> str:
    data = base64.b64encode(png).decode()
    name = html.escape(title, quote=True)
    return f"<img alt='{name}' title='{name}' src='data:image/png;base64,{data}'>"
