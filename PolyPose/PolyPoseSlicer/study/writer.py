"""Turns nodes into a study folder: first everything is copied from the scene, then it is written without it."""

from __future__ import annotations

import errno
import json
import logging
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError

from ..scene.nodes import Layer, Voxels, read_layers, read_volume, region_on
from .xray_source import XraySource

LOST_SHARE = 0.02
"""A segment that loses more than this part of its voxels to other structures gets a warning."""

UNKNOWN_SPACING = (1.0, 1.0)
"""The spacing that Slicer gives an image whose file has none; it is not passed on."""


@dataclass
class StudyData:
    """A study outside of the scene; nothing in it refers to a node.

    structures: {structure: [segment IDs]}; segment_ids, segment_names: of all in order, number n has label n + 1.
    layers: label maps in the segmentation's own grids.
    xrays: (entry of the study file, pixels (H, W) or None, pixel spacing (row, column)).
    initial_poses: of structures that are refined from there, (4, 4) from the X-rays' posture to the CT, LPS mm.
    """

    ct: Voxels
    layers: list[Layer]
    segment_ids: list[str]
    structures: dict[str, list[str]]
    anchor: str
    xrays: list[tuple[dict[str, Any], np.ndarray | None, tuple[float, float]]]
    options: dict[str, Any]
    initial_poses: dict[str, np.ndarray] = field(default_factory=dict)
    labels: np.ndarray | None = None
    overlapped: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    segment_names: list[str] = field(default_factory=list)


def read_study(
    ct: slicer.vtkMRMLScalarVolumeNode,
    segmentation: slicer.vtkMRMLSegmentationNode,
    structures: Mapping[str, Sequence[str]],
    xrays: Sequence[Any],
    anchor: str,
    options: Mapping[str, Any] | None = None,
) -> StudyData:
    """Copy all that a registration needs from the scene.

    Parameters
    ----------
    ct, segmentation : nodes
        Taken as they are shown; never changed.
    structures : dict of str to sequence of str
        {structure: names or IDs of segments}.
    xrays : sequence of XraySource, node, or path
        One entry per X-ray.
    anchor : str
        The structure that stays where it is.
    options : dict, optional
        As in PolyPoseLib.data.options.

    Returns
    -------
    StudyData

    Raises
    ------
    InputError
        Something is missing or wrong, as one sentence.

    """
    study = read_bones(ct, segmentation, structures, anchor)
    if not xrays:
        raise InputError(_("There is no X-ray: add at least one; two from different directions are better."))
    study.xrays = [_read_xray(XraySource.of(each)) for each in xrays]
    study.options = dict(options or {})
    return study


def read_bones(
    ct: slicer.vtkMRMLScalarVolumeNode,
    segmentation: slicer.vtkMRMLSegmentationNode,
    structures: Mapping[str, Sequence[str]],
    anchor: str,
) -> StudyData:
    """Copy CT and bones from the scene, as of `read_study`; the study has no X-rays. Raises InputError."""
    if ct is None:
        raise InputError(_("No CT is chosen: choose a volume."))
    if segmentation is None:
        raise InputError(_("No segmentation is chosen: choose that of the CT's bones."))
    if not structures:
        raise InputError(_("No structure is chosen: include at least the anchor and one other bone."))
    if anchor not in structures:
        raise InputError(
            _("The anchor '{anchor}' is not one of the structures: choose one of them.").format(anchor=anchor)
        )
    content = segmentation.GetSegmentation()
    segment_ids = list(content.GetSegmentIDs())
    return StudyData(
        ct=read_volume(ct),
        layers=read_layers(segmentation, segment_ids),
        segment_ids=segment_ids,
        structures={
            name: [segment_id(segmentation, each) for each in ids] for name, ids in structures.items()
        },
        anchor=anchor,
        xrays=[],
        options={},
        segment_names=[content.GetSegment(each).GetName() for each in segment_ids],
    )


def segment_id(segmentation: slicer.vtkMRMLSegmentationNode, name: str) -> str:
    """The ID of a segment given by ID or name; raises InputError when there is none, or several."""
    content = segmentation.GetSegmentation()
    if content.GetSegment(name) is not None:
        return name
    found = [each for each in content.GetSegmentIDs() if content.GetSegment(each).GetName() == name]
    if len(found) != 1:
        text = _("The segmentation '{segmentation}' has {count} segments named '{name}': give the ID of one.")
        if not found:
            text = _("The segmentation '{segmentation}' has no segment named '{name}'.")
        raise InputError(text.format(segmentation=segmentation.GetName(), count=len(found), name=name))
    return found[0]


def _read_xray(source: XraySource) -> tuple[dict[str, Any], np.ndarray | None, tuple[float, float]]:
    path, frame = source.file()
    if path:
        return source.entry(str(Path(path).resolve()), frame), None, UNKNOWN_SPACING
    pixels, spacing = source.pixels()
    return source.entry("", None), pixels, spacing


def write_study(study: StudyData, folder: Path) -> Path:
    """Write a study's files into a folder and return the path of STUDY.json; touches no node.

    Sets study.labels. Raises OSError when the disk is full or the folder cannot be written.
    """
    labels = write_bones(study, folder, 3 * study.ct.values.nbytes + 2 * study.ct.values.size)
    entries = []
    for number, (entry, pixels, spacing) in enumerate(study.xrays):
        if pixels is not None:
            name = f"xray_{number}.nrrd"
            write_pixels(pixels, spacing, folder / name)
            entry = with_spacing({**entry, "image": name}, spacing)
        entries.append(entry)
    fields = {
        "version": 1,
        "ct": "ct.nrrd",
        "segmentation": "labels.nrrd",
        "structures": numbers_left(study, labels),
        "anchor": study.anchor,
        "xrays": entries,
        "options": study.options,
    }
    if study.initial_poses:
        fields["initial_poses"] = {name: pose.tolist() for name, pose in study.initial_poses.items()}
    path = folder / "STUDY.json"
    path.write_text(json.dumps(fields, indent=1), encoding="utf-8")
    return path


def write_bones(study: StudyData, folder: Path, needed: float) -> np.ndarray:
    """Write ct.nrrd and labels.nrrd into a folder and return the label map; sets study.labels, touches no node.

    needed: bytes of all that will be written. Raises OSError when the disk is full or the folder cannot be written.
    """
    _require_space(folder, needed)
    labels = study.labels = merged_labels(study)
    _write_image(study.ct, folder / "ct.nrrd")
    _write_image(Voxels(labels, study.ct.grid), folder / "labels.nrrd", _segment_fields(study))
    return labels


def _segment_fields(study: StudyData) -> dict[str, str]:
    """What Slicer's own label maps say of their segments, so that messages name them."""
    fields = {}
    for n, name in enumerate(study.segment_names):
        fields[f"Segment{n}_ID"] = study.segment_ids[n]
        fields[f"Segment{n}_Name"] = name if name.strip() else study.segment_ids[n]
        fields[f"Segment{n}_LabelValue"] = str(n + 1)
        fields[f"Segment{n}_Layer"] = "0"
    # A line break would end a field of the header.
    return {key: " ".join(value.split()) for key, value in fields.items()}


def with_spacing(entry: dict[str, Any], spacing: tuple[float, float]) -> dict[str, Any]:
    """An X-ray's entry with its image node's spacing (row, column) in mm, where nothing else gives it."""
    if spacing == UNKNOWN_SPACING or {"pixel_spacing_mm", "intrinsics"} & entry.keys():
        return entry
    return {**entry, "pixel_spacing_mm": list(spacing)}


def numbers_left(study: StudyData, labels: np.ndarray) -> dict[str, list[int]]:
    """{structure: labels of its segments that have voxels}; raises InputError where a structure has none."""
    left = np.bincount(labels.ravel(), minlength=len(study.segment_ids) + 1)
    numbers = {}
    for structure, segments in study.structures.items():
        labelled = [study.segment_ids.index(each) + 1 for each in segments]
        numbers[structure] = [number for number in labelled if left[number]]
        if not numbers[structure]:
            raise InputError(
                _(
                    "The structure '{structure}' has no voxels of its own inside the CT: leave it out, or correct its "
                    "segments."
                ).format(structure=structure)
            )
    return numbers


def merged_labels(study: StudyData) -> np.ndarray:
    """One label map (k, j, i) int16 on the CT's grid; number n + 1 is segment n.

    Structures win over segments that do not move, the earlier over the later; study.overlapped lists the
    segments that lost voxels, study.warnings the structures that lost many.
    """
    chosen = {each for ids in study.structures.values() for each in ids}
    out = np.zeros(study.ct.grid.shape, np.int16)
    whole = np.zeros(len(study.segment_ids) + 1, np.int64)
    lost = np.zeros_like(whole)
    for group in (chosen, set(study.segment_ids) - chosen):
        for layer in study.layers:
            region, values = region_on(layer.voxels, study.ct.grid)
            table = np.zeros(int(values.max(initial=0)) + 1, np.int16)
            for segment, label in layer.labels.items():
                if segment in group and label < len(table):
                    table[label] = study.segment_ids.index(segment) + 1
            numbers, there = table[values], out[region]
            whole += np.bincount(numbers.ravel(), minlength=len(whole))
            lost += np.bincount(numbers[(numbers > 0) & (there > 0)], minlength=len(whole))
            np.copyto(there, numbers, where=there == 0)
    study.overlapped = [each for n, each in enumerate(study.segment_ids, start=1) if lost[n]]
    for number, segment in enumerate(study.segment_ids, start=1):
        if segment in chosen and lost[number] > LOST_SHARE * whole[number]:
            study.warnings.append(
                _(
                    "Segment '{segment}' shares {percent:.0f} % of its voxels with other structures, which keep them: "
                    "correct the segmentation where they overlap."
                ).format(segment=segment, percent=100 * lost[number] / whole[number])
            )
    for warning in study.warnings:
        logging.warning(warning)
    return out


def _require_space(folder: Path, needed: float) -> None:
    """Refuse a full disk before anything is written; needed: bytes of the inputs and of what will be made of them."""
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(
            errno.ENOSPC,
            _(
                "PolyPose needs about {needed:.1f} GB in {folder}, where {free:.1f} GB are free: free some "
                "space, or set another temporary folder in Slicer's settings."
            ).format(needed=needed / 1e9, folder=folder, free=free / 1e9),
        )


def _write_image(voxels: Voxels, path: Path, fields: Mapping[str, str] | None = None) -> None:
    """Write an uncompressed NRRD file with fields of its own in its header."""
    import SimpleITK as sitk

    values = voxels.values
    if values.dtype == bool:
        values = values.astype(np.uint8)
    image = sitk.GetImageFromArray(values)
    image.SetSpacing(voxels.grid.spacing.tolist())
    image.SetDirection((voxels.grid.affine[:3, :3] / voxels.grid.spacing).ravel().tolist())
    image.SetOrigin(voxels.grid.affine[:3, 3].tolist())
    for name, value in (fields or {}).items():
        image.SetMetaData(name, value)
    _write(image, path, values.nbytes)


def write_pixels(pixels: np.ndarray, spacing: tuple[float, float], path: Path) -> None:
    """Write one image (H, W) or (H, W, channels) as it is, uncompressed; raises OSError when the disk is full."""
    import SimpleITK as sitk

    image = sitk.GetImageFromArray(pixels, isVector=pixels.ndim == 3)
    image.SetSpacing((spacing[1], spacing[0]))
    _write(image, path, pixels.nbytes)


def _write(image: Any, path: Path, size: int) -> None:
    """Write, and check that all of it arrived: the toolkit may not notice a full disk."""
    import SimpleITK as sitk

    try:
        sitk.WriteImage(image, str(path), False)
        arrived = path.stat().st_size >= size
    except (RuntimeError, OSError):
        arrived = False
    if not arrived:
        raise OSError(
            errno.ENOSPC,
            _(
                "{file} could not be written completely into {folder}: free some space there, or set another "
                "temporary folder in Slicer's settings."
            ).format(file=path.name, folder=path.parent),
        )
