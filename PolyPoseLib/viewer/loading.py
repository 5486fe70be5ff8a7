"""From a result's folder, and the study if it is given, to what the page shows."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.carrying.surfaces import surfaces_of
from PolyPoseLib.data.options import Options, Weighting
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.same_study import require_same_study
from PolyPoseLib.viewer.content import COLOURS, Bone, Content, NamedPoints, View

if TYPE_CHECKING:
    from PolyPoseLib.data.study import Study

_LOG = logging.getLogger(__name__)

MOST_POINTS = 500
"""Of a file; a page with more is slow, and nobody tells them apart."""

MOST_LOOSE_LABELS = 60
"""Labels of warped_labels.nii.gz that are drawn where it is not known which structures they make up."""


def load_content(
    folder: Path, study_path: Path | None = None, points: Path | None = None, allow_outside: bool = False
) -> Content:
    """Read everything that the page shows.

    Parameters
    ----------
    folder : path
        That register wrote.
    study_path : path, optional
        The study of this result; gives the CT, the X-rays and where the detectors are.
    points : path, optional
        Points of the CT to be carried to the patient as X-rayed.
    allow_outside : bool
        Whether the study may name files outside its folder.

    Raises
    ------
    InputError
        A file is missing or damaged, or the study is another's; the sentence names it.

    """
    result = load_result(folder)
    study = None if study_path is None else _study_of(result, study_path, allow_outside)
    labels = _structure_labels(result, study)
    if points is not None and result.structure_labels is None:
        result.structure_labels = labels
    bones = _bones(result, labels)
    before, before_text = _before(result, study)
    return Content(
        result=result,
        before=before,
        before_text=before_text,
        bones=bones,
        views=_views(result, study, labels),
        at_rest_known=labels is not None,
        labels=labels,
        weighting=_weighting(study),
        points=None if points is None else _carried(result, points),
        notes=_notes(folder, result, study, labels),
    )


def _study_of(result: Result, path: Path, allow_outside: bool) -> Study:
    """The study, which must be the one that the result came from as far as can be told."""
    from PolyPoseLib.io.studies import load_study

    study = load_study(path, allow_outside)
    require_same_study(path, study_schema.read(path), result, [each.image for each in study.xrays])
    if study.ct.shape != result.warped_ct.shape or not study.ct.same_grid(result.warped_ct):
        raise InputError(
            f"{path}: the CT of this study has another grid than the result's warped_ct.nii.gz: give the study that "
            "was registered."
        )
    return study


def _structure_labels(result: Result, study: Study | None) -> Volume | None:
    """Structures in the CT's frame, numbered in the result's order from 1."""
    if result.structure_labels is not None:
        return result.structure_labels
    if study is None:
        return None
    number = np.zeros(len(study.structures) + 1, np.int16)
    for n, name in enumerate(result.structures, start=1):
        number[study.structures.index(name) + 1] = n
    return Volume(number[study.structures.labels], study.ct.affine)


def _bones(result: Result, labels: Volume | None) -> tuple[Bone, ...]:
    if labels is not None:
        surfaces = surfaces_of(labels, list(range(1, len(result.structures) + 1)))
        return tuple(
            Bone(name, COLOURS[n % len(COLOURS)], surface, rigid_inverse(each.fixed_to_moving))
            for n, ((name, each), surface) in enumerate(zip(result.structures.items(), surfaces, strict=True))
        )
    numbers = [int(n) for n in np.unique(result.warped_labels.voxels) if n][:MOST_LOOSE_LABELS]
    surfaces = surfaces_of(result.warped_labels, numbers)
    return tuple(
        Bone(f"label {number}", COLOURS[n % len(COLOURS)], surface, np.eye(4))
        for n, (number, surface) in enumerate(zip(numbers, surfaces, strict=True))
    )


def _before(result: Result, study: Study | None) -> tuple[Volume, str]:
    """The CT at rest: the study's, or what undoing the transform makes of the warped one."""
    if study is not None:
        return study.ct, "the study's CT"
    from PolyPoseLib.warp.dense import warp_volume
    from PolyPoseLib.warp.inverse import invert_field

    inverse = result.inverse_transform
    if inverse is None:
        _LOG.info("inverting the transform to show the CT at rest ...")
        inverse = invert_field(result.transform, tolerance_mm=0.1, iterations=30).field
    restored = warp_volume(result.warped_ct, inverse, outside=AIR_HU)
    return restored, "the warped CT put back, not the CT itself: blurred, and joints may be smeared"


def _views(result: Result, study: Study | None, labels: Volume | None) -> tuple[View, ...]:
    views = []
    outlines = _outlines(result, labels)
    for n, (camera, rendering) in enumerate(zip(result.cameras, result.renderings_after, strict=True)):
        xray = None if study is None else study.xrays[n]
        kept = result.xray_images[n] if n < len(result.xray_images) else None
        views.append(
            View(
                camera,
                rendering,
                kept if xray is None else xray.image,
                None if xray is None else xray.mask,
                None if xray is None else _detector_mm(camera.intrinsics, xray.pixel_spacing_mm),
                *outlines[n],
            )
        )
    return tuple(views)


def _detector_mm(intrinsics: np.ndarray, pixel_spacing_mm: tuple[float, float]) -> float:
    """The detector's distance as the camera found has it: its focal length times the pitch."""
    return float(intrinsics[0, 0] * pixel_spacing_mm[1])


def _outlines(
    result: Result, labels: Volume | None
) -> list[tuple[tuple[list[np.ndarray], ...], tuple[list[np.ndarray], ...]]]:
    """Of every view, outlines of all bones as X-rayed and at rest."""
    if labels is None:
        return [((), ())] * len(result.cameras)
    from PolyPoseLib.rendering.select import select_backend
    from PolyPoseLib.rendering.silhouettes import Silhouettes

    silhouettes = Silhouettes(labels, len(result.structures), select_backend())
    poses = [each.fixed_to_moving for each in result.structures.values()]
    return [
        (
            tuple(silhouettes.outlines(n, each.camera, pose) for n, pose in enumerate(poses)),
            tuple(silhouettes.outlines(n, each.camera, np.eye(4)) for n in range(len(poses))),
        )
        for each in result.cameras
    ]


def _weighting(study: Study | None) -> Weighting:
    """The weights of the warp; the defaults where no study says otherwise."""
    from PolyPoseLib.registration.presets import weighting_of

    return weighting_of(Options.from_dict({} if study is None else study.options))


def _carried(result: Result, path: Path) -> NamedPoints:
    """The points of a file as X-rayed; screws and other straight lines keep their length where a bone holds them."""
    from PolyPoseLib.carrying.lines import carry_with_lines
    from PolyPoseLib.io.carried.files import ending_of
    from PolyPoseLib.io.carried.points import POINT_ENDINGS, read_points

    if not path.is_file():
        raise InputError(f"{path}: there is no such file; check the name and the folder.")
    kind = ending_of(path)
    if kind not in POINT_ENDINGS:
        raise InputError(
            f"{path}: the page shows points: give a .csv, .mrk.json or .fcsv, or a plan of screws (.json)."
        )
    held = read_points(path, kind)
    if len(held.points) > MOST_POINTS:
        raise InputError(
            f"{path}: {len(held.points)} points are more than the page shows ({MOST_POINTS}): give fewer, or carry the "
            "file by the command transform."
        )
    carried = carry_with_lines(result.point_carrier(), held.points, held.lines, "xray")
    return NamedPoints(held.labels, held.points, carried)


def _notes(folder: Path, result: Result, study: Study | None, labels: Volume | None) -> tuple[str, ...]:
    notes = []
    if study is None:
        held = "the CT" if result.xray_images else "the CT and the X-rays, for which renderings stand in"
        near = folder.resolve().parent / "study.json"
        name = near.name if near.is_file() else "STUDY.json"
        notes.append(
            f"The result does not hold {held}. The CT at rest is reconstructed, detectors are drawn behind the patient "
            "since their distances are not known, and weights are those of the default options. Add --study "
            f"{name} to see the originals in their places."
        )
    if labels is None:
        notes.append(
            "The result has no structures.nii.gz (it was written by an earlier version), so it does not say where its "
            "structures are: all labels, organs among them, are shown as X-rayed instead, without outlines on X-rays, "
            "weights and bones at rest. The study would say it."
        )
    return tuple(notes)
