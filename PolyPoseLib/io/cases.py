"""A simulated case as a folder: study.json with the images it names, and the truth beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import CAMERA_STATES
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.images import write_image
from PolyPoseLib.io.json_records import json_text
from PolyPoseLib.io.truths import save_truth
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.io.xray.storage import Storage
from PolyPoseLib.io.xray.writer import Stand, write_xray_dicom
from PolyPoseLib.simulation.case_study import given_camera, pixel_spacing
from PolyPoseLib.simulation.truth import truth_of

if TYPE_CHECKING:
    from PolyPoseLib.geometry.camera import Camera
    from PolyPoseLib.simulation.simulate import SimulatedCase

STUDY_FILE = "study.json"
TRUTH_FOLDER = "truth"


def write_case(
    case: SimulatedCase,
    folder: str | Path,
    label_ids: Mapping[str, Sequence[int]] | None = None,
    organ_names: Mapping[int, str] | None = None,
    options: Mapping[str, Any] | None = None,
    image_format: str = "dicom",
    camera: str = "initial",
    source_to_detector_mm: float = 1020.0,
) -> Path:
    """Write a study that can be registered, and its truth.

    Parameters
    ----------
    case : SimulatedCase
        What to write.
    folder : path
        Made when it does not exist; it must be empty.
    label_ids : {str: sequence of int}, optional
        Labels of each structure in the case's source segmentation; None writes the structures' own numbers.
    organ_names : {int: str}, optional
        Names of the source segmentation's labels, for the scores of soft organs.
    options : mapping, optional
        The study's options.
    image_format : {"dicom", "nifti"}
        XA, or line integrals.
    camera : {"initial", "known", "absent"}
        Extrinsics off by the case's error, the true ones, or none.
    source_to_detector_mm : float
        Splits the focal length into distance and pixel pitch.

    Returns
    -------
    Path
        Of study.json; the truth lies in the folder "truth" beside it.

    Raises
    ------
    InputError
        The folder is not empty or cannot be written, or an argument has none of the values above.

    """
    folder = Path(folder)
    _check(folder, image_format, camera)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_volume(case.ct.with_voxels(np.rint(case.ct.voxels).astype(np.int16)), folder / "ct.nii.gz")
        ids = _write_labels(case, folder, label_ids)
        xrays = [
            _write_xray(case, number, folder, image_format, camera, source_to_detector_mm)
            for number in range(len(case.images))
        ]
        fields = {
            "version": 1,
            "ct": "ct.nii.gz",
            "segmentation": "labels.nii.gz",
            "structures": ids,
            "anchor": case.anchor,
            "xrays": xrays,
            "options": dict(options or {}),
        }
        path = folder / STUDY_FILE
        path.write_text(json_text(fields), encoding="utf-8")
        save_truth(truth_of(case, dict(organ_names or {})), folder / TRUTH_FOLDER)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); choose another folder.") from error
    return path


def _check(folder: Path, image_format: str, camera: str) -> None:
    """Refuse what cannot be written."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: is not an empty folder; choose another one.")
    if image_format not in ("dicom", "nifti"):
        raise InputError(f'The image format is {image_format!r}: give "dicom" or "nifti".')
    if camera not in CAMERA_STATES:
        raise InputError(f'The camera is {camera!r}: give "initial", "known" or "absent".')


def _write_labels(
    case: SimulatedCase, folder: Path, label_ids: Mapping[str, Sequence[int]] | None
) -> dict[str, list[int]]:
    """Write the segmentation and return the labels of each structure."""
    if label_ids is None or case.source_labels is None:
        write_volume(Volume(case.structures.labels, case.ct.affine), folder / "labels.nii.gz")
        return {name: [number] for number, name in enumerate(case.structures.names, start=1)}
    missing = [name for name in case.structures.names if name not in label_ids]
    if missing:
        raise InputError(f"label_ids lacks the structure {missing[0]!r}: give the labels of every structure.")
    write_volume(case.source_labels, folder / "labels.nii.gz")
    return {name: [int(label) for label in label_ids[name]] for name in case.structures.names}


def _write_xray(
    case: SimulatedCase,
    number: int,
    folder: Path,
    image_format: str,
    camera: str,
    source_to_detector_mm: float,
) -> dict[str, Any]:
    """Write one view and return its entry in the study."""
    given = given_camera(case, number, camera)
    entry: dict[str, Any] = {"name": f"view {number + 1}"}
    centre = [(given.width - 1) / 2, (given.height - 1) / 2]
    if image_format == "nifti":
        entry["image"] = f"xray_{number + 1}.nii.gz"
        _write_nifti(case.images[number], folder / entry["image"])
        entry |= {
            "intensity": "line_integral",
            "source_to_detector_mm": source_to_detector_mm,
            "pixel_spacing_mm": list(pixel_spacing(given, source_to_detector_mm)),
        }
    else:
        entry["image"] = f"xray_{number + 1}.dcm"
        _write_dicom(case, number, folder / entry["image"], given, source_to_detector_mm)
    if not np.allclose(given.intrinsics[:2, 2], centre, atol=1e-6):
        entry["principal_point_px"] = given.intrinsics[:2, 2].tolist()
    if camera != "absent":
        entry |= {"extrinsic": given.extrinsic.tolist(), "camera": camera}
    return entry


def _write_dicom(
    case: SimulatedCase, number: int, path: Path, given: Camera, source_to_detector_mm: float
) -> None:
    """Write one view as XA in the bits that were measured; its angles are those of the camera given."""
    physics = case.options.physics
    stand = Stand(
        source_to_detector_mm=source_to_detector_mm,
        pixel_spacing_mm=pixel_spacing(given, source_to_detector_mm),
        source_to_isocenter_mm=float(np.linalg.norm(given.source - case.ct.bounds_center)),
        extrinsic=given.extrinsic,
    )
    storage = Storage(
        bits=max(physics.bits, 8) if physics.bits else 16,
        encoding=physics.encoding,
        saturation=physics.saturation,
    )
    write_xray_dicom(
        path,
        case.images[number],
        stand,
        storage,
        description=f"view {number + 1}",
        study=f"simulated case {case.seed}",
    )


def _write_nifti(image: np.ndarray, path: Path) -> None:
    """Write an image (H, W) of line integrals row by row."""
    import SimpleITK as sitk

    write_image(sitk.GetImageFromArray(np.asarray(image, dtype=np.float32)), path)
