"""The subcommand track with the tracker itself: a track of three frames, and one that goes on from a correction."""

import json
import shutil

import numpy as np
import pytest
from knee_files import write_knee
from moving_knee import SMALL, KneeOptions, MovingKnee

from PolyPoseLib.__main__ import main
from PolyPoseLib.data.tracking.track import Corrected
from PolyPoseLib.geometry.rigid import perturbation_between
from PolyPoseLib.io.tracking.corrected_poses import write_corrected_poses
from PolyPoseLib.io.tracking.tracks import load_track


@pytest.fixture(scope="module")
def knee():
    return MovingKnee(1, KneeOptions(**{**SMALL, "frames": 3, "pixels": 90}))


@pytest.fixture(scope="module")
def folder(knee, tmp_path_factory):
    """The knee's files, a track of them, and a pose by hand."""
    folder = tmp_path_factory.mktemp("knee")
    path = write_knee(folder / "walk", knee, options={"threads": 1})
    assert main(["track", str(path), "--output", str(folder / "one"), "--progress", "none"]) == 0
    rough = knee.poses[1, 1].copy()
    rough[:3, 3] += (2.0, -2.0, 1.0)
    write_corrected_poses(folder / "poses.json", {"tibia": rough})
    return folder


def run(capsys, folder, output, *flags):
    """Exit status, stdout and stderr of a continued track."""
    capsys.readouterr()
    sequence = folder / "walk" / "TRACK.json"
    status = main(["track", str(sequence), "--output", str(output), "--progress", "none", *map(str, flags)])
    return status, *capsys.readouterr()


def millimetres(knee, track):
    """(F, K) how far centroids are off."""
    return np.array(
        [
            [
                np.linalg.norm(perturbation_between(pose, true, centre)[3:])
                for pose, true, centre in zip(
                    frame.poses, knee.poses[frame.frame], track.centroids, strict=True
                )
            ]
            for frame in track.frames
        ]
    )


def test_the_tracker_follows_bones_from_files_to_a_folder(knee, folder):
    track = load_track(folder / "one")
    assert track.numbers.tolist() == [0, 1, 2] and not track.distrust and not track.corrections
    assert millimetres(knee, track).max() < 2.0
    assert track.inputs is not None and set(track.inputs.images) == {"camera 1", "camera 2"}
    listed = json.loads((folder / "one" / "track.json").read_text())["files"]
    assert {"poses.csv", "femur.tra", "joints.csv"} <= set(listed)


def test_a_track_goes_on_from_a_correction_with_the_same_command(knee, folder, tmp_path, capsys):
    flags = [
        "--continue",
        folder / "one",
        "--at",
        1,
        "--poses",
        folder / "poses.json",
        "--direction",
        "forward",
    ]
    status, out, _ = run(capsys, folder, tmp_path / "two", *flags)
    assert status == 0 and "3 frames" in out
    earlier, track = load_track(folder / "one"), load_track(tmp_path / "two")
    assert np.array_equal(track.frames[0].poses, earlier.frames[0].poses)
    assert np.array_equal(track.frames[0].covariances, earlier.frames[0].covariances)
    assert track.frames[1].sources == ("forward", "corrected", "forward")
    assert millimetres(knee, track).max() < 2.0
    assert track.corrections == (Corrected(1, ("tibia",), 1, 2),)
    rows = (tmp_path / "two" / "poses.csv").read_text().splitlines()
    assert sum(",corrected," in row for row in rows) == 1
    # Into its own folder only when that is asked for, and whole.
    copy = tmp_path / "one"
    shutil.copytree(folder / "one", copy)
    own = ["--continue", copy, "--at", 2, "--until", 2]
    status, _, err = run(capsys, folder, copy, *own)
    assert status == 2 and "--overwrite" in err
    assert run(capsys, folder, copy, *own, "--overwrite")[0] == 0
    assert load_track(copy).corrections == (Corrected(2, (), 2, 2),)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["one", "two"]


@pytest.mark.parametrize(
    ("flags", "says"),
    [
        (["--at", 1], "--at needs --continue"),
        (["--poses", "x.json"], "--poses needs --continue"),
        (["--until", 0], "--until needs --continue"),
        (["--direction", "both"], "--direction needs --continue"),
        (["--continue", "one"], "--continue needs --at"),
        (["--continue", "one", "--at", 1, "--first", 1], "--first and --continue exclude each other"),
        (["--continue", "one", "--at", 7], "7, is none of the track's: give one from 0 to 2"),
        (["--continue", "one", "--at", 1, "--until", 0, "--direction", "forward"], "lies before frame 1"),
        (["--continue", "walk", "--at", 1], "track.json"),
        (["--continue", "one", "--at", 1, "--poses", "walk/TRACK.json"], 'field "ct"'),
    ],
)
def test_flags_that_do_not_fit_are_one_sentence(folder, tmp_path, capsys, flags, says, monkeypatch):
    monkeypatch.chdir(folder)
    status, out, err = run(capsys, folder, tmp_path / "out", *flags)
    assert status == 2 and not out and says in err and len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_the_track_of_another_sequence_is_refused(folder, tmp_path, capsys):
    shutil.copytree(folder / "walk", tmp_path / "walk")
    path = tmp_path / "walk" / "TRACK.json"
    fields = json.loads(path.read_text())
    path.write_text(json.dumps({**fields, "frames_per_second": 29}))
    status, _, err = run(capsys, tmp_path, tmp_path / "out", "--continue", folder / "one", "--at", 1)
    assert status == 2 and "The earlier track is of another sequence, its frames per second are 30" in err
    assert sorted(each.name for each in tmp_path.iterdir()) == ["walk"]
