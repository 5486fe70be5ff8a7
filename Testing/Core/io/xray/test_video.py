"""A frame of a film is the frame that was saved; films that are damaged, in colour or endless end in one sentence."""

import numpy as np
import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray import video
from PolyPoseLib.io.xray.read import read_xray

GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4, "intensity": "attenuation"}
SHAPE = (48, 64)
FRAMES = 4


def pictures():
    row, column = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return [(row + column + 20 * number).astype(np.uint8) for number in range(FRAMES)]


def film(path, codec, pixel_format, frames):
    av = pytest.importorskip("av")
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=5)
        stream.width, stream.height, stream.pix_fmt = SHAPE[1], SHAPE[0], pixel_format
        for pixels in frames:
            kind = "gray" if pixels.ndim == 2 else "rgb24"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format=kind)))
        container.mux(stream.encode())
    return path


@pytest.mark.parametrize(
    ("name", "codec", "pixel_format", "tolerance"),
    [("x.avi", "ffv1", "gray", 0), ("x.mp4", "mpeg4", "yuv420p", 15), ("x.mov", "mjpeg", "yuvj420p", 15)],
)
def test_a_frame_is_the_one_that_was_saved(tmp_path, name, codec, pixel_format, tolerance):
    path = film(tmp_path / name, codec, pixel_format, pictures())
    for number in (0, FRAMES - 1):
        found = video.read_video_frame(path, name, number)
        np.testing.assert_allclose(found.astype(float), pictures()[number], atol=tolerance)
        assert abs(found.mean() - pictures()[number].mean()) < 4  # the frames differ by 20
    with pytest.raises(InputError, match=f"film of {FRAMES} frames, so"):
        video.read_video_frame(path, name, FRAMES)


def test_a_study_names_the_frame(tmp_path):
    path = film(tmp_path / "x.avi", "ffv1", "gray", pictures())
    xray = read_xray(path, fields={**GEOMETRY, "frame": 2})
    assert np.corrcoef(xray.image.ravel(), pictures()[2].ravel())[0, 1] > 0.999
    with pytest.raises(InputError, match='film of 4 frames; add "frame"'):
        read_xray(path, fields=GEOMETRY)


def test_damaged_and_coloured_films_end_in_one_sentence(tmp_path):
    colours = np.random.default_rng(0).integers(0, 255, (*SHAPE, 3), dtype=np.uint8)
    with pytest.raises(InputError, match="colour film"):
        video.read_video_frame(film(tmp_path / "c.avi", "ffv1", "bgr0", [colours]), "c.avi", 0)
    path = film(tmp_path / "x.avi", "ffv1", "gray", pictures())
    content = path.read_bytes()
    for damaged in (b"", b"RIFF", content[:300], bytes(1000)):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"damaged|film of"):
            video.read_video_frame(path, "x.avi", 0)


def test_a_film_without_an_end_is_given_up(tmp_path, monkeypatch):
    path = film(tmp_path / "x.avi", "ffv1", "gray", pictures())
    monkeypatch.setattr(video, "VIDEO_LIMITS", video.Limits(cpu_seconds=60, wall_seconds=0))
    with pytest.raises(InputError, match="not reached"):
        video.read_video_frame(path, "x.avi", 0)
    monkeypatch.undo()
    monkeypatch.setattr(video.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="pip install av"):
        video.read_video_frame(path, "x.avi", 0)
    with pytest.raises(InputError):
        video.read_video_frame(path, "x.avi", 10**9)
