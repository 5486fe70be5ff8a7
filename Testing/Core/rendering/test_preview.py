"""Renderings at review size, and the process that makes them."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from PolyPoseLib.__main__ import main
from PolyPoseLib.cli import render as command
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera, look_at
from PolyPoseLib.io.volumes import write_volume
from PolyPoseLib.rendering.preview import PreviewRenderer

ROOT = Path(__file__).resolve().parents[3]


def box_ct() -> Volume:
    """A block of water of 40 x 30 x 20 mm in air."""
    voxels = np.full((20, 30, 40), -1000, np.int16)
    voxels[5:15, 5:25, 5:35] = 0
    return Volume(voxels, np.eye(4))


def camera() -> Camera:
    """Looks along y at the block's middle."""
    extrinsic = look_at((19.5, -500.0, 9.5), (19.5, 14.5, 9.5))
    return Camera([[1000, 0, 24.5], [0, 1000, 19.5], [0, 0, 1]], extrinsic, 40, 50)


def test_the_middle_ray_sees_the_water() -> None:
    image = PreviewRenderer(box_ct(), voxel_mm=1.0, step_mm=0.5).render(camera())
    assert image.shape == (40, 50)
    assert image[19, 24] == pytest.approx(20 * 0.02, rel=0.03)
    assert image[0, 0] == 0


def request(number: int, output: Path, **changes) -> str:
    asked = camera()
    fields = {
        "id": number,
        "intrinsics": asked.intrinsics.tolist(),
        "extrinsic": asked.extrinsic.tolist(),
        "height": asked.height,
        "width": asked.width,
        "output": str(output),
    }
    return json.dumps({**fields, **changes}) + "\n"


def test_a_wrong_request_is_answered(tmp_path: Path) -> None:
    renderer = PreviewRenderer(box_ct(), 4.0)
    for line in ("[1]", "not json", "{}", request(1, tmp_path / "a", height=100000)):
        assert "error" in command.answer(renderer, line)
    assert command.answer(renderer, request(3, tmp_path / "no" / "where"))["id"] == 3


@pytest.mark.parametrize(
    "value",
    ["[" * 200_000, "[" * 500 + "]" * 500, "1" * 5000, "NaN", "1" * 400],
    ids=["open", "deep", "long", "nan", "large"],
)
@pytest.mark.parametrize("field", ["id", "intrinsics", "height", "output"])
def test_a_request_that_is_hard_to_read_is_answered(tmp_path: Path, field: str, value: str) -> None:
    renderer = PreviewRenderer(box_ct(), 4.0)
    fields = {**json.loads(request(1, tmp_path / "out.raw")), field: "HERE"}
    said = command.answer(renderer, json.dumps(fields).replace('"HERE"', value))
    assert "error" in said or (field, value) == ("id", "1" * 400)
    json.loads(json.dumps(said, allow_nan=False))


def ended_within(seconds: float, work: Callable[[], object]) -> bool:
    """Whether work comes to its end in time."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    return not thread.is_alive()


def test_nobody_waits_for_a_stream_that_broke() -> None:
    def broken() -> Iterator[str]:
        yield "first\n"
        raise OSError("gone")

    requests, taken = command.LatestRequest(broken()), []
    assert ended_within(10, lambda: taken.extend(iter(requests.take, None)))
    assert taken == ["first\n"]


def test_bytes_that_are_no_text_are_answered_and_the_process_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write_volume(box_ct(), tmp_path / "ct.nii.gz")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b'{"id": "\xff"}\n'), encoding="utf-8"))
    monkeypatch.setattr(command, "_compile", lambda renderer: None)
    status = []
    assert ended_within(30, lambda: status.append(main(["render", str(tmp_path / "ct.nii.gz"), "--quiet"])))
    assert status == [0]
    ready, said = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert ready == {"ready": True} and said["id"] == "\ufffd" and "intrinsics" in said["error"]


def test_the_process_answers_the_newest_and_ends_with_stdin(tmp_path: Path) -> None:
    write_volume(box_ct(), tmp_path / "ct.nii.gz")
    process = subprocess.Popen(
        [sys.executable, "-m", "PolyPoseLib", "render", str(tmp_path / "ct.nii.gz"), "--threads", "1"],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    lines = "".join(request(number, tmp_path / "out.raw") for number in range(200))
    said, _ = process.communicate(lines, timeout=60)
    answers = [json.loads(line) for line in said.splitlines()]
    assert answers[0] == {"ready": True}
    assert answers[-1]["id"] == 199 and len(answers) < 100
    assert np.fromfile(tmp_path / "out.raw", np.float32).size == 40 * 50
    assert process.returncode == 0
