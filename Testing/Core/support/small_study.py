"""A study of a few hundred voxels on disk, for tests of the command line."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.volumes import write_volume


def write_small_study(folder: Path, xray: dict[str, Any] | None = None, **fields: Any) -> Path:
    """Write a study with its images and return its file; xray, fields: more of the X-ray's entry and the study's."""
    folder.mkdir(exist_ok=True)
    rng = np.random.default_rng(0)
    labels = np.zeros((10, 11, 12), np.uint8)
    labels[:5], labels[6:] = 25, 75
    ct = Volume(rng.integers(-1000, 1500, labels.shape).astype(np.int16), np.eye(4))
    write_volume(ct, folder / "ct.nii.gz")
    write_volume(Volume(labels, np.eye(4)), folder / "labels.nii.gz")
    image = sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32))
    sitk.WriteImage(image, str(folder / "ap.nii.gz"))
    entry = {"image": "ap.nii.gz", "source_to_detector_mm": 1020, "pixel_spacing_mm": [1, 1], **(xray or {})}
    study = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": [entry],
        "structures": {"pelvis": [25], "femur": [75]}, **fields,
    }  # fmt: skip
    (folder / "study.json").write_text(json.dumps(study))
    return folder / "study.json"
