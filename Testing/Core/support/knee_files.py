"""A moving knee as files: CT, labels, one stack of line integrals a camera, and TRACK.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from moving_knee import NAMES, MovingKnee

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.volumes import write_volume


def write_knee(folder: Path, knee: MovingKnee, **fields: Any) -> Path:
    """Write a knee that starts at its true poses; returns the path of TRACK.json."""
    folder.mkdir(parents=True)
    write_volume(knee.ct.with_voxels(knee.ct.voxels.astype(np.int16)), folder / "ct.nii.gz")
    write_volume(Volume(knee.structures.labels, knee.ct.affine), folder / "labels.nii.gz")
    cameras = []
    for n, camera in enumerate(knee.cameras):
        images = np.stack([knee.image(f, n) for f in range(len(knee.poses))]).astype(np.float32)
        sitk.WriteImage(sitk.GetImageFromArray(images), str(folder / f"view_{n}.nrrd"))
        cameras.append(
            {
                "images": f"view_{n}.nrrd",
                "intensity": "attenuation",
                "intrinsics": camera.intrinsics.tolist(),
                "extrinsic": camera.extrinsic.tolist(),
            }
        )
    poses = dict(zip(NAMES, knee.poses[0].tolist(), strict=True))
    given = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz",
        "structures": {name: [n] for n, name in enumerate(NAMES, start=1)}, "reference": "femur",
        "frames_per_second": 30, "cameras": cameras, "initial_poses": poses, **fields,
    }  # fmt: skip
    path = folder / "TRACK.json"
    path.write_text(json.dumps(given))
    return path
