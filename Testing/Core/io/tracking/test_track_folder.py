"""The folder of a track: number for number what was saved, all of it or nothing, and nothing of anyone else's."""

import csv
import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from json_values import assert_one_sentence, changed
from scipy.spatial.transform import Rotation
from track_case import make_track, write_sequence

import PolyPoseLib as pp
from PolyPoseLib.data.tracking.track import TrackedFrame
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking import tracks
from PolyPoseLib.io.tracking.file_names import file_stems
from PolyPoseLib.io.tracking.poses_table import COLUMNS, INTERVALS
from PolyPoseLib.io.tracking.sequences import load_sequence
from PolyPoseLib.io.tracking.track_fields import track_fields, track_of

FIELDS = json.loads(json.dumps(track_fields(make_track(1, frames=3))))


def assert_same(first, second):
    """Two tracks are equal, number for number."""
    for name in (
        "names",
        "reference",
        "frames_per_second",
        "smoothed",
        "warnings",
        "distrust",
        "device",
        "versions",
        "inputs",
        "corrections",
    ):
        assert getattr(first, name) == getattr(second, name), name
    assert np.array_equal(first.centroids, second.centroids)
    assert list(first.cameras) == list(second.cameras)
    for name, camera in first.cameras.items():
        other = second.cameras[name]
        assert np.array_equal(camera.intrinsics, other.intrinsics)
        assert np.array_equal(camera.extrinsic, other.extrinsic)
        assert (camera.height, camera.width) == (other.height, other.width)
    for name in ("poses", "covariances", "numbers", "doubtful"):
        assert np.array_equal(getattr(first, name), getattr(second, name), equal_nan=name[-1] == "s"), name
    for one, other in zip(first.frames, second.frames, strict=True):
        assert np.array_equal(one.residuals, other.residuals, equal_nan=True)
        assert (one.doubts, one.sources, one.cpu_seconds) == (other.doubts, other.sources, other.cpu_seconds)


@given(st.integers(0, 10**6), st.integers(2, 7), st.integers(1, 5), st.integers(0, 90))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_read_is_what_was_saved(tmp_path, seed, frames, structures, first):
    track = make_track(seed, frames, structures, first)
    folder = pp.save_track(track, tmp_path / "out", overwrite=True)
    assert_same(pp.load_track(folder), track)
    assert sorted(each.name for each in folder.iterdir()) == ["README.txt", "poses.csv", "track.json"]


@given(changed(FIELDS))
def test_a_damaged_file_ends_in_a_track_or_one_sentence(fields):
    try:
        track = track_of(fields)
    except InputError as error:
        assert_one_sentence(error)
    else:
        assert track.poses.shape[1:] == (len(track.names), 4, 4)


def test_a_file_that_is_absent_or_no_track_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such folder"):
        pp.load_track(tmp_path / "absent")
    folder = pp.save_track(make_track(), tmp_path / "out")
    path = folder / "track.json"
    whole = path.read_text()
    for text in ("", "{}", whole[: len(whole) // 2], whole.replace('"version": 1', '"version": 7'), "[1]"):
        path.write_text(text)
        with pytest.raises(InputError) as error:
            pp.load_track(folder)
        assert_one_sentence(error)
        assert "track.json" in str(error.value)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 3.0])
def test_a_pose_that_is_none_is_not_saved(tmp_path, wrong):
    track = make_track()
    track.frames[0].poses[0, 1, 1] = wrong
    with pytest.raises(InputError, match='The pose of "tibia" in frame 0') as error:
        pp.save_track(track, tmp_path / "out")
    assert_one_sentence(error)
    assert not (tmp_path / "out").exists()


def test_frames_that_do_not_fit_are_not_saved(tmp_path):
    track = make_track()
    frame = track.frames[1]
    for changes in ({"residuals": np.zeros(3)}, {"doubts": ((),)}, {"poses": frame.poses[:1]}):
        odd = TrackedFrame(**{**frame.__dict__, **changes})
        with pytest.raises(InputError) as error:
            pp.save_track(
                type(track)(**{**track.__dict__, "frames": (track.frames[0], odd)}), tmp_path / "out"
            )
        assert_one_sentence(error)


def test_only_an_earlier_track_is_replaced(tmp_path):
    folder = tmp_path / "out"
    pp.save_track(make_track(1), folder)
    with pytest.raises(InputError, match="already holds a result"):
        pp.save_track(make_track(2), folder)
    (folder / "surfaces").mkdir()
    (folder / "surfaces" / "mine.stl").write_text("solid")
    with pytest.raises(InputError, match=r"surfaces/mine\.stl"):
        pp.save_track(make_track(2), folder, overwrite=True)
    (folder / "surfaces" / "mine.stl").unlink()
    pp.save_track(make_track(2), folder, overwrite=True)
    assert_same(pp.load_track(folder), make_track(2))
    for text in ("{}", "no json", '{"files": "all"}', '{"files": ["../x", 3]}'):
        (folder / "track.json").write_text(text)
        with pytest.raises(InputError, match="files that are no result"):
            pp.save_track(make_track(3), folder, overwrite=True)
    other = tmp_path / "other"
    other.mkdir()
    (other / "poses.csv").write_text("mine")
    with pytest.raises(InputError, match=r"poses\.csv"):
        pp.save_track(make_track(), other, overwrite=True)
    assert (other / "poses.csv").read_text() == "mine"


def test_what_cannot_be_made_is_left_out_with_a_warning(tmp_path, monkeypatch, caplog):
    sequence = load_sequence(write_sequence(tmp_path / "walk"))
    track = make_track(frames=6)

    def fails(track, sequence, folder):
        (folder / "pictures").mkdir()
        (folder / "pictures" / "half.png").write_bytes(b"x")
        raise ValueError("it cannot be drawn")

    def works(track, sequence, folder):
        (folder / "plots.png").write_bytes(b"x")

    monkeypatch.setattr(tracks, "MORE_FILES", (fails, works))
    folder = pp.save_track(track, tmp_path / "out", sequence, warped=[4])  # in which a structure was lost
    assert "it cannot be drawn" in caplog.text and '"talus" was lost' in caplog.text
    assert {each.name for each in folder.iterdir()} == {
        "README.txt", "poses.csv", "track.json", "plots.png", "tibia.tra", "talus.tra",
    }  # fmt: skip
    listed = json.loads((folder / "track.json").read_text())["files"]
    assert sorted(each.name for each in folder.iterdir()) == sorted(listed)
    pp.save_track(track, tmp_path / "out", overwrite=True)
    assert not (folder / "plots.png").exists()


def read_rows(folder):
    with (folder / "poses.csv").open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def test_the_table_moves_the_centroid_as_the_poses_do(tmp_path):
    track = make_track(5, frames=6)
    rows = read_rows(pp.save_track(track, tmp_path / "out"))
    assert tuple(rows[0]) == COLUMNS and len(rows) == 12
    for number, row in enumerate(rows):
        frame, k = track.frames[number // 2], number % 2
        assert (int(row["frame"]), row["structure"]) == (frame.frame, track.names[k])
        assert float(row["time_s"]) == pytest.approx(frame.frame / 50)
        numbers = {
            name: row[name] for name in COLUMNS if name.endswith(("_mm", "_deg")) or "quaternion" in name
        }
        if frame.sources[k] == "none":
            assert row["lost"] == row["doubtful"] == "yes" and not any(numbers.values())
            assert row["doubts"] == "it was lost"
            continue
        values = {name: float(text) for name, text in numbers.items()}
        centroid = np.array([values[f"centroid_{axis}_mm"] for axis in "xyz"])
        assert frame.poses[k] @ np.append(centroid, 1) == pytest.approx([*track.centroids[k], 1], abs=1e-3)
        turn = Rotation.from_rotvec([values[f"rotation_vector_{axis}_deg"] for axis in "xyz"], degrees=True)
        assert (turn.as_matrix() @ frame.poses[k][:3, :3]) == pytest.approx(np.eye(3), abs=1e-6)
        quaternion = Rotation.from_quat([values[f"quaternion_{axis}"] for axis in "xyzw"])
        assert (turn.inv() * quaternion).magnitude() < 1e-6 and values["quaternion_w"] >= 0


def test_intervals_are_those_of_the_covariance_along_and_across_the_view(tmp_path):
    """The trace does not depend on the axes; one camera's beam is the axis along which it was made uncertain."""
    track = make_track(6, frames=3)
    camera = next(iter(track.cameras.values()))
    frames = []
    for frame in track.frames:
        covariances = np.zeros((2, 6, 6))
        for k, pose in enumerate(np.nan_to_num(frame.poses)):
            source = pose[:3, :3] @ camera.source + pose[:3, 3]
            beam = track.centroids[k] - source
            beam /= np.linalg.norm(beam)
            covariances[k, 3:, 3:] = 0.1**2 * np.eye(3) + (2.0**2 - 0.1**2) * np.outer(beam, beam)
            covariances[k, :3, :3] = np.radians(0.5) ** 2 * np.eye(3)
        frames.append(TrackedFrame(**{**frame.__dict__, "covariances": covariances}))
    single = type(track)(**{**track.__dict__, "frames": tuple(frames), "cameras": {"one": camera}})
    for row in read_rows(pp.save_track(single, tmp_path / "out")):
        if row["lost"] == "yes":
            continue
        found = [float(row[name]) for name in INTERVALS]
        assert found == pytest.approx([3.92, 0.196, 0.196, 0.98, 0.98, 0.98], abs=2e-3)


def test_names_of_structures_reach_no_other_line_and_no_other_folder(tmp_path):
    names = ("a\nb", "../up", "con", "=1+1", "Tibia", "tibia", "\x1b[31m", ".", "x" * 300, "ä")
    stems = file_stems(names)
    assert len({each.lower() for each in stems}) == len(names)
    assert all(each.isascii() and not set("/\\:\n") & set(each) and 0 < len(each) < 90 for each in stems)
    assert "con" not in stems and not any(each.startswith((".", "-")) for each in stems)
    track = make_track(structures=10)
    track = type(track)(**{**track.__dict__, "names": names, "reference": "con"})
    folder = pp.save_track(track, tmp_path / "out")
    assert pp.load_track(folder).names == names
    rows = read_rows(folder)
    assert len(rows) == 50 and all(row["structure"].isprintable() for row in rows)


def test_thousands_of_frames_are_saved_and_read_in_seconds(tmp_path):
    track = make_track(0, frames=1000)
    folder = pp.save_track(track, tmp_path / "out")
    assert_same(pp.load_track(folder), track)
    assert (folder / "track.json").stat().st_size < 6e6
