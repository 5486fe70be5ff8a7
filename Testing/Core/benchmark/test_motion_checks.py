"""Answers that cannot be scored fairly are refused before they are."""

import dataclasses

import numpy as np
import pytest
from tiny_case import tiny_case

from PolyPoseLib.benchmark.motion_checks import require_motion
from PolyPoseLib.benchmark.own_systems import Rest
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.grid import covering_grid
from PolyPoseLib.simulation.case_study import case_to_study


@pytest.fixture(scope="module")
def study():
    return case_to_study(tiny_case(), camera="known")


def field(study, spacing, margin=0.0, turned=False):
    affine, shape = covering_grid(study.ct.affine, study.ct.shape, spacing, margin, keep_coarser=False)
    if turned:  # the same nodes, counted from the other end of the first axis
        affine = affine.copy()
        affine[:3, 3] += (shape[2] - 1) * affine[:3, 0]
        affine[:3, 0] *= -1
    return DisplacementField(np.zeros((*shape, 3)), affine)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("spacing", "margin"), [(4.0, 0.0), (3.0, 20.0), (2.5, 0.0)])
def test_every_grid_that_is_fine_enough_and_covers_the_ct_will_do(study, spacing, margin, turned):
    require_motion(Motion(field(study, spacing, margin, turned)), study)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_field_that_leaves_out_an_end_of_the_ct_is_refused(study, axis, side):
    whole = field(study, 4.0)
    affine = whole.affine.copy()
    affine[:3, 3] += side * 12 * affine[:3, axis] / np.linalg.norm(affine[:3, axis])
    with pytest.raises(InputError, match=r"ends \d+\.\d mm before the CT's outermost voxels"):
        require_motion(Motion(DisplacementField(whole.vectors, affine)), study)


def test_a_coarser_grid_is_refused(study):
    with pytest.raises(InputError, match=r"nodes 4\.50 mm apart, more than 4 mm"):
        require_motion(Motion(field(study, 4.5)), study)


@pytest.mark.parametrize(
    ("poses", "said"),
    [
        ({"skull": np.eye(4)}, '"skull", which is no structure'),
        ({"pelvis": np.diag([2.0, 1, 1, 1])}, 'pose of "pelvis"'),
        ({"pelvis": np.diag([-1.0, 1, 1, 1])}, 'pose of "pelvis"'),
        ({"pelvis": np.full((4, 4), np.nan)}, 'pose of "pelvis"'),
    ],
)
def test_poses_are_rigid_and_of_the_studys_structures(study, poses, said):
    motion = dataclasses.replace(Rest().fit(study, SystemSetting()), poses=poses)
    with pytest.raises(InputError) as refused:
        require_motion(motion, study)
    assert said in str(refused.value)


@pytest.mark.parametrize("answer", [None, np.zeros((3, 3, 3, 3)), {"field": 1}])
def test_anything_else_is_no_answer(study, answer):
    with pytest.raises(InputError, match="not a Motion"):
        require_motion(answer, study)
    with pytest.raises(InputError, match="not a Motion"):
        require_motion(Motion(answer), study)
