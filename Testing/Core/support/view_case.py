"""A study and its result on disk, small enough that a page of it is there in a second."""

import json
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from carried_case import carried_result
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.result import CameraResult
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.io.volumes import write_volume

DISTANCE_MM, PIXEL_MM, HEIGHT, WIDTH = 1000.0, 3.0, 60, 80
POINTS = "label,x,y,z\nentry,-20,20,20\n<b>{{ target }}</b>,0,0,-30\n"
"""The second name would be markup, and a template, where it is not taken literally."""


def write_case(folder: Path, name: str = "result") -> Path:
    """Write study.json with its images, points.csv, and the result's folder; return the latter."""
    folder.mkdir(parents=True, exist_ok=True)
    result = carried_result()
    labels = result.structure_labels
    assert labels is not None
    rng = np.random.default_rng(3)
    hu = np.full(labels.shape, -1000.0)
    hu[2:-2, 4:-4, 4:-4] = 40
    hu[labels.voxels > 0] = 700
    hu = gaussian_filter(hu, 0.6) + rng.normal(0, 12, hu.shape)
    ct = Volume(hu.astype(np.int16), labels.affine)
    middle = ct.bounds_center
    intrinsics = intrinsics_matrix(DISTANCE_MM, PIXEL_MM, HEIGHT, WIDTH)
    cameras = [
        Camera(intrinsics, look_at(middle + 750 * np.array(toward), middle), HEIGHT, WIDTH)
        for toward in ((0.0, -1.0, 0.0), (0.8, -0.6, 0.0))
    ]
    pictures = [_picture(ct, camera) for camera in cameras]
    result.cameras = [CameraResult(each, 0.9, f"view {n + 1}") for n, each in enumerate(cameras)]
    result.warped_ct = Volume(np.roll(ct.voxels, (2, 3, 3), axis=(0, 1, 2)), ct.affine)  # plainly another
    result.warped_labels = labels
    result.renderings_after = [np.roll(each, 4, axis=1) for each in pictures]
    result.renderings_before = result.renderings_after
    result.xray_images = pictures
    write_volume(ct, folder / "ct.nii.gz")
    write_volume(labels, folder / "labels.nii.gz")
    entries = []
    for n, (picture, camera) in enumerate(zip(pictures, cameras, strict=True)):
        sitk.WriteImage(sitk.GetImageFromArray(picture), str(folder / f"view{n}.nii.gz"))
        entries.append(
            {
                "image": f"view{n}.nii.gz", "source_to_detector_mm": DISTANCE_MM, "camera": "known",
                "pixel_spacing_mm": [PIXEL_MM, PIXEL_MM], "extrinsic": camera.extrinsic.tolist(),
                "intensity": "line_integral",
            }
        )  # fmt: skip
    study = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "anchor": "pelvis", "xrays": entries,
        "structures": {"pelvis": [1], "femur": [2]},
    }  # fmt: skip
    (folder / "study.json").write_text(json.dumps(study))
    (folder / "points.csv").write_text(POINTS)
    return result.save(folder / name)


def _picture(ct: Volume, camera: Camera) -> np.ndarray:
    """Line integrals to about a tenth: every voxel laid onto the pixel that it projects to."""
    index = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), axis=-1).reshape(-1, 3)[:, ::-1]
    pixels = camera.project(ct.to_world(index))
    mass = np.maximum(ct.voxels.reshape(-1) + 1000.0, 0) * 2e-5 * 2.0
    edges = [np.arange(n + 1) - 0.5 for n in (camera.height, camera.width)]
    picture, *_ = np.histogram2d(pixels[:, 1], pixels[:, 0], bins=edges, weights=mass)
    return gaussian_filter(picture, 1.0).astype(np.float32)
