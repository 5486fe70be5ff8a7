"""Poses for Autoscoper, against what its ray caster does with them, and its own reading of a line."""

import numpy as np
import pytest
from result_case import random_pose
from track_case import make_track, write_sequence

import PolyPoseLib as pp
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.tracking.autoscoper import is_mirrored, volume_to_ct, write_tra
from PolyPoseLib.io.tracking.sequences import load_sequence


def sampled_by_autoscoper(stack, spacing, point):
    """The voxel (page, row, column), as real numbers, that Autoscoper shows at a point of its volume.

    After its ray caster: the volume is a box from (0, 0, -1) to (1, 1, 0), of which the texture's normalised
    coordinates are (x, 1 - y, -z), so that a voxel's centre is half a voxel from its faces.
    """
    pages, rows, columns = stack.shape
    box = point / (np.array([columns, rows, pages]) * spacing)
    texture = np.array([box[0], 1 - box[1], -box[2]])
    column, row, page = texture * [columns, rows, pages] - 0.5
    return np.array([page, row, column])


@pytest.mark.parametrize("signs", [(1, 1, 1), (-1, -1, 1), (1, -1, -1), (-1, 1, 1), (1, 1, -1), (-1, -1, -1)])
def test_every_voxel_is_where_autoscoper_shows_it(signs):
    rng = np.random.default_rng(0)
    spacing = np.array([0.7, 0.9, 1.3])
    affine = np.eye(4)
    affine[:3, :3] = random_pose(rng)[:3, :3] @ np.diag(np.array(signs) * spacing)
    affine[:3, 3] = rng.uniform(-100, 100, 3)
    ct = Volume(rng.random((5, 6, 7)), affine)
    motion = volume_to_ct(ct)
    assert np.allclose(motion[:3, :3] @ motion[:3, :3].T, np.eye(3)) and np.linalg.det(motion[:3, :3]) > 0
    assert is_mirrored(ct) == (np.prod(signs) < 0)
    stack = ct.voxels[::-1] if is_mirrored(ct) else ct.voxels
    for k, j, i in [(0, 0, 0), (4, 5, 6), (1, 3, 2), (3, 0, 6)]:
        in_volume = np.linalg.inv(motion) @ [*ct.to_world(np.array([i, j, k])), 1]
        found = sampled_by_autoscoper(stack, spacing, in_volume[:3])
        assert found == pytest.approx(np.rint(found), abs=1e-9)
        assert stack[tuple(np.rint(found).astype(int))] == ct.voxels[k, j, i]


def read_by_autoscoper(path):
    """Its reading with type Matrix, orientation Row, separator Comma, mm: {frame: (4, 4)}, nothing for NaN."""
    poses = {}
    for number, line in enumerate(path.read_text().splitlines()):
        cells = line.split(",")
        if not cells[-1].startswith("NaN"):
            poses[number] = np.array([float(cell) for cell in cells]).reshape(4, 4)
    return poses


def test_a_bones_voxel_lies_in_the_world_where_the_track_has_it(tmp_path):
    sequence = load_sequence(write_sequence(tmp_path / "walk"))
    track = make_track(4, frames=3, first=2)
    folder = pp.save_track(track, tmp_path / "out", sequence)
    spacing = sequence.ct.spacing
    for k, name in enumerate(track.names):
        poses = read_by_autoscoper(folder / f"{name}.tra")
        lines = (folder / f"{name}.tra").read_text().splitlines()
        assert len(lines) == sequence.available and lines[0] == ",".join(["NaN"] * 16)
        assert list(poses) == [each.frame for each in track.frames if each.sources[k] != "none"]
        for frame in track.frames:
            if frame.frame not in poses:
                continue
            column, row, page = 3, 4, 2
            height = sequence.ct.shape[1]
            in_volume = [
                (column + 0.5) * spacing[0],
                (height - row - 0.5) * spacing[1],
                -(page + 0.5) * spacing[2],
                1,
            ]
            world = poses[frame.frame] @ in_volume
            in_ct = frame.poses[k] @ world
            assert in_ct[:3] == pytest.approx(sequence.ct.to_world(np.array([column, row, page])), abs=1e-9)


def test_a_volume_that_was_cut_out_takes_the_corner_that_the_page_says():
    rng = np.random.default_rng(5)
    whole, (sx, sy, sz), (a, b, c) = rng.random((9, 10, 11)), (0.4, 0.5, 0.6), (3, 2, 4)
    part = whole[c:8, 1 : 10 - b, a:9]
    corner = np.eye(4)
    corner[:3, 3] = a * sx, b * sy, -c * sz
    spacing = np.array([sx, sy, sz])
    for point in rng.uniform([0.1, 0.1, -1.5], [1.9, 2.9, -0.1], (20, 3)):
        in_part = sampled_by_autoscoper(part, spacing, point)
        in_whole = sampled_by_autoscoper(whole, spacing, (corner @ [*point, 1])[:3])
        assert in_whole == pytest.approx(np.add(in_part, [c, 1, a]))


def test_numbers_are_written_in_full_and_without_exponents(tmp_path):
    pose = random_pose(np.random.default_rng(3))
    pose[0, 0] = 1e-9
    write_tra(tmp_path / "x.tra", {1: pose}, 3)
    text = (tmp_path / "x.tra").read_text()
    assert "e" not in text.lower().replace("nan", "") and text.count("\n") == 3
    assert read_by_autoscoper(tmp_path / "x.tra")[1] == pytest.approx(pose, abs=1e-15)
