"""Bones that were united in one structure are looked for one by one: those that moved against the others are named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from phantom_study import NAMES, case
from quiet_run import quiet_run
from scipy.ndimage import binary_dilation, label

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.bones.agreement import APART_MM, Agreement, PartAgreement
from PolyPoseLib.registration.bones.parts import LEAST_SHARE, agreement_by_parts, is_cut_short, large_parts
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.simulation.case_study import case_to_study
from PolyPoseLib.warp.parts import connected_parts

UNITED = 1
FEMUR, VERTEBRA = 2, 3
"""Labels of the phantom's segmentation."""

SEEDS = range(6)


class Known:
    """The phantom's X-rays with their true cameras."""

    def __init__(self, seed: int):
        self.case = case(seed, scale=1.0)
        self.source = Volume(self.case.structures.labels, self.case.ct.affine)
        self.united = Structures(("pelvis", "united"), np.minimum(self.source.voxels, UNITED + 1))
        self.observations = [
            Observation(image, np.ones(image.shape, bool), camera)
            for image, camera in zip(self.case.images, self.case.cameras, strict=True)
        ]

    def agreement(self, structures, poses, source, observations=None) -> Agreement:
        """Of structures at poses."""
        run = quiet_run(Scene(self.case.ct, structures, "pelvis"), rotation_reach_mm=40.0)
        return agreement_by_parts(run, observations or self.observations, np.stack(poses), source)

    @property
    def true_poses(self) -> list[np.ndarray]:
        """Of the single bones."""
        return [self.case.fixed_to_moving[name] for name in NAMES]

    @property
    def halves(self) -> Volume:
        """A label map in which both halves of every bone have a label of their own."""
        labels = self.source.voxels
        half = np.zeros_like(labels)
        for number in (1, 2, 3):
            bone = labels == number
            half[: int(np.median(np.nonzero(bone)[0]))] |= bone[: int(np.median(np.nonzero(bone)[0]))]
        return Volume(labels + 3 * half, self.source.affine)

    def study(self, options: dict):
        """In which the femur and the vertebra are one structure."""
        whole = case_to_study(self.case, options, camera="known")
        return replace(whole, structures=self.united, source_segmentation=self.source)

    def apart_mm(self, label: int, pose: np.ndarray) -> float:
        """How far from its true place a pose (4, 4) puts a bone, the mean over its voxels."""
        index = np.argwhere(self.source.voxels == label)[:, ::-1]
        points = np.c_[index, np.ones(len(index))] @ self.source.affine.T
        true = self.case.fixed_to_moving[NAMES[label - 1]]
        moved = points @ (np.linalg.inv(pose) - np.linalg.inv(true)).T
        return float(np.linalg.norm(moved[:, :3], axis=1).mean())


@pytest.fixture(scope="module")
def known() -> dict[int, Known]:
    return {seed: Known(seed) for seed in SEEDS}


@pytest.mark.parametrize("segmented", [True, False])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_bone_that_moved_otherwise_is_off_by_as_much_as_it_did(known, seed, segmented):
    """Where the structure moved like its vertebra, and the femur did not; bones that do not touch need no label."""
    this = known[seed]
    pose = this.case.fixed_to_moving[NAMES[VERTEBRA - 1]]
    agreement = this.agreement(this.united, [np.eye(4), pose], this.source if segmented else None)
    (off,) = agreement.parts_off(UNITED)
    assert off.label == (FEMUR if segmented else None)
    moved = this.apart_mm(FEMUR, pose)
    assert moved > APART_MM
    if off.shows_elsewhere:
        assert 0.5 * moved < off.shift_mm < 1.2 * moved


def nothing_off(agreement: Agreement) -> bool:
    """Whether every bone is where its structure's pose puts it, and halves were compared at all."""
    assert all(len(agreement.parts[k]) == 2 for k in range(len(NAMES)))
    return not any(agreement.parts_off(k) for k in range(len(NAMES)))


@pytest.mark.parametrize(("views", "noise"), [(1, 0.0), (1, 0.05), (2, 0.0), (2, 0.05), (2, 0.1)])
@pytest.mark.parametrize("seed", SEEDS)
def test_halves_of_bones_at_their_places_are_not_off(known, seed, noise, views):
    """Noise: standard deviation of the line integral in a pixel."""
    this, rng = known[seed], np.random.default_rng(seed)
    noisy = [
        replace(each, image=(each.image + noise * rng.normal(size=each.image.shape)).astype(np.float32))
        for each in this.observations[:views]
    ]
    assert nothing_off(this.agreement(this.case.structures, this.true_poses, this.halves, noisy))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("number", [4, 5, 6])
def test_half_a_bone_that_one_x_ray_alone_shows_is_not_off_along_its_beam(known, seed, number):
    this = known[seed]
    first, second = this.observations
    index = np.argwhere(this.halves.voxels == number)[:, ::-1]
    points = np.c_[index, np.ones(len(index))] @ this.source.affine.T
    fixed = points @ np.linalg.inv(this.true_poses[number - 4]).T
    column, row = np.rint(second.camera.project(fixed[:, :3])).astype(int).T
    shows = np.zeros(second.mask.shape, bool)
    inside = (row >= 0) & (row < shows.shape[0]) & (column >= 0) & (column < shows.shape[1])
    shows[row[inside], column[inside]] = True
    hidden = replace(second, mask=second.mask & ~binary_dilation(shows, iterations=4))
    assert nothing_off(this.agreement(this.case.structures, this.true_poses, this.halves, [first, hidden]))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_order_of_the_x_rays_does_not_matter(known, seed):
    this = known[seed]
    poses = [np.eye(4), this.case.fixed_to_moving[NAMES[VERTEBRA - 1]]]
    one, other = (
        this.agreement(this.united, poses, this.source, order)
        for order in (this.observations, this.observations[::-1])
    )
    for a, b in zip(one.parts[UNITED], other.parts[UNITED], strict=True):
        assert a.is_off == b.is_off
        np.testing.assert_allclose(a.shifts_mm, b.shifts_mm[::-1], atol=0.2)


@pytest.mark.parametrize("seed", [0, 1])
def test_voxels_without_a_label_belong_to_the_nearest(known, seed):
    """As where a structure grew beyond its labels."""
    this, rng = known[seed], np.random.default_rng(seed)
    holes = np.where(rng.random(this.source.voxels.shape) < 0.3, 0, this.source.voxels)
    pose = this.case.fixed_to_moving[NAMES[VERTEBRA - 1]]
    whole, holed = (
        this.agreement(this.united, [np.eye(4), pose], Volume(labels, this.source.affine)).parts[UNITED]
        for labels in (this.source.voxels, holes.astype(np.int16))
    )
    assert [part.label for part in whole] == [part.label for part in holed]
    for a, b in zip(whole, holed, strict=True):
        np.testing.assert_allclose(a.support, b.support, atol=0.02)


@pytest.mark.parametrize(("axis", "at"), [(0, "start"), (0, "stop"), (1, "start"), (2, "stop")])
def test_what_is_left_of_a_bone_at_the_end_of_a_ct_is_not_compared(axis, at):
    """The rest of a vertebra fits its neighbour's place as well."""
    labels = np.zeros((60, 60, 60), np.int16)
    for number, length in ((1, 20), (2, 7)):  # of voxels of 3 mm
        along = slice(0, length) if at == "start" else slice(60 - length, 60)
        box = [slice(20 * number - 15, 20 * number)] * 3
        box[axis] = along
        labels[tuple(box)] = number
    inside = np.zeros_like(labels)
    inside[25:32, 25:32, 25:32] = 1
    affine = np.diag([3.0, 3.0, 3.0, 1.0])
    ct = Volume(np.where(labels + inside > 0, 700.0, 20.0).astype(np.float32), affine)
    scene = Scene(ct, Structures(("united",), np.minimum(labels, 1) | inside), "united")
    source = np.where(inside > 0, 3, labels)
    cut = {part.label: is_cut_short(scene, 0, part) for part in connected_parts(source[scene.box(0)], 0)}
    assert cut == {1: False, 2: True, 3: False}


@pytest.mark.parametrize("seed", [0, 3])
def test_a_registration_says_which_structure_unites_bones_that_moved_apart(known, seed):
    result = register(known[seed].study({"preset": "fast"}))
    (warning,) = (line for line in result.warnings if "seems to unite" in line)
    assert '"united"' in warning and "label 2 " in warning and "a structure of its own" in warning
    united = result.structures["united"]
    assert any("label 2 " in line for line in united.doubts)
    assert known[seed].apart_mm(FEMUR, united.fixed_to_moving) > APART_MM


def test_a_registration_of_single_bones_says_nothing_of_their_halves(known):
    whole = case_to_study(known[0].case, {"preset": "fast"}, camera="known")
    result = register(replace(whole, source_segmentation=known[0].halves))
    assert not any("unite" in line for line in result.warnings)


def test_what_is_said_of_united_bones_widens_the_interval_and_moves_nothing(known, monkeypatch):
    said = register(known[0].study({"preset": "fast"}))
    monkeypatch.setattr(Agreement, "parts_off", lambda *_: [])
    unsaid = register(known[0].study({"preset": "fast"}))
    here, there = (each.structures["united"] for each in (said, unsaid))
    np.testing.assert_array_equal(here.fixed_to_moving, there.fixed_to_moving)
    assert here.uncertainty["along_mm"] > 2 * there.uncertainty["along_mm"]


@given(st.integers(0, 10_000))
def test_large_parts_are_of_one_label_in_one_piece_and_large(seed):
    rng = np.random.default_rng(seed)
    labels = np.zeros((12, 10, 9), np.int32)
    for number in range(1, rng.integers(2, 5)):
        corner = rng.integers(0, 8, 3)
        labels[tuple(slice(at, at + rng.integers(1, 6)) for at in corner)] = number
    covered = np.zeros(labels.shape, int)
    for part in large_parts(labels):
        assert (labels[part.box][part.mask] == part.label).all()
        assert part.mask.sum() >= LEAST_SHARE * np.count_nonzero(labels)
        covered[part.box] += part.mask
    assert covered.max() <= 1
    sizes = [
        np.bincount(label(labels == number, np.ones((3, 3, 3)))[0].ravel())[1:]
        for number in np.unique(labels)[1:]
    ]
    large = np.concatenate(sizes)
    large = large[large >= LEAST_SHARE * np.count_nonzero(labels)]
    assert covered.sum() == large.sum()


CLEAR, UNCLEAR, BETTER, UNSEEN = ([0.2, 0.8], [0.2, 0.3], [0.4, 0.4], [np.nan, np.nan])


@pytest.mark.parametrize(
    ("support", "refitted", "shifts_mm", "off"),
    [
        (CLEAR, CLEAR, [0.5, 1.0], False),
        (UNCLEAR, CLEAR, [0.5, 5.0], True),
        ([0.7, 0.5], [0.7, 0.7], [0.5, 5.0], True),
        (
            [0.2, 0.7],
            [0.7, 0.7],
            [1.0, 5.0],
            False,
        ),  # it fits better in one X-ray, and has moved in the other
        (CLEAR, CLEAR, [0.5, 5.0], False),  # nothing is gained
        (CLEAR, [0.4, 0.8], [5.0, 1.0], False),  # better, but it is clear where it is
        (UNCLEAR, BETTER, [5.0, 1.0], True),
        (UNCLEAR, BETTER, [1.0, 1.0], False),
        (UNCLEAR, [0.26, 0.36], [5.0, 5.0], False),  # half a vertebra at the end of a CT
        (UNCLEAR, UNCLEAR, [5.0, 5.0], False),
        ([0.7, np.nan], [0.7, 0.9], [1.0, 9.0], False),
        ([0.7, 0.2], [0.7, 0.9], [1.0, np.nan], False),
        (UNSEEN, UNSEEN, [5.0, 5.0], False),
    ],
)
def test_a_part_is_off_where_it_fits_better_elsewhere(support, refitted, shifts_mm, off):
    part = PartAgreement(1, np.array(support), np.array(refitted), np.array(shifts_mm))
    assert part.is_off == off
    assert not (part.is_off and part.is_right)


@pytest.mark.parametrize(
    ("other", "whole", "named"),
    [
        (CLEAR, False, 1),
        (UNCLEAR, False, 0),
        (UNSEEN, False, 0),
        (UNCLEAR, True, 1),  # its smaller bones, which nobody compares, are where they should be
        (None, True, 1),
        (None, False, 0),
    ],
)
def test_a_bone_is_off_only_where_its_structure_or_another_one_of_it_is_not(other, whole, named):
    parts = [PartAgreement(1, np.array(UNCLEAR), np.array(CLEAR), np.array([5.0, 5.0]))]
    if other is not None:
        parts.append(PartAgreement(2, np.array(other), np.array(other), np.zeros(2)))
    agreement = SimpleNamespace(parts={0: parts}, is_clear=np.array([whole]))
    assert len(Agreement.parts_off(agreement, 0)) == named


@pytest.mark.parametrize("slabs", [1, 16])
@pytest.mark.parametrize("seed", [0, 3])
def test_a_bone_that_moved_against_many_small_ones_is_off(known, seed, slabs):
    """Slabs of the vertebra, each with a label of its own, are too small to be compared."""
    this = known[seed]
    labels = this.source.voxels.astype(np.int32)
    heights = np.nonzero(labels == VERTEBRA)[0]
    small = (np.arange(len(labels)) - heights.min()) * slabs // (np.ptp(heights) + 1)
    source = np.where(labels == VERTEBRA, 10 + small[:, None, None], labels)
    pose = this.case.fixed_to_moving[NAMES[VERTEBRA - 1]]
    agreement = this.agreement(this.united, [np.eye(4), pose], Volume(source, this.source.affine))
    assert len(agreement.parts[UNITED]) == (1 if slabs > 1 else 2)
    assert [part.label for part in agreement.parts_off(UNITED)] == [FEMUR]
