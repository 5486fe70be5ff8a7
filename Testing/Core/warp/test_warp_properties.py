"""What holds for every polyrigid warp: rigid bones, weights that sum to 1, rest, changes of the world frame, inverses.

Drawn are the bones' places and motions, the grid (either handedness, any orientation and spacing), the form of the
weights and the frame of their distances.
"""

from dataclasses import dataclass

import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import affines, motions

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.geometry.rigid import about, rigid_inverse
from PolyPoseLib.warp.dense import displacement_field, jacobian_determinant
from PolyPoseLib.warp.inverse import invert_field
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff
from PolyPoseLib.warp.weights import DistanceMaps, distance_maps

SHAPE = (9, 11, 13)
LARGEST_RAD, LARGEST_MM = 0.6, 15.0

forms = st.sampled_from(["rigid", "mass", "epsilon"])
frames = st.sampled_from(["moving", "fixed"])


@dataclass(frozen=True)
class Bones:
    """Three boxes of labels on a grid, and a motion for each."""

    structures: Structures
    affine: np.ndarray
    maps: DistanceMaps
    poses: np.ndarray

    @property
    def centroids(self) -> np.ndarray:
        return self.structures.centroids(self.affine)

    def warp(self, poses: np.ndarray | None = None, **options) -> PolyrigidWarp:
        poses = self.poses if poses is None else poses
        return PolyrigidWarp(self.maps, self.structures.volume_share(), poses, **options)

    def points_of(self, number: int) -> np.ndarray:
        """(N, 3) centres of a bone's voxels, moving LPS mm."""
        index = np.argwhere(self.structures.labels == number + 1)[:, ::-1]
        return index @ self.affine[:3, :3].T + self.affine[:3, 3]


@st.composite
def bones(draw: st.DrawFn) -> Bones:
    """Boxes that do not touch, motions about their centroids."""
    labels = np.zeros(SHAPE, np.int16)
    for number, first in enumerate((0, 5, 9)):
        size = [draw(st.integers(2, most)) for most in (8, 10, 3)]
        labels[: size[0], : size[1], first : first + size[2]] = number + 1
    structures, affine = Structures(("a", "b", "c"), labels), draw(affines())
    centroids = structures.centroids(affine)
    drawn = [draw(motions(LARGEST_RAD, LARGEST_MM)) for _ in range(3)]
    poses = np.stack([about(motion, centre) for motion, centre in zip(drawn, centroids, strict=True)])
    return Bones(structures, affine, distance_maps(structures, affine), poses)


def moved(motion: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ motion[:3, :3].T + motion[:3, 3]


def apply(warp: PolyrigidWarp, points: np.ndarray) -> np.ndarray:
    return warp(torch.from_numpy(points)).numpy()


def somewhere(case: Bones, seed: int, count: int = 60) -> np.ndarray:
    """Points in and around the grid, LPS mm."""
    index = np.random.default_rng(seed).uniform(-4, np.array(SHAPE[::-1]) + 3, (count, 3))
    return index @ case.affine[:3, :3].T + case.affine[:3, 3]


def alone(case: Bones, number: int) -> np.ndarray:
    """Where a bone lies when it has moved, without the points that another moved bone claims as well."""
    points = case.points_of(number)
    fixed = moved(rigid_inverse(case.poses[number]), points)
    distances = case.maps.under(torch.from_numpy(fixed), torch.from_numpy(case.poses)).numpy()
    others = np.delete(distances, number, axis=0).min(axis=0)
    return fixed[(others > 0.5) & (distances[number] == 0)]


@given(bones(), st.booleans())
def test_bones_stay_rigid(case: Bones, falloff: bool) -> None:
    options = {"rotation_falloff": RotationFalloff(20.0, case.centroids)} if falloff else {}
    warp = case.warp(**options)
    for number, pose in enumerate(case.poses):
        points = alone(case, number)
        found = apply(warp, points)
        np.testing.assert_allclose(found, moved(pose, points), atol=1e-5)
        if len(points) > 1:
            apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
            np.testing.assert_allclose(np.linalg.norm(np.diff(found, axis=0), axis=1), apart, atol=1e-5)


@given(bones(), forms, frames, st.integers(0, 9))
def test_weights_are_shares(case: Bones, form: str, frame: str, seed: int) -> None:
    weight = case.warp(form=form, frame=frame).weights(torch.from_numpy(somewhere(case, seed))).numpy()
    assert (weight >= 0).all()
    np.testing.assert_allclose(weight.sum(axis=0), 1, atol=1e-12)


@given(bones(), forms, frames, st.integers(0, 9))
def test_bones_at_rest_move_nothing(case: Bones, form: str, frame: str, seed: int) -> None:
    points = somewhere(case, seed)
    warp = case.warp(np.stack([np.eye(4)] * 3), form=form, frame=frame)
    np.testing.assert_allclose(apply(warp, points), points, atol=1e-9)


@given(bones(), forms, frames, motions(LARGEST_RAD, LARGEST_MM), st.integers(0, 9))
def test_bones_that_move_as_one_move_everything_with_them(
    case: Bones, form: str, frame: str, motion: np.ndarray, seed: int
) -> None:
    points = somewhere(case, seed)
    common = about(motion, case.centroids[0])
    warp = case.warp(np.stack([common] * 3), form=form, frame=frame)
    np.testing.assert_allclose(apply(warp, points), moved(common, points), atol=1e-7)


@given(bones(), forms, frames, motions(), st.integers(0, 9))
def test_a_change_of_the_world_frame_changes_nothing_else(
    case: Bones, form: str, frame: str, change: np.ndarray, seed: int
) -> None:
    points = somewhere(case, seed)
    maps = DistanceMaps(case.maps.signed, change @ case.maps.affine)
    poses = change @ case.poses @ rigid_inverse(change)
    there = PolyrigidWarp(maps, case.structures.volume_share(), poses, frame, form)
    expected = moved(change, apply(case.warp(form=form, frame=frame), points))
    np.testing.assert_allclose(apply(there, moved(change, points)), expected, atol=1e-5)


@given(bones(), st.integers(0, 2))
def test_a_grid_with_a_reversed_axis_is_the_same_grid(case: Bones, axis: int) -> None:
    labels = np.flip(case.structures.labels, 2 - axis)
    affine = case.affine.copy()
    affine[:3, 3] += affine[:3, axis] * (SHAPE[2 - axis] - 1)
    affine[:3, axis] *= -1
    structures = Structures(case.structures.names, np.ascontiguousarray(labels))
    warp = PolyrigidWarp(distance_maps(structures, affine), structures.volume_share(), case.poses)
    points = somewhere(case, 0)
    np.testing.assert_allclose(apply(warp, points), apply(case.warp(), points), atol=1e-4)


@given(affines(), st.integers(0, 99))
@settings(max_examples=15)
def test_an_inverse_field_undoes_a_smooth_field(affine: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    centre = affine @ [6.0, 5.0, 4.0, 1.0]
    reach, push = 3 * spacing.max(), rng.normal(0, 0.2 * spacing.min(), 3)

    def bump(points: torch.Tensor) -> torch.Tensor:
        away = (points - torch.from_numpy(centre[:3]).to(points)).norm(dim=1) / reach
        return points + torch.exp(-(away**2))[:, None] * torch.from_numpy(push).to(points)

    field = displacement_field(bump, affine, SHAPE)
    assert jacobian_determinant(field).min() > 0
    inverse = invert_field(field)
    k, j, i = (axis.ravel() for axis in np.indices(SHAPE))
    points = np.stack([i, j, k], axis=1) @ affine[:3, :3].T + affine[:3, 3]
    there = points + inverse.field.sample(points)
    back = there + field.sample(there)
    np.testing.assert_allclose(back, points, atol=2e-3)
