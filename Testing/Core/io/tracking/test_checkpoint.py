"""The checkpoint of a run: whatever ends it, all frames but the one under way are there, and go on with it."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from json_values import assert_one_sentence
from track_case import FRAMES, frame_at, install_stand_in, make_track, write_sequence

import PolyPoseLib
from PolyPoseLib.__main__ import main
from PolyPoseLib.data.tracking.correction import Correction
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.checkpoint import checkpoint_path, frames_left, opened_checkpoint
from PolyPoseLib.io.tracking.fingerprint import fingerprint
from PolyPoseLib.io.tracking.sequences import load_sequence
from PolyPoseLib.io.tracking.tracks import load_track

NAMES = ("tibia", "talus")
DIGEST = "0" * 64


def same(first, second):
    """Whether two frames are equal, number for number."""
    return (
        all(
            np.array_equal(getattr(first, name), getattr(second, name), equal_nan=True)
            for name in ("poses", "covariances", "residuals")
        )
        and (first.frame, first.doubts, first.sources, first.cpu_seconds)
        == (second.frame, second.doubts, second.sources, second.cpu_seconds)
    )  # fmt: skip


def kept(path, digest=DIGEST, names=NAMES):
    with opened_checkpoint(path, digest, names, resume=True) as checkpoint:
        return checkpoint.done


@pytest.fixture
def frames():
    return make_track(3, frames=8).frames


@pytest.fixture
def path(tmp_path, frames):
    path = checkpoint_path(tmp_path / "out")
    with opened_checkpoint(path, DIGEST, NAMES, resume=False) as checkpoint:
        for frame in frames:
            checkpoint.keep(frame)
    return path


def test_frames_come_back_number_for_number(path, frames):
    assert all(map(same, kept(path), frames)) and len(kept(path)) == len(frames) == frames_left(path)
    assert path.name == "out.partial"


def test_a_frame_is_on_the_disk_once_it_is_kept(tmp_path, frames):
    path = tmp_path / "out.partial"
    with opened_checkpoint(path, DIGEST, NAMES, resume=False) as checkpoint:
        for number, frame in enumerate(frames):
            checkpoint.keep(frame)
            assert frames_left(path) == number + 1 == checkpoint.kept


def test_a_run_goes_on_after_the_frames_of_another(path, frames):
    with opened_checkpoint(path, DIGEST, NAMES, resume=True) as checkpoint:
        checkpoint.keep(frame_at(20))
    assert all(map(same, kept(path), (*frames, frame_at(20))))
    with opened_checkpoint(path, DIGEST, NAMES, resume=False) as checkpoint:
        assert not checkpoint.done
        checkpoint.keep(frame_at(1))
    assert all(map(same, kept(path), (frame_at(1),)))


def test_frames_come_back_in_the_order_of_the_passes(tmp_path, frames):
    """Those of the way back follow, with the same numbers; each frame counts once."""
    path = tmp_path / "out.partial"
    order = [frames[n] for n in (0, 1, 2)] + [frame_at(n) for n in (1, 0)]
    with opened_checkpoint(path, DIGEST, NAMES, resume=False) as checkpoint:
        for frame in order:
            checkpoint.keep(frame)
        assert checkpoint.kept == 3
    assert frames_left(path) == 3
    with opened_checkpoint(path, DIGEST, NAMES, resume=True) as checkpoint:
        assert checkpoint.kept == 3 and len(checkpoint.done) == 5
        assert all(map(same, checkpoint.done, order))


def test_every_torn_end_costs_one_frame_at_most(path, frames):
    """The file may end anywhere: whole lines before it are read, and what follows is written in their place."""
    whole = path.read_bytes()
    ends = np.flatnonzero(np.frombuffer(whole, np.uint8) == ord("\n"))
    rng = random.Random(0)
    for size in [0, 1, 8, 9, 40, *rng.sample(range(len(whole)), 60)]:
        path.write_bytes(whole[:size])
        left = max(np.count_nonzero(ends < size) - 1, 0)
        assert len(kept(path)) == left
        if left:
            with opened_checkpoint(path, DIGEST, NAMES, resume=True) as checkpoint:
                checkpoint.keep(frame_at(50))
            assert all(map(same, kept(path), (*frames[:left], frame_at(50))))


def test_bytes_that_a_disk_changed_end_what_is_taken_over(path, frames):
    whole = path.read_bytes()
    rng = random.Random(1)
    header = whole.index(b"\n") + 1
    for _ in range(40):
        place = rng.randrange(header, len(whole) - 1)
        changed = bytearray(whole)
        changed[place] ^= 1 << rng.randrange(7)
        path.write_bytes(changed)
        found = kept(path)
        assert len(found) < len(frames) and all(map(same, found, frames))


def test_other_inputs_are_refused(path):
    for digest, names in (("1" * 64, NAMES), (DIGEST, ("tibia", "femur")), (DIGEST, NAMES[:1])):
        with pytest.raises(InputError, match="tracked something else") as error:
            kept(path, digest, names)
        assert_one_sentence(error)
    assert frames_left(path) == 8


@pytest.mark.parametrize(
    "content", [b"hello", b"a line\n", b"\0" * 100, b"deadbeef hello", b'{"a": 1}\n', b"x" * 10**6]
)
def test_a_file_that_is_no_checkpoint_is_not_touched(tmp_path, content):
    path = tmp_path / "out.partial"
    path.write_bytes(content)
    for attempt in (lambda: frames_left(path), lambda: kept(path)):
        with pytest.raises(InputError, match="no checkpoint") as error:
            attempt()
        assert_one_sentence(error)
    assert path.read_bytes() == content


def test_links_folders_and_pipes_are_refused(tmp_path, path):
    link, folder, pipe = (tmp_path / name for name in ("a.partial", "b.partial", "c.partial"))
    link.symlink_to(path)
    folder.mkdir()
    os.mkfifo(pipe)
    for each in (link, folder, pipe):
        with pytest.raises(InputError):
            frames_left(each)
        with pytest.raises(InputError):
            kept(each)


def test_a_pose_that_is_none_is_not_kept(tmp_path):
    path = tmp_path / "out.partial"
    for wrong in (np.nan, np.inf, 2.0):
        frame = frame_at(0)
        frame.poses[1, 0, 0] = wrong
        with opened_checkpoint(path, DIGEST, NAMES, resume=False) as checkpoint:
            with pytest.raises(InputError, match='The pose of "talus" in frame 0') as error:
                checkpoint.keep(frame)
            assert_one_sentence(error)
        assert not path.exists(), "a checkpoint without a frame is removed"


def test_a_fingerprint_knows_what_poses_depend_on_and_nothing_else(tmp_path):
    path = write_sequence(tmp_path / "walk")
    first = fingerprint(load_sequence(path))
    assert first == fingerprint(load_sequence(path))
    for same_poses in ({"smooth": True}, {"backward": False}, {"threads": 1}):
        assert fingerprint(load_sequence(path, options=same_poses)) == first
    for other in (
        {"first": 1},
        {"last": 3},
        {"kernel": "torch"},
        {"start": "registration"},
        {"prediction": "previous"},
    ):
        assert fingerprint(load_sequence(path, options=other)) != first
    text = path.read_text()
    for old, new in (
        ('"talus": [2]', '"femur": [2]'),
        ('"frames_per_second": 50', '"frames_per_second": 51'),
    ):
        assert old in text
        path.write_text(text.replace(old, new))
        assert fingerprint(load_sequence(path)) != first
    fields = json.loads(text)
    fields["landmarks"] = {"tibia.origin": [0, 0, 0], "tibia.y_axis": [0, 0, 9], "tibia.x_side": [0, -9, 0]}
    fields["joints"] = [{"name": "ankle", "proximal": "tibia", "distal": "talus"}]
    path.write_text(json.dumps(fields))
    assert fingerprint(load_sequence(path)) == first, "axes of joints do not change poses"
    path.write_text(text)
    images = sorted((path.parent / "cam1").iterdir())
    images[0].write_bytes(images[-1].read_bytes())
    assert fingerprint(load_sequence(path)) != first


def test_a_fingerprint_knows_the_correction_and_the_track_that_it_corrects(tmp_path):
    sequence = load_sequence(write_sequence(tmp_path / "walk"))
    track = replace(make_track(frames=FRAMES), smoothed=False)
    first = Correction(track, 2, {"talus": np.eye(4)})
    assert fingerprint(sequence, first) == fingerprint(sequence, replace(first)) != fingerprint(sequence)
    moved = np.eye(4)
    moved[0, 3] = 1e-9
    poses = track.frames[5].poses.copy()
    poses[0, 0, 3] += 1e-9
    other = replace(track, frames=(*track.frames[:5], replace(track.frames[5], poses=poses)))
    changes = (
        {"frame": 3}, {"poses": {"talus": moved}}, {"poses": {"tibia": np.eye(4)}}, {"poses": {}},
        {"direction": "forward"}, {"until": 4}, {"track": other},
    )  # fmt: skip
    found = {fingerprint(sequence, replace(first, **each)) for each in changes}
    assert len(found) == len(changes) and fingerprint(sequence, first) not in found


CHILD = """
import sys, time
sys.path.insert(0, sys.argv[1])
from track_case import install_stand_in
def before(number):
    print(number, flush=True)
    time.sleep(0.03)
install_stand_in(before_frame=before)
from PolyPoseLib.__main__ import main
sys.exit(main(["track", *sys.argv[2:], "--progress", "none", "--quiet"]))
"""


def started(path, output, *flags):
    support = Path(__file__).parents[2] / "support"
    return subprocess.Popen(
        [sys.executable, "-c", CHILD, str(support), str(path), "--output", str(output), *flags],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(PolyPoseLib.__file__).parents[1])},
    )


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize(
    ("number", "kills"),
    [
        pytest.param(signal.SIGKILL, 2, id="killed"),
        pytest.param(signal.SIGTERM, 1, id="asked to end"),
        pytest.param(signal.SIGKILL, 40, id="killed many times", marks=pytest.mark.kill),
        pytest.param(signal.SIGINT, 40, id="interrupted many times", marks=pytest.mark.kill),
    ],
)
def test_a_killed_run_loses_one_frame_and_goes_on_to_the_same_track(tmp_path, number, kills):
    path = write_sequence(tmp_path / "walk")
    output = tmp_path / "out"
    rng = random.Random(int(number))
    fitted = 0
    for _ in range(kills):
        child = started(path, output, "--resume")
        begun = [int(line) for line in [child.stdout.readline()] if line.strip()]
        assert begun == [fitted], "it goes on with the frame that was under way"
        time.sleep(rng.uniform(0, 0.06))
        child.send_signal(number)
        out, err = child.communicate(timeout=300)
        begun += [int(line) for line in out.split() if line.isdigit()]
        if child.returncode == 0:
            break
        assert child.returncode == (130 if number != signal.SIGKILL else -number), err
        left = frames_left(checkpoint_path(output)) or 0
        assert left in (begun[-1], begun[-1] + 1), "all frames but the one under way are kept"
        assert number == signal.SIGKILL or not left or "--resume to go on" in err
        fitted = left
        if fitted == FRAMES:
            break
    if not output.exists():
        child = started(path, output, "--resume")
        assert child.communicate(timeout=300) and child.returncode == 0
    assert all(map(same, load_track(output).frames, [frame_at(each) for each in range(FRAMES)]))
    assert sorted(each.name for each in tmp_path.iterdir()) == ["out", "walk"]


def test_frames_of_an_interrupted_run_are_not_discarded_unasked(tmp_path, capsys):
    path, output = write_sequence(tmp_path / "walk"), tmp_path / "out"

    def stop(number):
        if number == 4:
            raise KeyboardInterrupt

    install_stand_in(before_frame=stop)
    try:
        assert main(["track", str(path), "--output", str(output)]) == 130
        assert "4 frames are kept" in capsys.readouterr().err
        assert main(["track", str(path), "--output", str(output)]) == 2
        assert "add --resume to go on, or --overwrite to begin anew" in capsys.readouterr().err
        assert (
            main(["track", str(path), "--output", str(output), "--resume", "--prediction", "previous"]) == 2
        )
        assert "tracked something else" in capsys.readouterr().err
        assert frames_left(checkpoint_path(output)) == 4
        asked = []
        install_stand_in(before_frame=asked.append)
        assert main(["track", str(path), "--output", str(output), "--resume", "--smooth"]) == 0
        assert asked == [4, 5] and load_track(output).smoothed
        assert not checkpoint_path(output).exists()
        assert main(["track", str(path), "--output", str(output), "--resume"]) == 2, "there is a track"
    finally:
        sys.modules.pop("PolyPoseLib.tracking.follow", None)


def test_a_signal_right_after_a_frame_was_written_does_not_lose_it(tmp_path, frames, monkeypatch):
    path = checkpoint_path(tmp_path / "out")
    synced = os.fsync

    def interrupted(descriptor):
        synced(descriptor)
        if checkpoints:
            raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupted)
    checkpoints = []
    with (
        pytest.raises(KeyboardInterrupt),
        opened_checkpoint(path, DIGEST, NAMES, resume=False) as checkpoint,
    ):
        checkpoints.append(checkpoint)
        checkpoint.keep(frames[0])
    monkeypatch.setattr(os, "fsync", synced)
    assert same(kept(path)[0], frames[0])
