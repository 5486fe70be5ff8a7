"""A tiny CT with two bones, and X-rays without pixels, for the tests of the learned cameras."""

import numpy as np

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import intrinsics_matrix
from PolyPoseLib.registration.scene import Scene

ANCHOR = "pelvis"


def phantom():
    """CT (HU) of 6 mm voxels and its structures: an asymmetric anchor and a rod."""
    affine = np.diag([6.0, 6.0, 6.0, 1.0])
    affine[:3, 3] = (-87, -57, -93)
    kji = np.stack(np.meshgrid(*map(np.arange, (32, 20, 30)), indexing="ij"), -1)
    x = kji[..., ::-1] @ affine[:3, :3].T + affine[:3, 3]
    labels = np.zeros(x.shape[:3], np.int16)
    labels[(np.abs(x - (-30, 0, 10)) < (30, 12, 40)).all(-1)] = 1
    labels[(np.abs(x - (20, 15, 30)) < (30, 12, 14)).all(-1)] = 1
    labels[(np.abs(x - (50, -10, -40)) < (10, 10, 40)).all(-1)] = 2
    hu = np.where(np.linalg.norm(x[..., :2] / (80, 50), axis=-1) < 1, 20.0, -1000.0)
    hu[labels > 0] = 900.0
    return Volume(hu.astype(np.float32), affine), Structures((ANCHOR, "femur"), labels)


def scene():
    ct, structures = phantom()
    return Scene(ct, structures, ANCHOR)


def xray(view="AP", image=None):
    image = np.zeros((60, 60), np.float32) if image is None else image
    return Xray(
        image=image,
        mask=np.ones(image.shape, bool),
        intrinsics=intrinsics_matrix(1000.0, 300.0 / image.shape[0], *image.shape),
        extrinsic=None,
        camera="absent",
        pixel_spacing_mm=(300.0 / image.shape[0],) * 2,
        source_to_detector_mm=1000.0,
        name="view",
        standard_view=view,
    )
