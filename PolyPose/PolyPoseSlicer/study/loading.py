"""Reads a finished result from its folder, in a thread: arrays only, no nodes."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..scene.nodes import Grid, Layer, Voxels, resample
from .writer import StudyData

if TYPE_CHECKING:
    from PolyPoseLib.data.result import Result


@dataclass(frozen=True)
class LoadedXray:
    """One X-ray as the registration read it: line integrals (H, W), and the distance of its detector."""

    name: str
    image: np.ndarray
    source_to_detector_mm: float | None


@dataclass(frozen=True)
class LoadedResult:
    """Everything of a result that nodes are made of.

    labels: the numbers that occur in the result's label map, without 0.
    overlapping: warped layers of segments that one label map could not hold.
    centroids: {structure: (3,) in the CT, LPS mm}, as far as known.
    report: the bytes of report.png, None when there is none.
    """

    result: Result
    labels: list[int]
    overlapping: list[Layer] = field(default_factory=list)
    xrays: list[LoadedXray] = field(default_factory=list)
    centroids: dict[str, np.ndarray] = field(default_factory=dict)
    report: bytes | None = None


def load_folder(
    folder: str | Path, study: StudyData | None = None, study_file: Path | None = None
) -> LoadedResult:
    """Read a result folder, and from the study what the folder does not hold.

    Raises PolyPoseLib.errors.InputError when the folder holds no whole result.
    """
    from PolyPoseLib.io.results import load_result

    folder = Path(folder)
    result = load_result(folder)
    report = folder / "report.png"
    return LoadedResult(
        result=result,
        labels=_numbers_in(result.warped_labels.voxels),
        overlapping=_warp_overlapping(study, result) if study is not None else [],
        xrays=_read_xrays(study_file) if study_file is not None else [],
        centroids=structure_centroids(study) if study is not None else _stored_centroids(result),
        report=report.read_bytes() if report.is_file() else None,
    )


def _numbers_in(labels: np.ndarray) -> list[int]:
    """The values of a label map without 0, ascending; slice by slice to save memory."""
    seen = np.zeros(int(labels.max()) + 1, dtype=bool)
    for section in labels:
        seen[section.ravel()] = True
    return [int(number) for number in np.flatnonzero(seen) if number]


def _warp_overlapping(study: StudyData, result: Result) -> list[Layer]:
    """The segments that overlap others, each layer warped as a whole by the result's transform."""
    import SimpleITK as sitk

    lost = set(study.overlapped)
    transform = result.transform.to_sitk_transform() if lost else None
    warped = []
    for layer in study.layers:
        labels = {segment: label for segment, label in layer.labels.items() if segment in lost}
        if not labels:
            continue
        source = resample(layer.voxels, study.ct.grid, labels=True)
        image = sitk.GetImageFromArray(source.values)
        grid = source.grid
        image.SetSpacing(grid.spacing.tolist())
        image.SetDirection((grid.affine[:3, :3] / grid.spacing).ravel().tolist())
        image.SetOrigin(grid.affine[:3, 3].tolist())
        out = sitk.Resample(image, image, transform, sitk.sitkNearestNeighbor, 0.0)
        warped.append(Layer(cropped(Voxels(sitk.GetArrayFromImage(out), grid)), labels))
    return warped


def cropped(labels: Voxels) -> Voxels:
    """The smallest box of a label map that holds all that is not 0."""
    ranges = []
    for axis in range(3):
        others = tuple(each for each in range(3) if each != axis)
        used = np.flatnonzero(labels.values.any(axis=others))
        ranges.append((int(used[0]), int(used[-1]) + 1) if len(used) else (0, 1))
    first = np.eye(4)
    first[:3, 3] = [low for low, _high in reversed(ranges)]
    values = np.ascontiguousarray(labels.values[tuple(slice(low, high) for low, high in ranges)])
    return Voxels(values, Grid(labels.grid.affine @ first, values.shape))


def _read_xrays(study_file: Path) -> list[LoadedXray]:
    """The X-rays of a study as the registration reads them; none when one cannot be read again."""
    from PolyPoseLib.data.view_names import view_name
    from PolyPoseLib.errors import PolyPoseError
    from PolyPoseLib.io import study_schema
    from PolyPoseLib.io.xray.read import read_xray

    xrays = []
    try:
        for number, entry in enumerate(study_schema.read(study_file)["xrays"]):
            xray = read_xray(study_file.parent / entry["image"], fields=entry, frame=entry.get("frame"))
            distance = getattr(xray, "source_to_detector_mm", None)
            xrays.append(LoadedXray(xray.name or view_name(number), np.asarray(xray.image), distance))
    except PolyPoseError as error:
        logging.warning("The X-rays are not shown beside their renderings: %s", error)
        return []
    return xrays


def structure_centroids(study: StudyData) -> dict[str, np.ndarray]:
    """Mean of each structure's voxel centres in LPS mm; empty before the study was written."""
    labels, affine = study.labels, study.ct.grid.affine
    if labels is None:
        return {}
    counts = np.zeros(len(study.segment_ids) + 1)
    sums = np.zeros((3, len(counts)))
    for k, section in enumerate(labels):
        j, i = np.nonzero(section)
        owner = section[j, i]
        counts += np.bincount(owner, minlength=len(counts))
        for axis, index in enumerate((i, j, np.full(len(i), k))):
            sums[axis] += np.bincount(owner, index, minlength=len(counts))
    centroids = {}
    for name, ids in study.structures.items():
        numbers = [study.segment_ids.index(each) + 1 for each in ids]
        if counts[numbers].sum() > 0:
            mean = sums[:, numbers].sum(axis=1) / counts[numbers].sum()
            centroids[name] = affine[:3, :3] @ mean + affine[:3, 3]
    return centroids


def _stored_centroids(result: Result) -> dict[str, np.ndarray]:
    """Centroids that a result states, or those that follow from its motions.

    A motion's displacement d = (R - I) c + t determines the centroid c up to a shift along the axis; the
    shortest c is taken, which is exact for that motion itself.
    """
    centroids = {}
    for name, each in result.structures.items():
        if each.centroid is not None:
            centroids[name] = each.centroid
            continue
        motion = np.linalg.inv(each.fixed_to_moving)
        shift = each.translation_mm - motion[:3, 3]
        centroids[name] = np.linalg.pinv(motion[:3, :3] - np.eye(3), rcond=1e-9) @ shift
    return centroids
