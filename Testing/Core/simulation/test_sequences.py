"""Simulated sequences: the truth is what the images show, in any world of the rig, whenever an image is read."""

import numpy as np
import pytest
from knee_case import knee, knee_cameras, knee_sequence
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.sequence import Sequence
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.errors import InputError
from PolyPoseLib.simulation.moving_degradations import NAMES
from PolyPoseLib.simulation.sequence_options import LIMITS, SequenceOptions
from PolyPoseLib.simulation.sequence_truth import truth_of_sequence
from PolyPoseLib.simulation.sequences import simulate_sequence
from PolyPoseLib.simulation.xray_physics import XrayPhysics

CLEAN = XrayPhysics(photons=1e12, scatter_to_primary=0, blur_px=0, saturation=0, bits=0)


def drawn_world(seed):
    rng = np.random.default_rng(seed)
    world = np.eye(4)
    world[:3, :3] = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    world[:3, 3] = rng.uniform(-400, 400, 3)
    return world


def images(sequence, view=0):
    frames = sequence.views[view].images
    return np.stack([frames.read(n)[0] for n in range(frames.count)])


def test_the_same_arguments_give_the_same_images_in_any_order():
    first, second = knee_sequence(seed=4), knee_sequence(seed=4)
    forth = [first.views[v].images.read(n)[0] for n in range(3) for v in range(2)]
    back = [second.views[v].images.read(n)[0] for n in reversed(range(3)) for v in reversed(range(2))]
    assert np.array_equal(forth, back[::-1])
    assert not np.array_equal(forth[0], knee_sequence(seed=5).views[0].images.read(0)[0])
    assert not np.array_equal(forth[0], forth[1])


@pytest.mark.parametrize("seed", range(2))
def test_another_world_of_the_rig_changes_poses_but_no_image(seed):
    world = drawn_world(seed)
    here, there = knee_sequence(physics=CLEAN), knee_sequence(physics=CLEAN, world=world)
    assert np.allclose(there.poses, here.poses @ world, atol=1e-9)
    assert np.allclose(images(here), images(there), atol=1e-4)
    assert not np.allclose(here.views[0].camera.extrinsic, there.views[0].camera.extrinsic, atol=1)


def test_poses_of_a_table_make_the_sequence_that_they_came_from():
    world = drawn_world(3)
    first = knee_sequence(physics=CLEAN, world=world)
    again = knee_sequence(physics=CLEAN, world=world, poses=first.poses)
    assert np.allclose(again.poses, first.poses, atol=1e-9)
    assert np.allclose(images(first), images(again), atol=1e-5)


def test_the_whole_patient_sways_unless_it_is_kept_still():
    still = knee_sequence(sway_mm=0, sway_deg=0).poses[:, 0]
    assert np.allclose(still, np.eye(4), atol=1e-12)
    sway = knee_sequence(sway_mm=2, sway_deg=1).poses[:, 0]
    turns = np.degrees(Rotation.from_matrix(sway[:, :3, :3]).magnitude())
    assert 0.2 < turns.max() <= 1.0 * np.sqrt(3)
    centre = knee().structures.centroids(knee().ct.affine)[0]
    places = np.linalg.inv(sway)[:, :3, :3] @ centre + np.linalg.inv(sway)[:, :3, 3] - centre
    assert 0.2 < np.abs(places).max() <= 2.0 + 1e-9


def test_initial_poses_are_off_by_what_was_asked_for():
    sequence = knee_sequence(initial_error=(2.0, 3.0))
    centres = knee().structures.centroids(knee().ct.affine)
    for true, centre, name in zip(sequence.poses[0], centres, sequence.structures.names, strict=True):
        error = sequence.initial_poses[name] @ np.linalg.inv(true)
        assert np.degrees(Rotation.from_matrix(error[:3, :3]).magnitude()) == pytest.approx(2.0)
        assert np.linalg.norm(error[:3, :3] @ centre + error[:3, 3] - centre) == pytest.approx(3.0)


def test_blank_and_repeated_images_and_a_camera_that_started_earlier():
    sequence = knee_sequence(first=(0, 3), blank={0: (4,)}, repeated={1: (5, 6)})
    plain = knee_sequence(first=(0, 3))
    assert [view.images.count for view in sequence.views] == [5, 8] and sequence.views[1].first == 3
    one, usual = images(sequence), images(plain)
    differ = [n for n in range(5) if not np.array_equal(one[n], usual[n])]
    assert differ == [4] and one[4].min() > usual.max() and one[4].std() > 0
    two, usual = (each.views[1].images for each in (sequence, plain))
    assert all(np.array_equal(two.read(n)[0], usual.read(4)[0]) for n in (4, 5, 6))
    assert np.array_equal(two.read(7)[0], usual.read(7)[0])
    assert truth_of_sequence(sequence).unseen == {"view 1": (4,), "view 2": (2, 3)}


def test_a_camera_that_started_earlier_shows_the_same_frames():
    early, plain = knee_sequence(physics=CLEAN, first=(0, 3)), knee_sequence(physics=CLEAN)
    assert np.allclose(images(early, 1)[3:], images(plain, 1), atol=1e-4)


def test_a_camera_out_of_step_shows_a_later_moment():
    late, plain = knee_sequence(physics=CLEAN, skew_s=(0, 1 / 30)), knee_sequence(physics=CLEAN)
    assert np.allclose(images(late, 0), images(plain, 0), atol=1e-4)
    assert np.allclose(images(late, 1)[:4], images(plain, 1)[1:], atol=1e-4)


def test_an_open_shutter_blurs_what_moves_and_nothing_else():
    sharp, blurred = (knee_sequence(physics=CLEAN, shutter=s, pixels=80) for s in (0.0, 1.0))

    def detail(image):
        return float(np.abs(image - gaussian_filter(image, 2)).mean())

    moving = 1  # a flexion turns back at its first frame
    pair = [each.views[1].images.read(moving)[0] for each in (sharp, blurred)]
    assert detail(pair[1]) < 0.99 * detail(pair[0])
    frozen = {"motion": "still", "sway_mm": 0, "sway_deg": 0, "physics": CLEAN}
    assert np.allclose(
        images(knee_sequence(**frozen)), images(knee_sequence(shutter=1.0, **frozen)), atol=1e-5
    )


@pytest.mark.parametrize("name", NAMES)
def test_every_degradation_changes_all_frames(name):
    settings = {"pixels": 64, "frames": 3, "physics": XrayPhysics(photons=1e7, scatter_to_primary=0)}
    plain = images(knee_sequence(**settings))
    degraded = images(knee_sequence(degradations=(name,), **settings))
    changed = np.abs(degraded - plain) > 0.1
    assert (changed.sum(axis=(1, 2)) > 5).all()
    again = knee_sequence(degradations=(name,), **settings)
    assert np.array_equal(degraded[2], again.views[0].images.read(2)[0])


def test_leaves_stand_still_and_screws_move_with_their_bone():
    frozen = {"physics": CLEAN, "pixels": 80}
    plain, screws, rails = (
        knee_sequence(degradations=names, **frozen).views[1].images
        for names in ((), ("bone_screws",), ("table_rails",))
    )
    columns = np.arange(80)

    def middle(images, frame):
        metal = images.read(frame)[0] - plain.read(frame)[0]
        shown = np.where(metal > 0.3, metal, 0)
        return (shown.sum(0) @ columns) / shown.sum()

    assert abs(middle(rails, 0) - middle(rails, 2)) < 0.5
    assert abs(middle(screws, 0) - middle(screws, 2)) > 3


def test_a_ct_that_ends_within_the_field_leaves_images_and_places():
    whole = knee_sequence(frames=2)
    cut = whole.cut(60.0)
    assert cut.ct.shape[0] < whole.ct.shape[0] and cut.structures.labels.shape == cut.ct.shape
    assert np.array_equal(cut.views[0].images.read(1)[0], whole.views[0].images.read(1)[0])
    points = cut.ct.to_world(np.argwhere(cut.structures.labels == 2)[:, ::-1])
    labels = whole.ct.with_voxels(whole.structures.labels)
    assert (labels.voxels_at(labels.to_index(points), 0) == 2).all()
    assert np.ptp(points[:, 2]) <= 60 and cut.tracked().frame_count == 2
    with pytest.raises(InputError, match="no voxel"):
        whole.cut(1.0)


def test_what_tracking_takes_is_valid():
    sequence = knee_sequence(world=drawn_world(1))
    given = sequence.tracked(TrackOptions(last=2), still=("femur",))
    assert isinstance(given, Sequence) and given.frame_count == 3 and given.still == ("femur",)
    image, mask = given.views[0].images.read(2)
    assert image.dtype == np.float32 and mask.all() and given.views[0].images.read(2)[0] is image


@pytest.mark.parametrize("name", LIMITS)
def test_options_have_ends(name):
    least, largest = LIMITS[name]
    for value in (least, largest):
        assert getattr(SequenceOptions(**{name: value}), name) == value
    for value in (least - 1, largest * 1.01 + 1, float("nan")):
        with pytest.raises(InputError, match=f"The simulation's {name} is .*: give a"):
            SequenceOptions(**{name: value})


def test_what_does_not_fit_together_is_refused():
    with pytest.raises(InputError, match="degradation of a sequence"):
        SequenceOptions(degradations=("prosthesis",))
    with pytest.raises(InputError, match="given twice"):
        SequenceOptions(degradations=("table_rails", "table_rails"))
    with pytest.raises(InputError, match="4 x 4"):
        knee_sequence(poses=np.tile(np.eye(4), (4, 3, 1, 1)))
    with pytest.raises(InputError, match="A pose"):
        knee_sequence(poses=np.zeros((5, 3, 4, 4)))
    with pytest.raises(InputError, match="no structure"):
        simulate_sequence(knee().ct, knee().structures, knee_cameras(), reference="skull")
    with pytest.raises(InputError, match="no image 5"):
        knee_sequence().views[0].images.read(5)
