"""simulate --frames: a folder that can be tracked, or one sentence before any work."""

import json

import numpy as np
import pytest
from knee_case import knee
from scipy.spatial.transform import Rotation

from PolyPoseLib.__main__ import main
from PolyPoseLib.io.tracking.track_truths import load_track_truth
from PolyPoseLib.io.volumes import write_volume


@pytest.fixture
def coarse(monkeypatch):
    """Knees of large voxels, and the projector that needs no import of many seconds."""
    monkeypatch.setattr("PolyPoseLib.simulation.joint_phantom.joint_phantom", lambda seed, **_: knee(seed))
    monkeypatch.setattr("PolyPoseLib.simulation.independent_projector.rtk_available", lambda: False)


def simulate(output, *more):
    return main(["simulate", "--output", str(output), "--pixels", "64", *map(str, more)])


@pytest.fixture
def files(tmp_path):
    """The knee as a CT with labels and structures."""
    write_volume(knee().ct.with_voxels(knee().ct.voxels.astype(np.int16)), tmp_path / "ct.nii.gz")
    write_volume(knee().ct.with_voxels(knee().structures.labels), tmp_path / "labels.nii.gz")
    groups = {"tibia": [2], "femur": [1], "patella": [3]}
    (tmp_path / "structures.json").write_text(json.dumps({"structures": groups, "anchor": "femur"}))
    names = (("ct", "ct.nii.gz"), ("segmentation", "labels.nii.gz"), ("structures", "structures.json"))
    return [f"--{name}={tmp_path / file}" for name, file in names]


def test_a_knee_in_flexion(coarse, tmp_path, capsys):
    output = tmp_path / "knee"
    assert simulate(output, "--phantom", 1, "--frames", 3, "--motion", "flexion", "--amplitude", 40) == 0
    assert capsys.readouterr().out.strip() == str(output / "TRACK.json")
    fields = json.loads((output / "TRACK.json").read_text())
    assert fields["reference"] == "femur" and len(fields["cameras"]) == 2 and fields["landmarks"]
    assert [joint["name"] for joint in fields["joints"]] == ["knee", "patellofemoral"]
    truth = load_track_truth(output)
    bend = np.degrees(Rotation.from_matrix(truth.poses[:, 1, :3, :3]).magnitude())
    assert truth.poses.shape == (3, 3, 4, 4) and 25 < bend.max() < 45
    assert sorted(each.name for each in tmp_path.iterdir()) == ["knee"]  # nothing is left beside it


def test_a_ct_with_labels_in_a_world_of_its_own(coarse, files, tmp_path):
    output = tmp_path / "out"
    options = ["--frames", 2, "--views", 1, "--own-world", "--lead-in", 2, "--blank", 1, "--format", "tiff"]
    assert simulate(output, *files, "--motion", "flexion", *options, "--frames-per-second", 15) == 0
    fields = json.loads((output / "TRACK.json").read_text())
    assert fields["reference"] == "femur" and list(fields["structures"]) == ["tibia", "femur", "patella"]
    camera = fields["cameras"][0]
    assert (
        camera["first"] == 2 and camera["intensity"] == "line_integral" and fields["frames_per_second"] == 15
    )
    assert len(list((output / camera["images"]).iterdir())) == 4
    truth = load_track_truth(output)
    assert np.linalg.norm(truth.poses[0, 1, :3, :3] - np.eye(3)) > 0.1  # the seed's world is turned
    assert np.allclose(truth.cameras["view 1"].extrinsic, camera["extrinsic"])
    assert truth.unseen == {"view 1": (1,)}  # never the first one


def test_poses_of_a_table_are_moved_again(coarse, tmp_path):
    first = tmp_path / "first"
    arguments = ("--phantom", 0, "--motion", "flexion", "--frames", 2, "--own-world", "--views", 1)
    assert simulate(first, *arguments) == 0
    truth = load_track_truth(first)
    lines = [
        "frame,structure,"
        + ",".join([*(f"centroid_{a}_mm" for a in "xyz"), *(f"quaternion_{a}" for a in "xyzw")])
    ]
    for frame, row in enumerate(truth.poses):
        for name, pose, centre in zip(truth.names, row, truth.centroids, strict=True):
            motion = np.linalg.inv(pose)
            place, turn = motion[:3, :3] @ centre + motion[:3, 3], Rotation.from_matrix(motion[:3, :3])
            lines.append(
                f"{frame},{name}," + ",".join(map(repr, [*place.tolist(), *turn.as_quat().tolist()]))
            )
    table = tmp_path / "poses.csv"
    table.write_text("\n".join(lines))
    assert simulate(tmp_path / "again", "--phantom", 0, "--poses", table, "--views", 1) == 0
    assert np.allclose(load_track_truth(tmp_path / "again").poses, truth.poses, atol=1e-6)
    assert simulate(tmp_path / "long", "--phantom", 0, "--poses", table, "--frames", 9) == 2
    assert not (tmp_path / "long").exists()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--phantom", 0], "--phantom is of sequences: give --frames as well"),
        (["--frames", 0], "--frames is 0: give a whole number from 1"),
        (["--frames", 5, "--frames-per-second", "nan"], "--frames-per-second is nan: give a number"),
        (["--frames", 5, "--shutter", 2], "--shutter is 2.0: give a number from 0 to 1"),
        (["--frames", 5, "--sway", -1, 0], "--sway is -1"),
        (["--frames", 5, "--initial-error", 200, 0], "--initial-error is 200"),
        (["--frames", 5, "--period", 0], "--period is 0"),
        (["--frames", 5, "--ct-reach", 0], "--ct-reach is 0"),
        (["--frames", 5, "--detector", 0], "--detector is 0"),
        (["--frames", 5, "--first-angle", "inf"], "--first-angle is inf"),
        (["--frames", 5, "--blank", -1], "--blank is -1"),
        (["--frames", 5, "--lead-in", -1], "--lead-in is -1"),
        (["--frames", 5, "--lead-in", 1, 2, 3], "--lead-in has 3 numbers for 2 cameras"),
        (["--frames", 5, "--motion-scale", 2], "--motion-scale is of studies"),
        (["--frames", 5, "--camera", "absent"], "cameras of a sequence are known"),
        (["--frames", 5, "--format", "nifti"], 'written as "dicom" or "tiff"'),
        (["--frames", 5, "--degrade", "prosthesis"], "degradation of a sequence"),
        (["--frames", 5, "--phantom", -1], "--phantom is -1"),
        (["--frames", 5, "--phantom", 0, "--ct", "ct.nii"], "--phantom takes the place of a CT"),
        (["--frames", 5], "Give --ct, --segmentation and --structures"),
        (["--poses", "poses.csv", "--motion", "gait", "--phantom", 0], "--poses says what moves"),
        (["--poses", "absent.csv", "--phantom", 0], "absent.csv"),
        (["--format", "tiff"], "--format tiff is of sequences"),
        (["--sample", "pelvis", "--shutter", 0.5], "--shutter is of sequences: give --frames as well"),
        (["--sample", "pelvis", "--own-world"], "--own-world is of sequences"),
        (["--sample", "pelvis", "--lead-in", 3], "--lead-in is of sequences"),
    ],
)
def test_what_makes_no_sequence_is_refused_in_one_sentence(coarse, tmp_path, capsys, arguments, says):
    assert simulate(tmp_path / "out", *arguments) == 2
    message = capsys.readouterr().err.strip()
    assert says in message and message.count("\n") == 0
    assert not list(tmp_path.iterdir())


def test_a_full_folder_is_left_alone(coarse, tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert simulate(tmp_path, "--phantom", 0, "--frames", 2) == 2
    assert "mine.txt" in capsys.readouterr().err and [f.name for f in tmp_path.iterdir()] == ["mine.txt"]


def test_what_breaks_in_the_middle_leaves_nothing(coarse, tmp_path, monkeypatch):
    from PolyPoseLib.io.tracking import simulated

    def broken(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(simulated, "save_track_truth", broken)
    assert simulate(tmp_path / "out", "--phantom", 0, "--frames", 1, "--views", 1) == 2
    assert not list(tmp_path.iterdir())


def test_evaluate_prints_the_scores_of_a_track(coarse, tmp_path, capsys):
    tracks = pytest.importorskip("PolyPoseLib.io.tracking.tracks")
    from PolyPoseLib.data.tracking.track import Track, TrackedFrame

    output = tmp_path / "knee"
    assert simulate(output, "--phantom", 0, "--frames", 2, "--views", 1, "--motion", "flexion") == 0
    truth = load_track_truth(output)
    sure = np.tile(np.diag([1e-4] * 3 + [0.01] * 3), (3, 1, 1))
    frames = tuple(
        TrackedFrame(n, truth.poses[n], sure, np.zeros(3), ((),) * 3, ("forward",) * 3) for n in range(2)
    )
    tracks.save_track(
        Track(truth.names, "femur", truth.centroids, frames, 30.0, truth.cameras), tmp_path / "track"
    )
    capsys.readouterr()
    assert main(["evaluate", str(tmp_path / "track"), "--truth", str(output), "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    assert scores["summary"]["rms_mm"] < 1e-6 and scores["summary"]["lost_in_silence"] == 0
    assert main(["evaluate", str(tmp_path / "track"), "--truth", str(output / "truth.json")]) == 0
    assert "lost in silence 0" in capsys.readouterr().out
