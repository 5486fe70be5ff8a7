"""Read a study from its JSON file and the images that it names."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.view_names import view_name
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import paths as study_paths
from PolyPoseLib.io import study_schema
from PolyPoseLib.io.frame_of_reference import other_frame_warnings
from PolyPoseLib.io.label_placement import checked_structures
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.view_checks import odd_cameras, odd_views
from PolyPoseLib.io.volumes import read_ct_with_warnings
from PolyPoseLib.io.xray.read import read_xray

if TYPE_CHECKING:
    from PolyPoseLib.data.xray import Xray


_LOG = logging.getLogger(__name__)


def load_study(path: str | Path, allow_outside: bool = False) -> Study:
    """Read a study file and everything that it names.

    Parameters
    ----------
    path : path
        The study's JSON file; its paths start from its folder.
    allow_outside : bool
        Whether files outside that folder may be read.

    Returns
    -------
    Study
        With its images in memory.

    Raises
    ------
    InputError
        Whatever is wrong; the sentence names the file, the field and the fix.

    """
    path = Path(path)
    fields = study_schema.read(path)
    folder = path.parent.resolve()
    try:
        ct_path = study_paths.resolve(fields["ct"], "ct", folder, allow_outside)
        labels_path = study_paths.resolve(fields["segmentation"], "segmentation", folder, allow_outside)
        options = _with_paths(fields.get("options") or {}, folder, allow_outside)
        entries = _xray_entries(fields, folder, allow_outside)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    xrays = tuple(
        _read_xray(entry, number, f'{path}: "xrays"[{number}]') for number, entry in enumerate(entries)
    )
    ct, odd_values = read_ct_with_warnings(ct_path, fields.get("ct_series"))
    segmentation = read_segmentation(labels_path, ct)
    try:
        structures, odd_structures = checked_structures(
            segmentation, fields["structures"], ct, fields.get("label_table"), fields["anchor"]
        )
    except InputError as error:
        raise InputError(f'{path}: "structures": {error}') from error
    try:
        cameras = odd_cameras(xrays, entries, structures, ct.affine, fields["anchor"])
        same_views = odd_views(xrays)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    warnings = (
        *odd_values,
        *segmentation.warnings,
        *other_frame_warnings(labels_path, ct_path),
        *odd_structures,
        *same_views,
        *cameras,
        *_few_views(xrays),
    )
    for warning in warnings:
        _LOG.warning(warning)
    poses = fields.get("initial_poses") or {}
    try:
        return Study(
            ct=ct,
            structures=structures,
            anchor=fields["anchor"],
            xrays=xrays,
            options=options,
            warnings=warnings,
            source_segmentation=segmentation.whole_on_grid(ct),
            label_names=segmentation.label_names(fields.get("label_table")),
            # A structure that was left out has its warning.
            initial_poses={name: pose for name, pose in poses.items() if name in structures.names},
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def load_study_xrays(path: str | Path, allow_outside: bool = False) -> list[tuple[Path, Xray]]:
    """Read the X-rays of a study alone, each with the file that it comes from; raises InputError as ``load_study``."""
    path = Path(path)
    fields = study_schema.read(path)
    try:
        entries = _xray_entries(fields, path.parent.resolve(), allow_outside)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return [
        (Path(entry["image"]), _read_xray(entry, number, f'{path}: "xrays"[{number}]'))
        for number, entry in enumerate(entries)
    ]


def _xray_entries(fields: Mapping[str, Any], folder: Path, allow_outside: bool) -> list[dict[str, Any]]:
    """The fields of every X-ray with whole paths; raises InputError for paths that may not be read."""
    entries: list[dict[str, Any]] = [
        {
            name: study_paths.resolve(value, f'xrays"[{number}]."{name}', folder, allow_outside)
            if name in ("image", "mask", "calibration") and value is not None
            else value
            for name, value in xray.items()
        }
        for number, xray in enumerate(fields["xrays"])
    ]
    study_paths.require_different_images([(each["image"], each.get("frame")) for each in entries])
    return entries


def _with_paths(options: Mapping[str, Any], folder: Path, allow_outside: bool) -> dict[str, Any]:
    """Options whose paths were relative to the study's folder."""
    options = dict(options)
    if options.get("camera_model") is not None:
        path = study_paths.resolve(options["camera_model"], 'options"."camera_model', folder, allow_outside)
        options["camera_model"] = str(path)
    if options.get("preview") is not None:
        path = study_paths.resolve_output(options["preview"], 'options"."preview', folder, allow_outside)
        options["preview"] = str(path)
    return options


def _read_xray(fields: Mapping[str, Any], number: int, where: str) -> Xray:
    """Read one X-ray, whose paths are resolved, and log where its numbers come from, without the names of files."""
    path = fields["image"]
    try:
        entry = {**fields, "image": path.name, "name": fields.get("name") or view_name(number)}
        xray = read_xray(path, fields=entry, frame=fields.get("frame"))
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    for line in xray.provenance:
        _LOG.info("%s: %s", xray.name, line)
    for line in xray.warnings:
        _LOG.warning("%s: %s", xray.name, line)
    return xray


def _few_views(xrays: tuple[Xray, ...]) -> tuple[str, ...]:
    """A warning about a single view."""
    if len(xrays) > 1:
        return ()
    return ("There is one X-ray only: how far a structure moved along its rays is poorly known.",)
