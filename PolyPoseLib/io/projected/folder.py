"""The folder of a projection: one picture for each X-ray, DICOM where the X-ray was, and a table of all points."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from PolyPoseLib.data.result import CameraResult, Result
from PolyPoseLib.data.view_names import label_of, view_name
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.dicom import looks_like_dicom
from PolyPoseLib.io.images import write_image
from PolyPoseLib.io.projected.drawing import drawn_xray
from PolyPoseLib.io.projected.plan import PlanPart
from PolyPoseLib.io.projected.secondary_capture import CaptureSeries
from PolyPoseLib.io.projected.shadows import ViewShadows, view_shadows
from PolyPoseLib.io.same_study import require_same_study
from PolyPoseLib.io.studies import load_study_xrays

HEADING = (
    "plan of the CT as registered by PolyPose; ellipses 95 %. Research software, not for clinical decisions."
)

TABLE = "points.csv"
COLUMNS = (
    "view", "label", "column_px", "row_px", "half_axis_95_minor_px", "half_axis_95_major_px", "where", "moved_by",
)  # fmt: skip


@dataclass(frozen=True)
class ShownXray:
    """One X-ray to draw on.

    Attributes
    ----------
    view : CameraResult
        Its camera and name.
    image : (H, W) array
        Line integrals as seen from the source.
    mirrored : bool
        Whether it is shown with its columns the other way round, as its file has it.
    source : Path or None
        Its DICOM file, None where it is not known or none.

    """

    view: CameraResult
    image: np.ndarray
    mirrored: bool = False
    source: Path | None = None


def shown_xrays(
    result: Result, folder: Path, study: Path | None = None, allow_outside: bool = False
) -> list[ShownXray]:
    """The X-rays of a result, from its study where that is given, else from the result's own folder.

    Raises
    ------
    InputError
        The study is another than the result's, or no study is given for a result of an earlier version.

    """
    views = [replace(each, name=each.name or view_name(n)) for n, each in enumerate(result.cameras)]
    if study is None:
        if len(result.xray_images) != len(views):
            raise InputError(
                f"{folder}: the result holds no X-rays, as an earlier version wrote it: add --study STUDY.json."
            )
        return [ShownXray(view, image) for view, image in zip(views, result.xray_images, strict=True)]
    given = load_study_xrays(study, allow_outside)
    require_same_study(study, study_schema.read(study), result, [xray.image for _, xray in given])
    return [
        ShownXray(
            view, xray.image, xray.mirrored, path if path.is_file() and looks_like_dicom(path) else None
        )
        for view, (path, xray) in zip(views, given, strict=True)
    ]


def write_projections(
    result: Result, parts: Sequence[PlanPart], xrays: Sequence[ShownXray], folder: Path
) -> list[str]:
    """Draw a plan onto every X-ray.

    Parameters
    ----------
    result : Result
        Of the registration.
    parts : sequence
        The carried plan.
    xrays : sequence of ShownXray
        As ``shown_xrays`` gives them.
    folder : Path
        There and empty.

    Returns
    -------
    list of str
        A sentence for everything that is not drawn.

    Raises
    ------
    InputError
        Matplotlib is missing, or an X-ray's DICOM file has no identity.

    """
    import SimpleITK as sitk

    warning = "NOT TO BE TRUSTED: see result.json" if result.distrust else ""
    series, sentences = CaptureSeries(), []
    with (folder / TABLE).open("w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(COLUMNS)
        for number, xray in enumerate(xrays):
            shadows = view_shadows(xray.view, parts)
            sentences += shadows.sentences
            image = xray.image
            if xray.mirrored:
                shadows, image = _mirrored(shadows, xray.view.width), image[:, ::-1]
                sentences.append(
                    f"{label_of(xray.view.name)} is shown as its file has it, mirrored to the source's view."
                )
            heading = f"{xray.view.name}: {HEADING}"
            picture = drawn_xray(image, shadows, heading, warning)
            write_image(sitk.GetImageFromArray(picture, isVector=True), folder / f"xray_{number}.png")
            if xray.source is not None:
                series.write(picture, number + 1, xray.source, folder / f"xray_{number}.dcm")
            table.writerows(_rows(xray.view.name, shadows))
    return sentences


def _mirrored(shadows: ViewShadows, width: int) -> ViewShadows:
    """The same with columns counted from the other side."""
    sign = np.array([-1.0, 1.0])
    shift = np.array([width - 1.0, 0.0])
    return replace(
        shadows,
        points=tuple(
            replace(each, place=each.place * sign + shift, covariance=each.covariance * np.outer(sign, sign))
            for each in shadows.points
        ),
        lines=tuple(each * sign + shift for each in shadows.lines),
        outlines=tuple(
            replace(each, polygons=[line * sign + shift for line in each.polygons])
            for each in shadows.outlines
        ),
    )


def _rows(view: str, shadows: ViewShadows) -> list[list[str]]:
    """Lines of the table; what is not known is empty."""
    return [
        [
            view,
            each.label,
            *(_decimal(value) for value in (*each.place, *each.half_axes_px)),
            each.where,
            each.moved_by,
        ]
        for each in shadows.points
    ]


def _decimal(value: float) -> str:
    return f"{value + 0.0:.3f}" if math.isfinite(value) else ""
