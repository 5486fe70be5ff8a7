"""The subcommand track: its options, what it prints and writes, and its exit statuses."""

import argparse
import gzip
import json
import sys

import numpy as np
import pytest
from track_case import FRAMES, frame_at, install_stand_in, make_track, picture, write_sequence
from xray_samples import SECRET, dataset, save

from PolyPoseLib.__main__ import main
from PolyPoseLib.cli import track as command
from PolyPoseLib.data.progress import Progress
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.tracks import load_track


@pytest.fixture
def path(tmp_path):
    return write_sequence(tmp_path / "walk")


@pytest.fixture(autouse=True)
def tracker():
    """The files alone are tested here."""
    kept = sys.modules.get("PolyPoseLib.tracking.follow")
    install_stand_in()
    yield
    if kept is None:
        sys.modules.pop("PolyPoseLib.tracking.follow", None)
    else:
        sys.modules["PolyPoseLib.tracking.follow"] = kept


def run(capsys, *argv):
    """Exit status, stdout and stderr."""
    capsys.readouterr()
    status = main(["track", *map(str, argv)])
    out, err = capsys.readouterr()
    return status, out, err


def test_it_writes_the_track_and_prints_a_summary(path, tmp_path, capsys):
    status, out, _ = run(capsys, path, "--output", tmp_path / "out")
    assert status == 0
    words = out.split()
    assert "tibia" in words and "talus" in words and "range" in words
    assert (
        f"{FRAMES} frames, 0 with a lost structure, 0 with a doubtful one; 0.25 CPU seconds a frame\n" in out
    )
    assert out.rstrip().endswith(f"Track: {tmp_path / 'out'}")
    track = load_track(tmp_path / "out")
    assert np.array_equal(track.poses, [frame_at(number).poses for number in range(FRAMES)])
    assert {each.name for each in tmp_path.iterdir()} == {"walk", "out"}, "the checkpoint is gone"


def test_progress_for_programs(path, tmp_path, capsys):
    status, out, _ = run(capsys, path, "--output", tmp_path / "out", "--progress", "json")
    steps = [Progress.from_json(line) for line in out.splitlines()]
    assert status == 0 and len(steps) == FRAMES and steps[-1].iteration == FRAMES


def test_options_of_the_command_line_win(path, tmp_path, capsys):
    fields = json.loads(path.read_text())
    path.write_text(json.dumps({**fields, "options": {"first": 0, "smooth": True}}))
    flags = ["--first", 2, "--last", 4, "--no-smooth", "--threads", 1, "--start", "registration", "--no-backward",
             "--prediction", "previous"]  # fmt: skip
    assert run(capsys, path, "--output", tmp_path / "out", *flags)[0] == 0
    track = load_track(tmp_path / "out")
    assert track.numbers.tolist() == [2, 3, 4] and not track.smoothed


def test_surfaces_and_warped_cts_of_chosen_frames(path, tmp_path, capsys):
    pytest.importorskip("vtkmodules")
    flags = ["--frames-of-surfaces", "0,2:4:2", "--warp-frames", "5"]
    assert run(capsys, path, "--output", tmp_path / "out", *flags)[0] == 0
    surfaces = sorted(each.name for each in (tmp_path / "out/surfaces").iterdir())
    assert surfaces == ["frame_000000", "frame_000002", "frame_000004"]
    assert len(list((tmp_path / "out/warped").iterdir())) == 2
    status, _, err = run(capsys, path, "--output", tmp_path / "two", "--warp-frames", "6")
    assert status == 2 and "--warp-frames: frame 6 is not tracked; give numbers from 0 to 5" in err


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("3", (3,)),
        ("0,10,20", (0, 10, 20)),
        ("0:6:3", (0, 3, 6)),
        ("2:4", (2, 3, 4)),
        ("1,1,0:1", (1, 0)),
        (" 4 ", (4,)),
    ],
)
def test_lists_of_frames(text, numbers):
    assert command._frames(text) == numbers


@pytest.mark.parametrize(
    "text", ["", "a", "1,", "-1", "1.5", "3:1", "0:9:0", "0:1:2:3", "0:999999999", "²", "1e3"]
)
def test_what_is_no_list_of_frames(text):
    with pytest.raises(argparse.ArgumentTypeError, match=r"frame|range"):
        command._frames(text)


def test_a_track_that_is_not_trusted_is_saved_with_status_3(path, tmp_path, capsys):
    install_stand_in(distrust=("every structure was lost in half of the frames.",))
    status, _, err = run(capsys, path, "--output", tmp_path / "out")
    assert status == 3
    assert err.splitlines()[-1] == (
        f"polypose: The track was saved in {tmp_path / 'out'} but must not be trusted: every structure was lost in "
        "half of the frames."
    )
    assert load_track(tmp_path / "out").distrust


def test_an_earlier_track_is_replaced_when_that_is_asked_for(path, tmp_path, capsys):
    output = tmp_path / "out"
    assert run(capsys, path, "--output", output, "--last", 1)[0] == 0
    status, _, err = run(capsys, path, "--output", output)
    assert status == 2 and "add --overwrite" in err
    assert run(capsys, path, "--output", output, "--overwrite")[0] == 0
    assert len(load_track(output).frames) == FRAMES
    (output / "notes.txt").write_text("mine")
    status, _, err = run(capsys, path, "--output", output, "--overwrite")
    assert status == 2 and "notes.txt" in err and (output / "notes.txt").exists()


@pytest.mark.parametrize("output", ["absent/out", "walk/TRACK.json"])
def test_places_that_take_no_track_are_refused_before_the_work(path, tmp_path, capsys, output):
    asked = []
    install_stand_in(before_frame=asked.append)
    status, _, err = run(capsys, path, "--output", tmp_path / output)
    assert status == 2 and not asked and len(err.splitlines()) == 1


def test_an_image_that_cannot_be_read_ends_the_run_and_earlier_frames_are_kept(path, tmp_path, capsys):
    image = path.parent / "cam1" / "im10.png"
    whole = image.read_bytes()

    def damage(number):
        image.write_bytes(whole[: len(whole) // 2] if number == 3 else whole)

    install_stand_in(before_frame=damage)
    status, _, err = run(capsys, path, "--output", tmp_path / "out")
    assert status == 2 and "image 3" in err and "3 frames are kept" in err
    image.write_bytes(whole)
    install_stand_in()
    assert run(capsys, path, "--output", tmp_path / "out", "--resume")[0] == 0
    assert len(load_track(tmp_path / "out").frames) == FRAMES


def test_what_is_wrong_is_one_sentence(path, tmp_path, capsys):
    fields = json.loads(path.read_text())
    for changes in ({"ct": "../x"}, {"reference": "femur"}, {"cameras": []}, {"frames_per_second": "fast"}):
        path.write_text(json.dumps({**fields, **changes}))
        status, out, err = run(capsys, path, "--output", tmp_path / "out")
        assert status == 2 and not out and len(err.splitlines()) == 1 and "TRACK.json" in err
    assert sorted(each.name for each in tmp_path.iterdir()) == ["walk"]


def test_no_output_names_the_patient_or_the_files(path, tmp_path, capsys):
    stack = np.stack([picture(7, frame) % 4000 for frame in range(FRAMES)]).astype(np.uint16)
    fields = json.loads(path.read_text())
    place = path.parent / "Roe_Richard"
    place.mkdir()
    save(dataset(stack, "XA", StudyDescription=SECRET), place / "Roe_Richard.dcm")
    (path.parent / "cam1").rename(place / "Roe_R")
    (place / "Roe_R" / "Roe.txt").write_text("x")
    fields["cameras"][0]["images"] = "Roe_Richard/Roe_Richard.dcm"
    fields["cameras"][1]["images"] = "Roe_Richard/Roe_R"
    path.write_text(json.dumps({**fields, "options": {}}))
    status, out, err = run(capsys, path, "--output", tmp_path / "out", "--warp-frames", 0)
    assert status == 0 and "were left out" in err
    texts = [out, err]
    for each in (tmp_path / "out").rglob("*"):
        if each.is_file():
            content = each.read_bytes()
            content = gzip.decompress(content) if each.suffix == ".gz" else content
            texts += [each.name, content.decode("latin-1")]
    for text in texts:  # compressed pictures hold any three letters sooner or later
        assert not any(word in text for word in ("Roe_R", "Richard", SECRET, "SECRET42"))


def test_doubtful_frames_are_listed_up_to_a_number():
    track = make_track(0, frames=30)
    frames = [
        type(each)(**{**each.__dict__, "doubts": (("it jumped", "it is faint"), ())}) for each in track.frames
    ]
    track = type(track)(**{**track.__dict__, "frames": tuple(frames)})
    lines = command.doubt_lines(track)
    assert lines[0] == "frame 0, tibia: it jumped; it is faint" and len(lines) == 11
    assert lines[-1] == "and 20 more, see poses.csv"
    assert "30 with a doubtful one" in command.summary_table(track)


def test_an_error_of_the_tracker_is_not_hidden(path, tmp_path, capsys):
    def fail(number):
        raise InputError("the bones are made of cheese.")

    install_stand_in(before_frame=fail)
    status, _, err = run(capsys, path, "--output", tmp_path / "out")
    assert status == 2 and err.splitlines()[-1] == "polypose: the bones are made of cheese."
    assert not (tmp_path / "out.partial").exists()


def test_the_scores_of_a_track_need_the_truth_of_a_sequence(path, tmp_path, capsys):
    assert run(capsys, path, "--output", tmp_path / "out")[0] == 0
    for truth, says in (
        (tmp_path / "nothing", "nothing"),
        (path, '"of" is missing'),
        (path.parent, "truth.json"),
    ):
        assert main(["evaluate", str(tmp_path / "out"), "--truth", str(truth)]) == 2
        sentence = capsys.readouterr().err
        assert says in sentence.replace('the field "of" is missing', '"of" is missing'), sentence
        assert "result.json" not in sentence and len(sentence.splitlines()) == 1
