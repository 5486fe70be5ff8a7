"""A plan on the CT, read from files and carried to the patient as X-rayed: points, lines, surfaces and labels."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.carrying.lines import carry_with_lines
from PolyPoseLib.data.carried import CarriedPoints
from PolyPoseLib.data.result import Result
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.files import longest_ending
from PolyPoseLib.io.carried.images import IMAGE_ENDINGS
from PolyPoseLib.io.carried.meshes import MESH_ENDINGS, read_surface
from PolyPoseLib.io.carried.points import POINT_ENDINGS, read_points
from PolyPoseLib.io.dicom import looks_like_dicom

MOST_REGIONS = 100
"""Of a label map; more outlines than these hide the X-ray."""


@dataclass(frozen=True)
class PlanPoints:
    """Carried points.

    Attributes
    ----------
    labels : tuple of str
        Of the N points.
    carried : CarriedPoints
        In the frame of the X-rays.
    lines : tuple of (int, int)
        Pairs of points that a straight line joins.

    """

    labels: tuple[str, ...]
    carried: CarriedPoints
    lines: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class PlanSurface:
    """A carried surface: vertices (N, 3) LPS mm in the frame of the X-rays, triangles (T, 3), and what to call it.

    Surfaces are numbered, as names of files often hold a patient's.
    """

    name: str
    vertices: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True)
class PlanRegions:
    """Carried regions: a label map in the frame of the X-rays, in which n belongs to the nth name."""

    names: tuple[str, ...]
    labels: Volume


PlanPart = PlanPoints | PlanSurface | PlanRegions


def read_plan(result: Result, path: Path, number: int = 1) -> list[PlanPart]:
    """Read one file of a plan and carry what it holds.

    Parameters
    ----------
    result : Result
        Of the registration.
    path : Path
        Points (.csv, .mrk.json, .fcsv), screws (.json), a mesh, or regions: a label map, .seg.nrrd, DICOM SEG or RT
        Structure Set.
    number : int
        Of the file among those of the plan, by which a surface is called.

    Raises
    ------
    InputError
        A kind of file that is no plan, or a damaged one.

    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; check the name and the folder.")
    ending = longest_ending(path, (*POINT_ENDINGS, *MESH_ENDINGS, *IMAGE_ENDINGS))
    if ending in POINT_ENDINGS:
        held = read_points(path, ending)
        carried = carry_with_lines(result.point_carrier(), held.points, held.lines, "xray")
        return [PlanPoints(held.labels, carried, held.lines)]
    if ending in MESH_ENDINGS:
        vertices, triangles = read_surface(path)
        moved = result.transform_mesh(vertices, triangles, "xray")
        return [PlanSurface(f"mesh {number}", moved.vertices.points, triangles)]
    if ending in IMAGE_ENDINGS or looks_like_dicom(path):
        return _regions(result, path)
    raise InputError(
        f"{path}: this kind of file is no plan: give points (.csv, .mrk.json, .fcsv), screws (.json), a mesh "
        f"({', '.join(MESH_ENDINGS)}), a label map (.nii.gz, .nrrd, .mha), or a DICOM segmentation or structure set."
    )


def _regions(result: Result, path: Path) -> list[PlanPart]:
    """Every region of a segmentation; those of several layers may overlap."""
    from PolyPoseLib.io.segmentations import read_segmentation

    segmentation = read_segmentation(path, result.warped_ct)
    parts: list[PlanPart] = []
    count = 0
    for layer in range(len(segmentation.layers)):
        labels = segmentation.on_grid(layer, result.warped_ct)
        found = [int(each) for each in np.unique(labels.voxels) if each != 0]
        count += len(found)
        if count > MOST_REGIONS:
            raise InputError(
                f"{path}: the segmentation holds more than {MOST_REGIONS} regions, which would hide the X-ray: keep "
                "those of the plan."
            )
        if not found:
            continue
        known = {each.label: each.name for each in segmentation.segments if each.layer == layer}
        names = tuple(known.get(each) or f"region {each}" for each in found)
        numbered = np.zeros(labels.shape, np.int16)
        for number, each in enumerate(found, start=1):
            numbered[labels.voxels == each] = number
        parts.append(PlanRegions(names, result.transform_image(labels.with_voxels(numbered), labels=True)))
    if not parts:
        raise InputError(f"{path}: the segmentation holds no region inside the CT: give one of this CT.")
    return parts
