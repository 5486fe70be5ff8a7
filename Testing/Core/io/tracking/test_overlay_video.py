"""The overlay video: outlines where the bones are, and a file that a decoder reads frame by frame."""

import dataclasses
import itertools

import av
import numpy as np
import pytest
from overlay_case import overlay_case
from scipy.ndimage import binary_closing, binary_erosion, distance_transform_edt

from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.io.tracking import overlay_frames
from PolyPoseLib.io.tracking.film_writer import FilmWriter
from PolyPoseLib.io.tracking.overlay_frames import STRIP, OverlayFrames
from PolyPoseLib.io.tracking.overlay_video import write_overlay_video

COLOURS = {"moving": (53, 214, 255), "flagged": (255, 92, 147), "anchor": (255, 224, 102)}


def coloured(picture, kind):
    """(H, W) bool: pixels of about a colour."""
    return np.abs(picture.astype(int) - COLOURS[kind]).max(axis=-1) < 60


def edges_of(sequence, track, frame, view, bones):
    """(H, W) bool at the picture's scale of one: outlines of bones' voxels as the camera sees them."""
    camera = sequence.views[view].camera
    edges = np.zeros((camera.height, camera.width), bool)
    for bone in bones:
        index = np.argwhere(sequence.structures.labels == bone + 1)[:, ::-1]
        offsets = np.stack(np.meshgrid(*[(-0.4, 0, 0.4)] * 3), -1).reshape(-1, 1, 3)
        points = sequence.ct.to_world((index + offsets).reshape(-1, 3))
        inverse = rigid_inverse(track.frames[frame].poses[bone])
        column, row = np.rint(camera.project(points @ inverse[:3, :3].T + inverse[:3, 3])).astype(int).T
        mask = np.zeros(edges.shape, bool)
        inside = (row >= 0) & (row < camera.height) & (column >= 0) & (column < camera.width)
        mask[row[inside], column[inside]] = True
        mask = binary_closing(mask, iterations=2)
        edges |= mask & ~binary_erosion(mask)
    return edges


@pytest.fixture
def without_names(monkeypatch):
    monkeypatch.setattr(overlay_frames, "MOST_NAMES", -1)


def view_part(frames, sequence, picture, view):
    """The part of a picture that shows a view; X-rays of 360 rows are shown one to one."""
    width = sequence.views[0].camera.width
    left = view * (width + 6)
    return picture[STRIP : frames.height - STRIP, left : left + width]


def test_outlines_lie_on_the_bones_edges_in_every_view(without_names):
    doubts = [((), ("jump",) if n == 2 else (), ()) for n in range(6)]
    sequence, track = overlay_case(6, pixels=360, doubts=doubts)
    frames = OverlayFrames(track, sequence)
    for number, kinds in (
        (1, {"anchor": [0], "moving": [1, 2]}),
        (2, {"anchor": [0], "moving": [2], "flagged": [1]}),
    ):
        picture = frames.picture(track.frames[number])
        assert picture.shape == (frames.height, frames.width, 3) and picture.dtype == np.uint8
        for view in range(2):
            part = view_part(frames, sequence, picture, view)
            part[:24, :80] = 0  # the view's name
            for kind, bones in kinds.items():
                edge = edges_of(sequence, track, number, view, bones)
                drawn = coloured(part, kind)
                away = distance_transform_edt(~edge)[drawn]
                assert np.percentile(away, 95) < 4.0 and away.max() < 8.0, (number, view, kind, away.max())
                if kind != "anchor":  # others may be drawn over the reference
                    missed = distance_transform_edt(~drawn)[edge]
                    assert np.percentile(missed, 70) < 5.0, (number, view, kind)
        assert coloured(picture, "flagged").any() == (number == 2)


def test_a_flagged_outline_is_dashed(without_names):
    sequence, track = overlay_case(2, pixels=360)
    doubtful = dataclasses.replace(
        track, frames=tuple(dataclasses.replace(each, doubts=((), ("jump",), ())) for each in track.frames)
    )
    solid = OverlayFrames(track, sequence).picture(track.frames[0])
    dashed = OverlayFrames(doubtful, sequence).picture(doubtful.frames[0])
    only_femur = coloured(solid, "moving").sum() - coloured(dashed, "moving").sum()
    assert 0.3 * only_femur < coloured(dashed, "flagged").sum() < 0.85 * only_femur


def test_lost_bones_are_not_drawn_and_no_frame_leaves_a_trace_in_the_next(without_names):
    sources = [("forward", "none", "none"), ("forward",) * 3]
    sequence, track = overlay_case(2, sources=sources)
    frames = OverlayFrames(track, sequence)
    lost = frames.picture(track.frames[0])
    assert not coloured(lost, "moving").any() and coloured(lost, "anchor").any()
    full = frames.picture(track.frames[1])
    ends = [np.flatnonzero(picture[:STRIP].max(axis=(0, 2)) > 150).max() for picture in (lost, full)]
    assert ends[0] > ends[1] + 100  # the strip names them
    assert coloured(full, "moving").any()
    np.testing.assert_array_equal(frames.picture(track.frames[0]), lost)


def test_the_film_holds_every_frame_and_is_made_one_at_a_time(tmp_path):
    sequence, track = overlay_case(7, first=2)
    seen = []

    def progress(done, of):
        assert of == 7 and all(view.images.reads[5:] == list(range(2, 2 + done)) for view in sequence.views)
        seen.append(done)

    path = tmp_path / "overlay.mp4"
    write_overlay_video(track, sequence, path, progress)
    assert seen == list(range(1, 8)) and [each.name for each in tmp_path.iterdir()] == ["overlay.mp4"]
    frames = OverlayFrames(track, sequence)
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert (stream.height, stream.width) == (frames.height, frames.width)
        assert stream.codec_context.name == "h264" and float(stream.average_rate) == 20.0
        assert set(film.metadata) <= {"major_brand", "minor_version", "compatible_brands", "encoder"}
        decoded = [frame.to_ndarray(format="rgb24") for frame in film.decode(stream)]
    assert len(decoded) == 7
    for frame, shown in zip(track.frames, decoded, strict=True):
        error = shown.astype(float) - frames.picture(frame)
        assert np.sqrt((error**2).mean()) < 9.0  # colour is kept at half the resolution
    differences = [np.abs(a.astype(int) - b).mean() for a, b in itertools.pairwise(decoded)]
    assert min(differences) > 0.3


@pytest.mark.parametrize("blank", [[0], [0, 2, 5], [8], []])
@pytest.mark.parametrize("level", [-3.0, 0.0, 7.0])
def test_blank_frames_do_not_decide_how_bright_all_others_are(without_names, blank, level):
    sequence, track = overlay_case(9)
    usual = OverlayFrames(track, sequence).picture(track.frames[3]).astype(int)
    for view in sequence.views:
        view.images.read = _blank_in(view.images, blank, level)
    shown = OverlayFrames(track, sequence)
    shown.picture(track.frames[0])
    assert np.abs(shown.picture(track.frames[3]) - usual).mean() < 8.0


def _blank_in(images, numbers, level):
    read = images.read

    def some(index):
        image, mask = read(index)
        noise = np.random.default_rng(index).normal(level, 0.005, image.shape).astype(np.float32)
        return (noise if index in numbers else image), mask

    return some


@pytest.mark.parametrize("rate, played", [(250.0, 30.0), (7.5, 7.5), (0.2, 0.2)])
def test_fast_sequences_are_played_slowly(tmp_path, rate, played):
    sequence, track = overlay_case(2, angles=(0.0,))
    write_overlay_video(dataclasses.replace(track, frames_per_second=rate), sequence, tmp_path / "a.mp4")
    with av.open(str(tmp_path / "a.mp4")) as film:
        assert float(film.streams.video[0].average_rate) == pytest.approx(played, rel=1e-3)


def test_a_stopped_or_failed_video_leaves_nothing_behind(tmp_path):
    sequence, track = overlay_case(3)
    path = tmp_path / "overlay.mp4"
    path.write_bytes(b"an older one")

    def stop(done, of):
        if done == 2:
            raise CancelledError("stopped")

    with pytest.raises(CancelledError):
        write_overlay_video(track, sequence, path, stop)
    sequence.views[1].images.read = _refuse
    with pytest.raises(InputError, match="frame 0 is damaged"):
        write_overlay_video(track, sequence, path)
    assert [each.name for each in tmp_path.iterdir()] == ["overlay.mp4"]
    assert path.read_bytes() == b"an older one"


def _refuse(index):
    raise InputError(f"frame {index} is damaged")


def test_three_views_of_odd_size_and_names_of_any_kind(tmp_path):
    sequence, track = overlay_case(2, pixels=121, angles=(0.0, 40.0, 90.0))
    hostile = ("$\\frac{1}$", "<b>\ud800", "n" * 300)
    structures = dataclasses.replace(sequence.structures, names=hostile)
    sequence = dataclasses.replace(sequence, structures=structures, reference=hostile[0])
    track = dataclasses.replace(track, names=hostile, reference=hostile[0], distrust=("lost",), smoothed=True)
    write_overlay_video(track, sequence, tmp_path / "a.mp4")
    with av.open(str(tmp_path / "a.mp4")) as film:
        stream = film.streams.video[0]
        assert stream.width % 2 == stream.height % 2 == 0 and stream.width > 3 * 360
        assert sum(1 for _ in film.decode(stream)) == 2


def test_large_x_rays_are_shown_smaller(without_names):
    sequence, track = overlay_case(1, pixels=1500)
    frames = OverlayFrames(track, sequence)
    assert (frames.height, frames.width) == (720 + 2 * STRIP, 2 * 720 + 6)
    picture = frames.picture(track.frames[0])
    assert (
        coloured(picture[:, :720], "moving").sum() > 300 and coloured(picture[:, 726:], "moving").sum() > 300
    )


def test_what_does_not_fit_is_refused(tmp_path, monkeypatch):
    sequence, track = overlay_case(2)
    with pytest.raises(InputError, match=r"written as \.mp4"):
        write_overlay_video(track, sequence, tmp_path / "overlay.avi")
    with pytest.raises(InputError, match="other structures or cameras"):
        write_overlay_video(dataclasses.replace(track, names=("a", "b", "c")), sequence, tmp_path / "a.mp4")
    with pytest.raises(InputError, match="holds no frame"):
        write_overlay_video(dataclasses.replace(track, frames=()), sequence, tmp_path / "a.mp4")
    small = dataclasses.replace(sequence.views[0].camera, height=60)
    odd = dataclasses.replace(track, cameras={**track.cameras, "view 1": small})
    with pytest.raises(InputError, match='image of "view 1" in frame 0'):
        write_overlay_video(odd, sequence, tmp_path / "a.mp4")
    monkeypatch.setitem(__import__("sys").modules, "av", None)
    with pytest.raises(InputError, match="pip install av"):
        write_overlay_video(track, sequence, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_pictures_of_another_size_are_no_part_of_a_film(tmp_path):
    with FilmWriter(tmp_path / "a.mp4", 40, 60, 10.0) as film:
        film.add(np.zeros((40, 60, 3), np.uint8))
        with pytest.raises(ValueError, match="40, 60, 3"):
            film.add(np.zeros((60, 40, 3), np.uint8))


def test_builds_without_h264_write_mpeg4(tmp_path, monkeypatch):
    from PolyPoseLib.io.tracking import film_writer

    monkeypatch.setattr(film_writer, "_ENCODERS", (("no_such_encoder", {}), *film_writer._ENCODERS[1:]))
    with FilmWriter(tmp_path / "a.mp4", 40, 60, 12.5) as film:
        for level in (0, 120, 240):
            film.add(np.full((40, 60, 3), level, np.uint8))
    with av.open(str(tmp_path / "a.mp4")) as film:
        assert film.streams.video[0].codec_context.name == "mpeg4"
        levels = [frame.to_ndarray(format="gray").mean() for frame in film.decode(video=0)]
    np.testing.assert_allclose(levels, [0, 120, 240], atol=12)
