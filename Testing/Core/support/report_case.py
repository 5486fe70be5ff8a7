"""A result of a pelvis and a femur that cameras see: for reports."""

import numpy as np
from carried_case import carried_result
from scipy.ndimage import gaussian_filter

from PolyPoseLib.data.result import CameraResult, Result
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at

SHAPE = (90, 110)


def seen_result(seed=0, views=2, degrees=60.0) -> Result:
    """Both bones in every X-ray; X-rays and renderings are smooth noise."""
    result = carried_result(seed)
    rng = np.random.default_rng(seed)
    intrinsics = intrinsics_matrix(1000, 2.0, *SHAPE)
    result.cameras = []
    for n in range(views):
        angle = np.radians(n * degrees / max(views - 1, 1))
        source = 700 * np.array([np.sin(angle), -np.cos(angle), 0])
        camera = Camera(intrinsics, look_at(source, (0, 0, 0)), *SHAPE)
        result.cameras.append(CameraResult(camera, 0.9 + 0.01 * n, f"view {n + 1}"))
    for name in ("renderings_before", "renderings_after", "xray_images"):
        noise = [gaussian_filter(rng.normal(size=SHAPE), 3) for _ in range(views)]
        setattr(result, name, [(3 + each / each.std()).astype(np.float32) for each in noise])
    return result
