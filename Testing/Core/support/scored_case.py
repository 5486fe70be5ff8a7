"""Benchmark cases of ellipsoids, whose labels in both postures are told by formulas and not by a warp.

The patient as X-rayed shows the CT's shapes through one affine motion, fixed to moving, which a displacement field's
trilinear interpolation holds exactly.
"""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.benchmark.case import BenchmarkCase, CaseTruth, HeldOutView
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at

SHAPES = {
    "pelvis": (7, (0.0, 5.0, -14.0), (24.0, 14.0, 10.0)),
    "femur": (3, (-16.0, -4.0, 12.0), (8.0, 9.0, 15.0)),
    "liver": (200, (17.0, 2.0, 14.0), (12.0, 10.0, 11.0)),
}
"""{structure: (its label, centre and half axes in the CT's frame, mm)}."""

MOTION = np.eye(4)
MOTION[:3, :3] = Rotation.from_rotvec(np.radians([5.0, -8.0, 6.0])).as_matrix()
MOTION[:3, 3] = (4.0, -3.0, 5.0)
"""Fixed to moving."""

SPACING = (1.6, 2.0, 2.5)
PIXELS, SOURCE_TO_DETECTOR, PITCH = (90, 80), 1000.0, (1.5, 1.8)


def oblique(spacing=SPACING, size=(50, 40, 34), left_handed=True, turn=(0.2, -0.1, 0.15)):
    """Affine (4, 4) and shape (k, j, i) of a grid about the world's origin."""
    axes = Rotation.from_rotvec(turn).as_matrix() * spacing
    if left_handed:
        axes[:, 0] *= -1
    affine = np.eye(4)
    affine[:3, :3] = axes
    affine[:3, 3] = -axes @ ((np.array(size) - 1) / 2)
    return affine, size[::-1]


def world_points(affine, shape):
    """Centres (k, j, i, 3) of a grid's voxels."""
    k, j, i = np.meshgrid(*[np.arange(n) for n in shape], indexing="ij")
    return np.stack([i, j, k], axis=-1) @ affine[:3, :3].T + affine[:3, 3]


def labels_at(points, shapes=None):
    """Labels (...,) of moving points (..., 3)."""
    labels = np.zeros(points.shape[:-1], np.int16)
    for number, centre, axes in (shapes or SHAPES).values():
        labels[(((points - np.array(centre)) / axes) ** 2).sum(axis=-1) <= 1] = number
    return labels


def moved(points, motion=MOTION):
    return points @ motion[:3, :3].T + motion[:3, 3]


def field_of(motion=MOTION, spacing=4.0, half=80.0):
    """The displacement field of an affine motion, on a straight grid that covers the CT."""
    count = int(2 * half / spacing) + 1
    affine = np.diag([spacing, spacing, spacing, 1.0])
    affine[:3, 3] = -half
    points = world_points(affine, (count,) * 3)
    return DisplacementField(moved(points, motion) - points, affine)


def view(angle, pixels=PIXELS):
    """A camera (H, W) at an angle about the body's long axis."""
    source = 600.0 * np.array([np.sin(angle), -np.cos(angle), 0.1])
    intrinsics = intrinsics_matrix(SOURCE_TO_DETECTOR, PITCH, *pixels)
    return Camera(intrinsics, look_at(source, (0.0, 0.0, 0.0)), *pixels)


def exact_mask(labels, affine, number, camera):
    """Pixels whose centre lies in the shadow of a voxel: that of a convex body is the hull of its corners' shadows."""
    from scipy.spatial import ConvexHull

    row, column = np.meshgrid(np.arange(camera.height), np.arange(camera.width), indexing="ij")
    seen = np.zeros((camera.height, camera.width), bool)
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    mask = np.pad(labels == number, 1)
    inner = mask.copy()
    for axis in range(3):
        inner &= np.roll(mask, 1, axis) & np.roll(mask, -1, axis)
    for index in (np.argwhere(mask & ~inner) - 1)[:, ::-1]:  # a ray that meets a body meets its surface
        world = (index + corners) @ affine[:3, :3].T + affine[:3, 3]
        seen_by = (world @ camera.extrinsic[:3, :3].T + camera.extrinsic[:3, 3]) @ camera.intrinsics.T
        hull = ConvexHull(seen_by[:, :2] / seen_by[:, 2:])
        sides = hull.equations
        low, high = hull.points.min(axis=0), hull.points.max(axis=0)
        near = (column >= low[0]) & (column <= high[0]) & (row >= low[1]) & (row <= high[1]) & ~seen
        points = np.stack([column[near], row[near]], axis=-1)
        seen[near] = (points @ sides[:, :2].T + sides[:, 2] <= 0).all(axis=1)
    return seen


def sampled_mask(inside, camera, depths):
    """Pixels of which a sample along the ray is inside a body; inside takes points (N, 3) to (N,) bool."""
    row, column = np.meshgrid(np.arange(camera.height), np.arange(camera.width), indexing="ij")
    pixels = np.stack([column, row, np.ones_like(row)], axis=-1).reshape(-1, 3)
    rays = pixels @ np.linalg.inv(camera.intrinsics).T @ camera.extrinsic[:3, :3]
    source = -camera.extrinsic[:3, :3].T @ camera.extrinsic[:3, 3]
    seen = np.zeros(len(rays), bool)
    for depth in depths:
        seen |= inside(source + depth * rays)
    return seen.reshape(camera.height, camera.width)


def study_of(ct, labels, groups):
    """A study with one X-ray; groups {structure: labels}."""
    numbers = np.zeros(ct.shape, np.uint8)
    for place, members in enumerate(groups.values(), start=1):
        numbers[np.isin(labels.voxels, members)] = place
    camera = view(0.0)
    xray = Xray(
        image=np.ones(PIXELS, np.float32),
        mask=np.ones(PIXELS, bool),
        intrinsics=camera.intrinsics,
        extrinsic=camera.extrinsic,
        camera="known",
        pixel_spacing_mm=PITCH,
        source_to_detector_mm=SOURCE_TO_DETECTOR,
        name="view 1",
        provenance=("drawn",),
        warnings=(),
        initial_radius=None,
    )
    structures = Structures(tuple(groups), numbers)
    return Study(ct, structures, next(iter(groups)), (xray,), source_segmentation=labels)


def drawn_case(motion=MOTION, views=2, truth_grid=None, **replaced):
    """The case, its truth on another grid than the CT; replaced: fields of the truth."""
    affine, shape = oblique()
    points = world_points(affine, shape)
    labels = Volume(labels_at(points), affine)
    ct = Volume(np.where(labels.voxels > 0, 500.0, 0.0).astype(np.float32), affine)
    fixed_affine, fixed_shape = truth_grid or oblique((2.0, 1.5, 2.0), (56, 60, 56), False, (0.0, 0.1, 0.0))
    fixed_points = world_points(fixed_affine, fixed_shape)
    fixed = Volume(labels_at(moved(fixed_points, motion)), fixed_affine)
    held_out = []
    for number in range(views):
        camera = view(0.4 + number)
        masks = {
            name: exact_mask(fixed.voxels, fixed_affine, number, camera)
            for name, (number, _, _) in SHAPES.items()
        }
        held_out.append(HeldOutView(f"held out {number + 1}", camera, PITCH, masks))
    truth = CaseTruth(
        cameras=(view(0.0),),
        labels=fixed,
        ct=Volume(np.where(fixed.voxels > 0, 500.0, 0.0).astype(np.float32), fixed_affine),
        field=field_of(motion),
        poses={"pelvis": motion, "femur": motion},
        held_out=tuple(held_out),
    )
    return BenchmarkCase(
        name="drawn-1x0",
        dataset="drawn",
        subject="subject01",
        views="1x0",
        study=study_of(ct, labels, {"pelvis": [7], "femur": [3]}),
        labels={name: (number,) for name, (number, _, _) in SHAPES.items()},
        groups={"bones": ("pelvis", "femur"), "soft organs": ("liver",)},
        truth=dataclasses.replace(truth, **replaced),
    )
