"""A track that is continued from a frame corrected by hand, against the truth of a small knee."""

from dataclasses import replace

import numpy as np
import pytest
from json_values import assert_one_sentence
from moving_knee import NAMES, SMALL, KneeOptions, MovingKnee
from test_follow import errors, with_images

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.tracking.correction import Correction
from PolyPoseLib.data.tracking.track import Corrected, TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.rigid import about, perturbation, perturbation_between, rigid_inverse
from PolyPoseLib.tracking import backward, comparison, sweep
from PolyPoseLib.tracking.assessment import AGAINST
from PolyPoseLib.tracking.continuation import joined, tracked_on
from PolyPoseLib.tracking.contradicted import with_contradictions
from PolyPoseLib.tracking.follow import track
from PolyPoseLib.tracking.jumps import BESIDE
from PolyPoseLib.tracking.kept import Kept
from PolyPoseLib.tracking.patient import Patient

TIBIA = NAMES.index("tibia")


class Killed(Exception):
    """Raised in the place of a kill."""


def displaced(pose, centre, mm, degrees, seed=0):
    """A pose moved so far, and turned about a centre, in a direction of its own."""
    turn, shift = np.random.default_rng([seed, 41]).normal(size=(2, 3))
    turn, shift = np.radians(degrees) * turn / np.linalg.norm(turn), mm * shift / np.linalg.norm(shift)
    return about(perturbation(np.r_[turn, shift]), centre) @ pose


def gone_wrong(found, numbers, name="tibia", mm=15.0):
    """A track in which a structure is so far off in some frames, and nothing says so."""
    k = found.names.index(name)
    frames = []
    for frame in found.frames:
        if frame.frame in numbers:
            poses = frame.poses.copy()
            poses[k] = displaced(poses[k], found.centroids[k], mm, 5.0)
            frame = replace(frame, poses=poses)
        frames.append(frame)
    return replace(found, frames=tuple(frames))


def by_hand(knee, found, number, names=("tibia",), mm=5.0, degrees=4.0):
    """True poses as a hand places them."""
    return {
        name: displaced(knee.poses[number, k], found.centroids[k], mm, degrees, seed=k)
        for k, name in enumerate(found.names)
        if name in names
    }


def assert_same(frame, other, doubts=True):
    """Two frames are one, number for number."""
    for name in ("poses", "covariances", "residuals"):
        assert np.array_equal(getattr(frame, name), getattr(other, name)), name
    assert (frame.frame, frame.sources) == (other.frame, other.sources)
    assert not doubts or frame.doubts == other.doubts


def test_forward_from_a_corrected_frame_all_is_well_and_what_was_before_is_kept(
    knee, knee_sequence, knee_track
):
    wrong = gone_wrong(knee_track, range(2, 5))
    assert errors(knee, wrong)[0][2:, TIBIA].min() > 14
    correction = Correction(wrong, 2, by_hand(knee, wrong, 2), "forward")
    found = track(knee_sequence, earlier=correction)
    for n in range(2):
        assert_same(
            found.frames[n], wrong.frames[n], doubts=n < 1
        )  # what is beside new ones is compared with them
    mm, degrees = errors(knee, found)
    usual_mm, usual_degrees = errors(knee, knee_track)
    assert (mm < usual_mm + 0.2).all() and (degrees < usual_degrees + 0.5).all()
    assert found.frames[2].sources == ("forward", "corrected", "forward")
    assert not found.doubtful.any()
    assert found.corrections == (Corrected(2, ("tibia",), 2, 4),)
    assert found.inputs == knee_sequence.inputs
    # Of another bone, in the other direction: what was corrected before stays as it is.
    again = gone_wrong(found, range(1, 4), "patella", mm=9.0)
    second = Correction(again, 3, by_hand(knee, again, 3, ("patella",)), "backward", until=1)
    twice = track(knee_sequence, earlier=second)
    for n in (0, 4):
        assert_same(twice.frames[n], again.frames[n], doubts=False)
    assert twice.frames[3].sources == ("forward", "forward", "corrected")
    assert twice.frames[2].sources == ("backward", "corrected", "backward")
    assert np.array_equal(twice.frames[2].poses[TIBIA], found.frames[2].poses[TIBIA])
    assert (errors(knee, twice)[0] < usual_mm + 0.2).all()
    assert twice.corrections == (*found.corrections, Corrected(3, ("patella",), 1, 3))


@pytest.mark.long
def test_a_run_that_is_killed_at_any_step_goes_on_to_the_same_track(
    knee, knee_sequence, knee_track, monkeypatch
):
    """Every frame is looked at again, and has another pose then."""
    monkeypatch.setattr(backward, "AGREES_MM", 0.0)
    monkeypatch.setattr(comparison, "BETTER", -1.0)
    wrong = gone_wrong(knee_track, range(1, 4))
    correction = Correction(wrong, 1, by_hand(knee, wrong, 1), "both", until=2)
    for sequence, earlier, steps in (
        (replace(knee_sequence, options=replace(knee_sequence.options, last=1)), None, [0, 1, 0]),
        (knee_sequence, correction, [1, 2, 0, 1, 1]),
    ):
        kept = []
        whole = track(sequence, keep=kept.append, earlier=earlier)
        assert [each.frame for each in kept] == steps
        if earlier is None:
            assert whole.frames[0].sources == ("backward",) * 3
        left = []

        def keep(frame, left=left):
            left.append(frame)
            raise Killed

        for done in range(len(steps)):  # killed once before every step is through, and resumed each time
            with pytest.raises(Killed):
                track(sequence, done=tuple(left), keep=keep, earlier=earlier)
            assert [each.frame for each in left] == steps[: done + 1]
        resumed = track(sequence, done=left, earlier=earlier)
        for frame, other in zip(resumed.frames, whole.frames, strict=True):
            assert_same(frame, other)


def test_where_the_x_rays_lead_far_away_from_the_hand_its_pose_is_kept_and_flagged(
    knee, knee_sequence, knee_track
):
    far = {"tibia": displaced(knee.poses[2, TIBIA], knee_track.centroids[TIBIA], 35.0, 25.0)}
    found = track(knee_sequence, earlier=Correction(knee_track, 2, far, "both", until=2)).frames[2]
    assert found.poses[TIBIA] == pytest.approx(far["tibia"], abs=1e-9)
    assert found.sources[TIBIA] == "corrected"
    assert found.doubts[TIBIA], "it does not match the X-rays"
    assert np.sqrt(np.linalg.eigvalsh(found.covariances[TIBIA][3:, 3:])[0]) > 2.0
    assert np.linalg.norm(found.poses[0] - knee_track.frames[2].poses[0]) < 1.0, "others stay"


def test_a_frame_that_shows_nothing_and_a_bone_that_stands_still_cannot_be_corrected(
    knee, knee_sequence, knee_track
):
    poses = by_hand(knee, knee_track, 2)
    blank = with_images(with_images(knee_sequence, 0, f2=1.0), 1, f2=1.0)
    other = replace(knee_track, inputs=blank.inputs)
    with pytest.raises(InputError, match="No camera shows anything in frame 2") as error:
        track(blank, earlier=Correction(other, 2, poses))
    assert_one_sentence(error)
    with pytest.raises(InputError, match='"tibia" stands still') as error:
        track(replace(knee_sequence, still=("tibia",)), earlier=Correction(knee_track, 2, poses))
    assert_one_sentence(error)
    with pytest.raises(InputError, match="other images") as error:
        track(blank, earlier=Correction(knee_track, 2, poses))
    assert_one_sentence(error)


def true_frames(knee):
    """The true poses as frames that nothing speaks against."""
    return [
        TrackedFrame(n, poses, np.stack([np.eye(6) * 1e-4] * 3), np.zeros(3), ((),) * 3, ("forward",) * 3)
        for n, poses in enumerate(knee.poses)
    ]


def test_kept_frames_are_judged_anew_only_beside_new_ones(knee, knee_sequence):
    """Flags and intervals that a whole track's end adds are neither lost nor added twice."""
    patient = Patient(knee_sequence, Monitor(None, None))
    against = f'{AGAINST} the camera "camera 1"'
    jump = f"it is 9.0 {BESIDE}"
    frames = [replace(each, doubts=((), (against, jump), (jump,))) for each in true_frames(knee)]
    found = joined(patient, frames, [replace(frames[4], doubts=((), (against,), ()))])
    for n in range(3):
        assert_same(found[n], frames[n])
    assert_same(found[3], frames[3], doubts=False)
    assert found[3].doubts == ((), (against,), ()), "it lies between its neighbours now"
    assert np.trace(found[4].covariances[TIBIA]) > np.trace(frames[4].covariances[TIBIA]) + 50
    assert np.array_equal(found[4].covariances[0], frames[4].covariances[0])


def test_what_was_corrected_by_hand_stays_as_it_is_at_every_later_correction(
    knee, knee_sequence, knee_track, monkeypatch
):
    """However often frames beside it are corrected, and whatever the end of a tracking adds to it."""
    patient = Patient(knee_sequence, Monitor(None, None))
    lines = ((), (f'{AGAINST} the camera "camera 1"',), ())
    frames = list(knee_track.frames)
    for n in (2, 3):
        frames[n] = replace(frames[n], doubts=lines, sources=("forward", "corrected", "forward"))
    frames = with_contradictions(patient, frames)
    jumped = (*lines[1], f"it is 9.0 {BESIDE}")
    frames[2] = replace(frames[2], doubts=((), jumped, ()))
    earlier = replace(knee_track, frames=tuple(frames))
    seen = []

    def corrected(patient, number, past, frame):
        seen.append(frame)
        return frame

    monkeypatch.setattr(sweep, "next_frame", corrected)
    for _ in range(2):
        correction = Correction(earlier, 3, {}, "backward", until=2)
        earlier = replace(
            earlier,
            frames=tuple(joined(patient, earlier.frames, tracked_on(patient, correction, Kept(3)))),
        )
    assert np.allclose(earlier.frames[2].covariances, frames[2].covariances, rtol=1e-9)
    assert not any(line.endswith(BESIDE) for line in earlier.frames[2].doubts[TIBIA]), (
        "it lies between them now"
    )
    for frame in seen:
        assert np.allclose(frame.covariances, knee_track.frames[2].covariances, rtol=1e-6, atol=1e-9)
        assert frame.doubts == lines


def test_what_was_lost_is_bridged_to_the_new_frames(knee, knee_sequence):
    """Evenly, relative to the reference."""
    patient = Patient(knee_sequence, Monitor(None, None))
    frames = true_frames(knee)
    poses = frames[3].poses.copy()
    poses[TIBIA, :3, 3] += 50.0
    frames[3] = replace(frames[3], poses=poses, sources=("forward", "none", "forward"))
    moved = frames[4].poses.copy()
    moved[TIBIA, :3, 3] += 2.0
    found = joined(patient, frames, [replace(frames[4], poses=moved)])
    relative = [each.poses[TIBIA] @ rigid_inverse(each.poses[0]) for each in found[2:]]
    centre = knee_sequence.structures.centroids(knee_sequence.ct.affine)[TIBIA]
    half, whole = (perturbation_between(relative[0], other, centre) for other in relative[1:])
    assert half == pytest.approx(whole / 2, abs=1e-9) and np.linalg.norm(whole[3:]) > 1.0
    assert found[3].sources == frames[3].sources


@pytest.mark.long
def test_both_ways_from_a_corrected_frame_all_is_as_in_an_undisturbed_track():
    knee = MovingKnee(
        1, KneeOptions(**{**SMALL, "pixels": 140, "frames": 20, "flexion_deg": 30.0, "sway_mm": 3.0})
    )
    sequence = knee.sequence()
    undisturbed = track(sequence)
    wrong = gone_wrong(undisturbed, range(6, 20))
    usual_mm, usual_degrees = errors(knee, undisturbed)
    for direction, renewed, right in (("forward", range(6, 20), 6), ("both", range(20), 12)):
        found = track(sequence, earlier=Correction(wrong, right, by_hand(knee, wrong, right), direction))
        mm, degrees = errors(knee, found)
        assert [n for n in range(20) if n not in renewed] == [
            n
            for n in range(20)
            if found.frames[n].cpu_seconds == wrong.frames[n].cpu_seconds  # kept as they were
        ]
        assert np.sqrt((mm**2).mean()) < 1.2 * np.sqrt((usual_mm**2).mean())
        assert np.sqrt((degrees**2).mean()) < 1.2 * np.sqrt((usual_degrees**2).mean())
        assert mm.max() < usual_mm.max() + 0.2
        assert found.frames[right].sources[TIBIA] == "corrected"
        assert not found.distrust
