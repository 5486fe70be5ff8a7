"""Bones that were united in one structure are looked for one by one: those that moved against the others are named."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from phantom_study import NAMES, case
from quiet_run import quiet_run

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.pipeline import register
from PolyPoseLib.registration.bones.agreement import APART_MM, Agreement, PartAgreement
from PolyPoseLib.registration.bones.parts import LEAST_SHARE, agreement_by_parts, large_parts
from PolyPoseLib.registration.fit.levels import Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.simulation.case_study import case_to_study

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

    def agreement(self, structures: Structures, poses: list[np.ndarray], source: Volume | None) -> Agreement:
        """Of structures at poses."""
        run = quiet_run(Scene(self.case.ct, structures, "pelvis"), rotation_reach_mm=40.0)
        return agreement_by_parts(run, self.observations, np.stack(poses), source)

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


@pytest.mark.parametrize("seed", SEEDS)
def test_bones_at_their_places_are_not_off(known, seed):
    """Halves of every bone, each with a label of its own."""
    this = known[seed]
    halves = this.source.voxels + 3 * (np.arange(this.source.shape[1]) % 40 < 20)[:, None].astype(np.int16)
    split = Volume(np.where(this.source.voxels > 0, halves, 0), this.source.affine)
    poses = [this.case.fixed_to_moving[name] for name in NAMES]
    agreement = this.agreement(this.case.structures, poses, split)
    assert any(len(parts) > 1 for parts in agreement.parts.values())
    for k in range(len(NAMES)):
        assert agreement.parts_off(k) == []


@pytest.mark.parametrize("seed", [0, 3])
def test_a_registration_says_which_structure_unites_bones_that_moved_apart(known, seed):
    result = register(known[seed].study({"preset": "fast"}))
    (warning,) = (line for line in result.warnings if "seems to unite" in line)
    assert '"united"' in warning and "label 2 " in warning and "a structure of its own" in warning
    united = result.structures["united"]
    assert any("label 2 " in line for line in united.doubts)
    assert known[seed].apart_mm(FEMUR, united.fixed_to_moving) > APART_MM


def test_a_registration_of_single_bones_says_nothing_of_parts(known):
    result = register(case_to_study(known[0].case, {"preset": "fast"}, camera="known"))
    assert not any("unite" in line for line in result.warnings)


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
    assert covered.any()


CLEAR, UNCLEAR, UNSEEN = np.array([0.2, 0.8]), np.array([0.2, 0.3]), np.full(2, np.nan)


@pytest.mark.parametrize(
    ("support", "refitted", "shift_mm", "off"),
    [
        (CLEAR, CLEAR, 1.0, False),
        (CLEAR, CLEAR, 5.0, True),
        (CLEAR, UNCLEAR, 5.0, False),
        (UNCLEAR, UNCLEAR, 1.0, True),
        (UNSEEN, UNSEEN, 5.0, False),
    ],
)
def test_a_part_is_off_where_x_rays_show_it_elsewhere_or_not_where_it_should_be(
    support, refitted, shift_mm, off
):
    assert PartAgreement(1, support, refitted, shift_mm).is_off == off


def test_a_structure_all_of_whose_bones_are_off_is_off_itself():
    parts = {0: [PartAgreement(n, UNCLEAR, UNCLEAR, 0.0) for n in (1, 2)]}
    assert Agreement.parts_off(SimpleNamespace(parts=parts), 0) == []
