"""A result of random numbers, which several tests save and read."""

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.result import CameraResult, Result, StructureResult
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera

FILES = {
    "result.json", "transform.h5", "warped_ct.nii.gz", "warped_labels.nii.gz", "xray_0_drr.nii.gz",
    "xray_1_drr.nii.gz", "report.png", "report.html", "xray_0.nii.gz", "xray_1.nii.gz",
    "inverse_transform.h5", "structures.nii.gz", "README.txt",
}  # fmt: skip


def random_pose(rng, degrees=20.0, mm=15.0) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec(np.radians(rng.uniform(-degrees, degrees, 3))).as_matrix()
    pose[:3, 3] = rng.uniform(-mm, mm, 3)
    return pose


def make_result(seed=0, views=2) -> Result:
    """A result of random numbers."""
    rng = np.random.default_rng(seed)
    affine = np.diag([2, -2, 2.5, 1])
    shape = (9, 10, 11)
    intrinsics = np.array([[2000, 0, 30], [0, 2000, 20], [0, 0, 1.0]])
    images = [rng.random((40, 60)).astype(np.float32) for _ in range(views)]
    uncertainty = {"along_mm": 1.5, "across_mm": [0.2, 0.3], "covariance": np.eye(6).tolist()}
    return Result(
        structures={
            "pelvis": StructureResult.from_pose(np.eye(4), np.zeros(3)),
            "femur": StructureResult.from_pose(random_pose(rng), rng.uniform(-50, 50, 3), uncertainty),
        },
        cameras=[
            CameraResult(Camera(intrinsics, random_pose(rng), 40, 60), float(rng.random()), f"view {n}")
            for n in range(views)
        ],
        history=[{"stage": "bones", "iteration": n, "similarity": 0.5 + 0.01 * n} for n in range(20)],
        seconds={"bones": 1.5, "total": 2.0},
        device="cpu",
        versions={"polypose": "0.1.0"},
        warnings=["careful"],
        warped_ct=Volume(rng.integers(-1000, 1500, shape).astype(np.float32), affine),
        warped_labels=Volume(rng.integers(0, 200, shape).astype(np.int16), affine),
        transform=DisplacementField(rng.normal(size=(5, 6, 7, 3)).astype(np.float32), np.diag([4, -4, 4, 1])),
        inverse_transform=DisplacementField(
            rng.normal(size=(5, 6, 7, 3)).astype(np.float32), np.diag([4, -4, 4, 1])
        ),
        structure_labels=Volume(rng.integers(0, 3, shape).astype(np.int16), affine),
        renderings_after=images,
        renderings_before=[image + 1 for image in images],
        xray_images=[image + 2 for image in images],
        anchor="pelvis",
        soft_tissue_deviation_mm=np.array([0.8, 1.6, 4.0]),
        segmentation_labels=tuple(range(1, 200)),
    )
