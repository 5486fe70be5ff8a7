"""One builder of a level: problems share their views, and one bone's problem is the whole one as a function of it."""

import numpy as np
import pytest
from phantom_study import case
from quiet_run import quiet_run

from PolyPoseLib.geometry.rigid import about, perturbation
from PolyPoseLib.registration.articulations import ArticulationPrior
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.problem import State
from PolyPoseLib.registration.fit.views import LevelViews, problem_of_one_bone
from PolyPoseLib.registration.fit.weighting import dilated, projection_mask
from PolyPoseLib.registration.scene import Scene

LEVEL = Level(4.0, 24.0, 10, 0.01)
FEMUR = 1


@pytest.fixture(scope="module")
def simulated():
    return case()


@pytest.fixture(scope="module")
def run(simulated):
    return quiet_run(Scene(simulated.ct, simulated.structures, simulated.anchor), rotation_reach_mm=40.0)


@pytest.fixture
def views(simulated, run):
    observations = [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(simulated.images, simulated.cameras, strict=True)
    ]
    return LevelViews(run, observations, LEVEL)


def moved_state(run, seed):
    rng = np.random.default_rng(seed)
    poses = run.scene.rest_poses
    for k in run.scene.moving:
        step = np.r_[rng.normal(0, 0.05, 3), rng.normal(0, 3, 3)]
        poses[k] = about(perturbation(step), run.scene.centres[k])
    return State.of_poses(poses, 2)


def test_problems_of_a_level_see_the_same_static_images_and_weights(run, views):
    state = moved_state(run, 0)
    bones, whole = views.structures(run.scene.moving), views.whole_ct(free_cameras=[(0,)])
    views.render_soft_tissue(state)
    views.weigh_structures(bones, state)
    for mine, others in zip(bones.views, whole.views, strict=True):
        assert mine is others and mine.static.any() and (mine.weight > 0).any()
    assert bones.size == 12 and whole.size == 6 and views.anchor().size == 0


def test_only_free_structures_have_a_prior_and_only_where_the_level_gives_it_weight(run, views):
    assert isinstance(views.structures(run.scene.moving).prior, ArticulationPrior)
    assert views.structures().prior is None
    unweighted = LevelViews(run, [], Level(4.0, 24.0, 10))
    assert unweighted.structures(run.scene.moving).prior is None


@pytest.mark.parametrize("free_cameras", [(), [(1,)], [(0, 1)]])
def test_pixels_count_around_the_bones_that_move_in_a_view(run, views, free_cameras):
    state = moved_state(run, 1)
    problem = views.structures(run.scene.moving, free_cameras)
    views.render_soft_tissue(state)
    views.weigh_structures(problem, state)
    for n, view in enumerate(views.views):
        which = range(3) if any(n in group for group in free_cameras) else run.scene.moving
        mask = projection_mask(problem, state, n, which)
        assert (view.weight[mask & (view.contrast.support > 0)] > 0).all()
        far = ~dilated(mask, 10.0 / 3.0)  # pixels at this level are no smaller than 3 mm
        assert not view.weight[far].any()


def test_leaving_a_bone_out_is_rendering_without_its_part(run, views):
    state = moved_state(run, 2)
    problem = views.structures(run.scene.moving)
    views.render_soft_tissue(state)
    for n in range(2):
        image, parts = problem.render(state, n)
        image[parts[FEMUR].slices] -= parts[FEMUR].image
        np.testing.assert_allclose(problem.render_without(FEMUR, state, n), image, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_one_bones_problem_is_the_whole_one_as_a_function_of_its_pose(run, views, seed):
    state, other = moved_state(run, seed), moved_state(run, seed + 10)
    problem = views.structures(run.scene.moving)
    views.render_soft_tissue(state)
    views.weigh_structures(problem, state)
    alone_views = [
        view.__class__(**{**view.__dict__, "static": problem.render_without(FEMUR, state, n)})
        for n, view in enumerate(views.views)
    ]
    alone = problem_of_one_bone(problem, state, FEMUR, alone_views, balanced=True)
    pose = other.poses[FEMUR]
    whole = problem.cost(state.with_pose(FEMUR, pose)) - problem.cost(state)
    part = alone.cost(State.of_poses(pose[None], 2)) - alone.cost(State.of_poses(state.poses[FEMUR][None], 2))
    assert part == pytest.approx(whole, rel=1e-3)


def test_a_bone_that_no_view_shows_has_no_problem(run, views):
    problem = views.structures(run.scene.moving)
    for view in views.views:
        view.weight = np.zeros_like(view.weight)
    assert problem_of_one_bone(problem, moved_state(run, 0), FEMUR, views.views) is None
