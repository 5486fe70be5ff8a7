"""Ribs that slipped onto their neighbours' shadows are noticed, and go back together unless the X-rays refute it."""

import numpy as np
import pytest
from chest_phantom import NUMBERS, RIBS, chest
from quiet_run import quiet_run

from PolyPoseLib.data.volume import hounsfield_to_attenuation
from PolyPoseLib.geometry.rigid import about, perturbation, rigid_inverse
from PolyPoseLib.registration.bones.rows import APART_MM, breaks, rejoined
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.simulation.independent_projector import project
from PolyPoseLib.simulation.simulate import arc_angles, view_cameras

LEVEL = Level(4.0, 28.0, 12, 0.001)
DOWN = np.array([0.0, 0.0, -17.0])
"""mm, half of the way from a rib to the next one of the phantom."""


@pytest.fixture(scope="module")
def scene():
    ct, structures, _ = chest(spacing=3.0)
    return Scene(ct, structures, "thoracic_spine")


def index(number, side="left"):
    return 1 + RIBS.index(f"rib_{side}_{number}")


def shifted(poses, which, by):
    """Poses in which bones have moved by (3,) mm more."""
    moved = poses.copy()
    for k in which:
        moved[k] = poses[k] @ perturbation(np.r_[np.zeros(3), -np.asarray(by)])
    return moved


def observed(scene, poses):
    """X-rays, by a projector that shares no code, of the phantom with its ribs under poses."""
    ct, structures, _ = chest(spacing=3.0)
    hu = np.where(structures.labels > 0, 40.0, ct.voxels).astype(np.float32)
    grid = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), -1)[..., ::-1]
    points = grid @ ct.affine[:3, :3].T + ct.affine[:3, 3]
    for k in range(len(scene.names)):
        there = np.rint(ct.to_index((points @ poses[k, :3, :3].T + poses[k, :3, 3]).reshape(-1, 3))).astype(
            int
        )
        inside = (there >= 0).all(axis=1) & (there < ct.shape[::-1]).all(axis=1)
        i, j, k_ = np.where(inside[:, None], there, 0).T
        is_bone = (inside & (structures.labels[k_, j, i] == k + 1)).reshape(ct.shape)
        hu[is_bone] = 700.0
    attenuation = ct.with_voxels(hounsfield_to_attenuation(hu).astype(np.float32))
    cameras = view_cameras(ct, arc_angles(2, 40.0), 130, detector_mm=430.0)
    return [
        Observation(image, np.ones(image.shape, bool), camera)
        for image, camera in zip(
            (project(attenuation, camera, "sum") for camera in cameras), cameras, strict=True
        )
    ]


@pytest.mark.parametrize("seed", range(5))
def test_rows_that_move_alike_are_whole(scene, seed):
    rng = np.random.default_rng(seed)
    turn = np.radians(20) * rng.normal(size=3) / 2
    common = about(perturbation(np.r_[turn, rng.normal(size=3) * 20]), scene.anchor_centre)
    poses = np.array(
        [
            about(perturbation(np.r_[rng.normal(size=3) * 0.02, rng.normal(size=3)]), centre) @ common
            for centre in scene.centres
        ]
    )
    assert breaks(scene, poses) == []


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(
    ("slipped", "edge", "across"), [((2,), 2, 4), ((8,), 8, 6), ((6, 8), 6, 4), ((2, 4), 4, 6)]
)
def test_the_shorter_side_of_a_break_has_slipped(scene, side, slipped, edge, across):
    which = tuple(index(number, side) for number in slipped)
    found = breaks(scene, shifted(scene.rest_poses, which, 1.01 * APART_MM * DOWN / 17))
    assert [set(each.slipped) for each in found if set(each.slipped) == set(which)] or len(slipped) == 2
    assert len(found) == 1 and {found[0].edge, found[0].across} == {index(edge, side), index(across, side)}
    assert found[0].apart_mm == pytest.approx(1.01 * APART_MM)
    assert breaks(scene, shifted(scene.rest_poses, which, 0.99 * APART_MM * DOWN / 17)) == []


def test_two_bones_alone_are_no_row(scene):
    """The forearm's bones cross when the hand is turned."""
    pair = {index(2), index(4)}

    class Forearm:
        names, companions = (
            scene.names,
            [link for link in scene.companions if {link.first, link.second} == pair],
        )

    assert breaks(Forearm(), shifted(scene.rest_poses, [index(2)], DOWN)) == []


@pytest.mark.parametrize("slipped", [(8,), (2, 4)])
def test_slipped_ribs_go_back_together(scene, slipped):
    true = shifted(scene.rest_poses, [index(n) for n in NUMBERS], [0.0, -2.0, 3.0])
    which = [index(number) for number in slipped]
    run = quiet_run(scene, rotation_reach_mm=40.0)
    found = rejoined(run, observed(scene, true), shifted(true, which, DOWN), LEVEL, scene.moving)
    assert breaks(scene, found) == []
    for k in which:
        centre = scene.centres[k]
        difference = (rigid_inverse(found[k]) - rigid_inverse(true[k])) @ [*centre, 1.0]
        assert np.linalg.norm(difference[:2]) < 6 and abs(difference[2]) < 3


def test_a_rib_that_the_xrays_show_far_from_its_row_stays_there(scene):
    true = shifted(scene.rest_poses, [index(8)], DOWN)
    run = quiet_run(scene, rotation_reach_mm=40.0)
    found = rejoined(run, observed(scene, true), true, LEVEL, scene.moving)
    assert len(breaks(scene, found)) == 1
    np.testing.assert_array_equal(found, true)


def test_bones_that_may_not_move_do_not(scene):
    poses = shifted(scene.rest_poses, [index(8)], DOWN)
    run = quiet_run(scene, rotation_reach_mm=40.0)
    kept = rejoined(run, observed(scene, scene.rest_poses), poses, LEVEL, [index(2)])
    np.testing.assert_array_equal(kept, poses)
