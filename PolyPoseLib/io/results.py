"""The folder of a result: written whole or not at all, and read back."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from PolyPoseLib.data.options import Options
from PolyPoseLib.data.result import CameraResult, Result
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import AIR_HU, Volume
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.disk_space import require_space
from PolyPoseLib.io.files import read_text
from PolyPoseLib.io.json_records import (
    Record,
    array,
    boolean,
    json_text,
    list_of,
    object_of,
    parse_object,
    plain,
    real,
    string,
    whole_number,
)
from PolyPoseLib.io.report_files import write_report
from PolyPoseLib.io.result_readme import README, README_TEXT
from PolyPoseLib.io.result_records import (
    camera_fields,
    in_order_of_labels,
    read_camera,
    read_labelled,
    read_step,
    structure_fields,
)
from PolyPoseLib.io.transforms import read_transform, write_transform
from PolyPoseLib.io.volumes import read_volume, write_volume
from PolyPoseLib.io.whole_folders import FolderClaim, claimed_folder, existing_folder

VERSION = 1

XRAY_UNITS = 1000
"""Of xray_N.nii.gz for a line integral of 1."""

INVERSE, STRUCTURES = "inverse_transform.h5", "structures.nii.gz"
"""Files that results of earlier versions lack."""


def save_result(
    result: Result, folder: str | Path | FolderClaim, overwrite: bool = False, report: bool = True
) -> Path:
    """Write the folder of a result, all of it or nothing.

    A report that cannot be drawn is left out with a warning: it is no reason to lose hours of computation.

    Parameters
    ----------
    result : Result
        Of a registration.
    folder : path or FolderClaim
        To write; absent, empty, or with ``overwrite`` an earlier result. A claim says already whether it is replaced.
    overwrite : bool
        Whether an earlier result is replaced.
    report : bool
        Whether the report is drawn, too.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        The folder holds something else, or the system refuses to write; nothing is left behind.

    """
    if not isinstance(folder, FolderClaim):
        with claimed_folder(folder, overwrite) as claim:
            return save_result(result, claim, report=report)
    require_space(folder.folder, _bytes_of(result))
    with folder.whole() as temporary:
        _write_fields(result, temporary)
        write_transform(result.transform, temporary / "transform.h5")
        write_volume(_hounsfield(result.warped_ct), temporary / "warped_ct.nii.gz")
        write_volume(_labels(result.warped_labels), temporary / "warped_labels.nii.gz")
        if result.inverse_transform is not None:
            write_transform(result.inverse_transform, temporary / INVERSE)
        if result.structure_labels is not None:
            write_volume(_labels(result.structure_labels), temporary / STRUCTURES)
        (temporary / README).write_text(README_TEXT, encoding="utf-8")
        for number, (rendering, camera) in enumerate(
            zip(result.renderings_after, result.cameras, strict=True)
        ):
            write_volume(_image_volume(rendering, camera), temporary / f"xray_{number}_drr.nii.gz")
        for number, (image, camera) in enumerate(zip(result.xray_images, result.cameras, strict=False)):
            write_volume(_image_volume(_thousandths(image), camera), temporary / f"xray_{number}.nii.gz")
        if report:
            write_report(result, temporary)
    return folder.folder


def save_summary(result: Result, folder: str | Path, picture: bool = True) -> Path:
    """Write result.json alone, or with the report (picture); raises InputError as ``save_result`` does."""
    with claimed_folder(folder, overwrite=None) as claim, claim.whole() as temporary:
        _write_fields(result, temporary)
        if picture:
            write_report(result, temporary)
    return Path(folder)


def expected_bytes(study: Study) -> float:
    """About how many bytes the result of a study will take on the disk."""
    from PolyPoseLib.registration.outputs import TRANSFORM_MM, transform_grid  # torch is slow to import

    spacing = Options.from_dict(study.options).transform_spacing_mm or TRANSFORM_MM
    _, nodes, _ = transform_grid(study.ct, spacing)
    return _expected(study.ct.voxels.size, math.prod(nodes), sum(xray.image.size for xray in study.xrays))


def _bytes_of(result: Result) -> float:
    """The same for a result that is there."""
    pixels = sum(image.size for image in result.renderings_after)
    return _expected(result.warped_ct.voxels.size, math.prod(result.transform.shape), pixels)


def _expected(voxels: int, nodes: int, pixels: int) -> float:
    """Bytes on the disk: measured on real CTs, whose noise takes 0.9 to 1.2 bytes per voxel when compressed."""
    return 1.25 * voxels + 48 * nodes + 6 * pixels + 3.5e6


def _write_fields(result: Result, folder: Path) -> None:
    """Write result.json."""
    (folder / "result.json").write_text(json_text(result_fields(result)), encoding="utf-8")


def result_fields(result: Result) -> dict[str, Any]:
    """What result.json holds: plain numbers, lists and texts."""
    return plain(
        {
            "version": VERSION,
            "trusted": result.trusted,
            "distrust": result.distrust,
            "anchor": result.anchor,
            "structures": {
                name: {"label": label, **structure_fields(each)}
                for label, (name, each) in enumerate(result.structures.items(), start=1)
            },
            "cameras": [camera_fields(each) for each in result.cameras],
            "soft_tissue_deviation_mm": result.soft_tissue_deviation_mm,
            "segmentation_labels": result.segmentation_labels,
            "similarity": result.history,
            "seconds": result.seconds,
            "device": result.device,
            "versions": result.versions,
            "warnings": result.warnings,
        }
    )


def load_result(folder: str | Path) -> Result:
    """Read a result folder that ``save_result`` or the command line wrote.

    Parameters
    ----------
    folder : path
        The folder with result.json.

    Returns
    -------
    Result
        Without the X-rays' images, masks and first renderings, which the folder does not hold; without inverse
        transform and label map of structures where an earlier version wrote it.

    Raises
    ------
    InputError
        A file is missing or damaged; the sentence names it and what is wrong.

    """
    folder = existing_folder(folder, "registration")
    path = folder / "result.json"
    fields = _read_fields(path)
    record = Record(fields)
    try:
        structures = in_order_of_labels(record.required("structures", object_of(read_labelled)))
        cameras = record.required("cameras", list_of(read_camera))
        history = record.required("similarity", list_of(read_step))
        seconds = record.required("seconds", object_of(real))
        device = record.required("device", string)
        versions = record.required("versions", object_of(string))
        warnings = record.required("warnings", list_of(string))
        distrust = record.required("distrust", list_of(string)) if "distrust" in fields else []
        anchor = record.optional("anchor", string) or ""
        soft_tissue = record.optional("soft_tissue_deviation_mm", array(3))
        labels = record.optional("segmentation_labels", list_of(whole_number(1)))
        if record.optional("trusted", boolean) not in (None, not distrust):
            raise InputError('"trusted" and "distrust" contradict each other.')
        if anchor and anchor not in structures:
            raise InputError('"anchor": ' + unknown_name("structure", anchor, structures))
    except InputError as error:
        raise InputError(f"{path}: the file is damaged, register again: {error}") from error
    return Result(
        structures=structures,
        cameras=cameras,
        history=history,
        seconds=seconds,
        device=device,
        versions=versions,
        warnings=warnings,
        distrust=tuple(distrust),
        anchor=anchor,
        soft_tissue_deviation_mm=soft_tissue,
        segmentation_labels=None if labels is None else tuple(labels),
        warped_ct=read_volume(folder / "warped_ct.nii.gz"),
        warped_labels=read_volume(folder / "warped_labels.nii.gz"),
        transform=read_transform(folder / "transform.h5"),
        inverse_transform=read_transform(folder / INVERSE) if (folder / INVERSE).is_file() else None,
        structure_labels=_read_structure_labels(folder / STRUCTURES, len(structures)),
        renderings_after=[
            read_volume(folder / f"xray_{number}_drr.nii.gz").voxels[0] for number in range(len(cameras))
        ],
        xray_images=_read_xrays(folder, cameras),
    )


def load_cameras(path: str | Path) -> list[CameraResult]:
    """Read the cameras of a result alone: its folder, or its result.json; raises InputError as `load_result`."""
    path = Path(path)
    path = path / "result.json" if path.is_dir() else path
    fields = _read_fields(path)
    try:
        return Record(fields).required("cameras", list_of(read_camera))
    except InputError as error:
        raise InputError(f"{path}: the file is damaged, register again: {error}") from error


def _read_fields(path: Path) -> dict[str, Any]:
    """The fields of a result.json of this version; raises InputError."""
    fields = parse_object(read_text(path, "a folder that register wrote"), str(path))
    if fields.get("version") != VERSION:
        raise InputError(f"{path}: version {fields.get('version')!r} is not {VERSION}: register again.")
    return fields


def _read_structure_labels(path: Path, count: int) -> Volume | None:
    """The label map of the structures, None where an earlier version wrote none; raises InputError when damaged."""
    if not path.is_file():
        return None
    labels = read_volume(path)
    if not np.issubdtype(labels.voxels.dtype, np.integer):
        raise InputError(f"{path}: the file is damaged, register again: its labels are no whole numbers.")
    low, high = int(labels.voxels.min()), int(labels.voxels.max())
    if low < 0 or high > count:
        raise InputError(
            f"{path}: the file is damaged, register again: its labels run from {low} to {high}, and result.json has "
            f"{count} structures."
        )
    return labels


def _read_xrays(folder: Path, cameras: list[CameraResult]) -> list[np.ndarray]:
    """The X-rays as line integrals (H, W) float32; none where the folder is of an earlier version.

    Raises InputError where only some are there, or one has not its camera's size.
    """
    paths = [folder / f"xray_{number}.nii.gz" for number in range(len(cameras))]
    if not any(path.exists() for path in paths):
        return []
    images = []
    for path, camera in zip(paths, cameras, strict=True):
        image = read_volume(path).voxels[0].astype(np.float32) / XRAY_UNITS
        if image.shape != (camera.height, camera.width):
            raise InputError(
                f"{path}: the X-ray has {image.shape[1]} x {image.shape[0]} pixels but its camera in result.json "
                f"{camera.width} x {camera.height}: the folder is damaged, register again."
            )
        images.append(image)
    return images


def _hounsfield(ct: Volume) -> Volume:
    """HU as 16-bit integers, which halves the file and is how scanners store them; clipped to its range."""
    if np.issubdtype(ct.voxels.dtype, np.integer):
        return ct
    stored = np.empty(ct.shape, np.int16)
    for section, out in zip(ct.voxels, stored, strict=True):
        out[...] = np.clip(np.rint(np.nan_to_num(section, nan=AIR_HU)), -32768, 32767)
    return Volume(stored, ct.affine)


def _thousandths(image: np.ndarray) -> np.ndarray:
    """Line integrals as 16-bit integers, which is finer than an X-ray's noise; clipped to their range."""
    return np.clip(np.rint(np.nan_to_num(image) * XRAY_UNITS), -32768, 32767).astype(np.int16)


def _labels(labels: Volume) -> Volume:
    """Labels in the smallest unsigned type that holds them."""
    return Volume(labels.voxels.astype(np.min_scalar_type(int(labels.voxels.max()))), labels.affine)


def _image_volume(image: np.ndarray, camera: CameraResult) -> Volume:
    """An image as a volume of one slice with pixel spacing on the plane at unit focal length times 1000
    mm.

    Pixels have no place in the patient's space; spacing keeps their aspect ratio for viewers.
    """
    focal = camera.intrinsics[0, 0], camera.intrinsics[1, 1]
    affine = np.diag([1000 / focal[0], 1000 / focal[1], 1.0, 1.0])
    return Volume(np.asarray(image, dtype=np.int16 if image.dtype == np.int16 else np.float32)[None], affine)
