"""Plots of joints: what matplotlib was told to draw, and the files."""

import dataclasses
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from joint_case import random_rigid, rigid, sequence_of, track_of
from matplotlib.collections import PolyCollection
from matplotlib.image import imread
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking.plots import draw_motion, write_plots
from PolyPoseLib.kinematics.joint_motions import joint_motions

SPREAD = np.diag([1e-5] * 3 + [0.04] * 3)
HOSTILE = "../knee $\\frac{1}$ <b>\ud800\n/"


def case(frames=20, name="knee", convention="grood_suntay", covariances=SPREAD, **track):
    rng = np.random.default_rng(1)
    start = random_rigid(rng, 5)
    poses = [
        [np.eye(4), rigid(Rotation.from_rotvec([0.02 * n, 0, 0]), (0, 0.1 * n, 0)) @ start]
        for n in range(frames)
    ]
    sequence = sequence_of([Joint(name, "upper", "lower", convention, "right")])
    found = track_of(sequence, poses, covariances, **track)
    return found, joint_motions(found, sequence)


def test_curves_and_bands_are_the_motion():
    track, (motion,) = case()
    figure = draw_motion(track, motion)
    places = np.array(figure.axes).reshape(3, 2)
    for column, (values, halves) in enumerate(
        ((motion.angles_deg, motion.angles_95_deg), (motion.translations_mm, motion.translations_95_mm))
    ):
        for row in range(3):
            place = places[row, column]
            times, drawn = place.lines[0].get_data()
            np.testing.assert_allclose(times, motion.seconds)
            np.testing.assert_allclose(drawn, values[:, row])
            (band,) = [each for each in place.collections if isinstance(each, PolyCollection)]
            corners = band.get_paths()[0].vertices
            for n, time in enumerate(motion.seconds):
                ends = corners[np.abs(corners[:, 0] - time) < 1e-9, 1]
                np.testing.assert_allclose(ends.min(), values[n, row] - halves[n, row], atol=1e-9)
                np.testing.assert_allclose(ends.max(), values[n, row] + halves[n, row], atol=1e-9)
            low, high = place.get_ylim()
            assert (
                low < (values[:, row] - halves[:, row]).min()
                and (values[:, row] + halves[:, row]).max() < high
            )
    texts = " ".join(text.get_text() for text in figure.texts)
    assert "lower relative to upper" in texts and "principal axes of inertia" in texts
    titles = [place.get_title(loc="left") for place in figure.axes]
    assert titles[0].startswith("flexion (deg); positive: ") and titles[1].startswith(
        "lateral (mm); positive: "
    )


def test_doubtful_frames_are_shaded_and_dotted_and_gimbal_lock_is_said():
    doubts = [((), ("jump",) if n in (3, 4, 9) else ()) for n in range(20)]
    track, (motion,) = case(doubts=doubts)
    plain = draw_motion(*_parts(case()))
    figure = draw_motion(track, motion)
    for place, other in zip(figure.axes, plain.axes, strict=True):
        assert len(place.patches) == len(other.patches) + 2
        times, _ = place.lines[1].get_data()
        np.testing.assert_allclose(times, motion.seconds[[3, 4, 9]])
        spans = sorted((each.get_x(), each.get_x() + each.get_width()) for each in place.patches)
        np.testing.assert_allclose(spans, [(0.05, 0.09), (0.17, 0.19)], atol=1e-9)
    locked = dataclasses.replace(motion, locked=np.arange(20) == 5)
    shaded = draw_motion(track, locked)
    extra = [len(a.patches) - len(b.patches) for a, b in zip(shaded.axes, figure.axes, strict=True)]
    assert extra == [1, 0, 0, 0, 1, 0]  # the first and the third angle
    assert any("gimbal lock" in text.get_text() for text in shaded.texts)


def _parts(made):
    track, (motion,) = made
    return track, motion


def test_an_endless_band_does_not_flatten_the_curve():
    track, (motion,) = case()
    wide = motion.angles_95_deg.copy()
    wide[7] = np.inf
    wide[8] = 170
    figure = draw_motion(track, dataclasses.replace(motion, angles_95_deg=wide))
    low, high = figure.axes[0].get_ylim()
    span = np.ptp(motion.angles_deg[:, 0])
    assert high - low < 3.6 * span and high > motion.angles_deg[:, 0].max()


def test_files_are_whole_pictures_and_the_same_every_time(tmp_path):
    track, motions = case(12)
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        assert write_plots(track, motions, folder) == ["joint_1_knee.png", "joint_1_knee.svg"]
    picture = imread(tmp_path / "a" / "joint_1_knee.png")
    assert picture.shape[:2] == (984, 1440) and picture[..., :3].std() > 0.05
    text = (tmp_path / "a" / "joint_1_knee.svg").read_text("utf-8")
    assert ElementTree.fromstring(text).tag.endswith("svg") and "dc:date" not in text
    assert text == (tmp_path / "b" / "joint_1_knee.svg").read_text("utf-8")


def test_names_are_text_whatever_they_hold_and_files_stay_in_the_folder(tmp_path):
    folder = tmp_path / "plots"
    folder.mkdir()
    track, motions = case(6, name=HOSTILE)
    track = dataclasses.replace(track, distrust=("no overlap",), smoothed=True)
    names = write_plots(track, [*motions, *motions], folder)
    assert len(set(names)) == 4 and sorted(each.name for each in folder.iterdir()) == sorted(names)
    assert all(name.isascii() and "/" not in name and ".." not in name for name in names)
    assert [each.name for each in tmp_path.iterdir()] == ["plots"]
    texts = " ".join(text.get_text() for text in draw_motion(track, motions[0]).texts)
    assert "$\\frac{1}$ <b>" in texts and "NOT TO BE TRUSTED" in texts and "smoothed" in texts


@pytest.mark.parametrize("kind", ["one frame", "lost", "no interval", "single frame"])
def test_little_is_drawn_too(tmp_path, kind):
    sources = [("forward", "none")] * 5 if kind == "lost" else None
    if kind == "single frame":
        sources = [("forward", "forward" if n in (0, 3) else "none") for n in range(5)]
    spread = np.full((6, 6), np.nan) if kind == "no interval" else SPREAD
    track, motions = case(1 if kind == "one frame" else 5, covariances=spread, sources=sources)
    write_plots(track, motions, tmp_path)
    figure = draw_motion(track, motions[0])
    place = figure.axes[0]
    if kind == "lost":
        assert "lost in every frame" in [text.get_text() for text in place.texts]
    else:
        low, high = place.get_ylim()
        known = motions[0].angles_deg[np.isfinite(motions[0].angles_deg[:, 0]), 0]
        assert low < known.min() and known.max() < high and np.isfinite([low, high]).all()
    if kind in ("one frame", "single frame"):
        assert place.lines[0].get_marker() == "o"


def test_matplotlib_is_asked_for(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(InputError, match="pip install matplotlib"):
        draw_motion(*_parts(case(3)))
