"""Surfaces of labels, and where slices cut them."""

import numpy as np
import pytest

from PolyPoseLib.carrying import surfaces
from PolyPoseLib.data.volume import Volume

pytest.importorskip("vtkmodules")

CENTRE, RADIUS = np.array([4.0, -7.0, 12.0]), 15.0


def ball(spacing=(1.0, 1.0, 1.0)):
    """A ball in a grid of any signed spacing: label 3."""
    spacing = np.array(spacing)
    size = np.ceil(44 / np.abs(spacing)).astype(int)
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = CENTRE - spacing * (size - 1) / 2
    index = np.stack(np.meshgrid(*map(np.arange, size[::-1]), indexing="ij"), axis=-1)[..., ::-1]
    volume = Volume(np.zeros(tuple(size[::-1]), np.int16), affine)
    inside = np.linalg.norm(volume.to_world(index) - CENTRE, axis=-1) < RADIUS
    return volume.with_voxels(3 * inside.astype(np.int16))


def enclosed(surface):
    """Volume by the divergence theorem; negative when normals point inwards."""
    a, b, c = (surface.points[surface.triangles[:, n]].astype(float) - CENTRE for n in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize("spacing", [(1, 1, 1), (-1, 1, 1), (1, -1, 2), (-0.5, -0.5, -0.5), (3, 3, 3)])
def test_a_ball_keeps_its_volume_and_faces_outwards_on_any_grid(spacing):
    labels = ball(spacing)
    (surface,) = surfaces.surfaces_of(labels, [3])
    voxels = np.count_nonzero(labels.voxels) * np.prod(labels.spacing)
    assert enclosed(surface) == pytest.approx(voxels, rel=0.05 if labels.spacing.max() < 3 else 0.12)
    edges = np.sort(surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    assert (uses == 2).all(), "the surface is closed"


@pytest.mark.parametrize("axis", range(3))
def test_a_slice_cuts_a_ball_in_a_circle(axis):
    (surface,) = surfaces.surfaces_of(ball(), [3])
    for off in (-10.0, 0.1, 6.3):
        (line,) = surface.cut(axis, CENTRE[axis] + off)
        np.testing.assert_array_equal(line[0], line[-1])
        np.testing.assert_allclose(line[:, axis], CENTRE[axis] + off, atol=1e-5)
        np.testing.assert_allclose(np.linalg.norm(line - CENTRE, axis=-1), RADIUS, atol=1.0)
        steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        assert steps.max() < 2.0
        circle = 2 * np.pi * np.sqrt(RADIUS**2 - off**2)
        assert steps.sum() == pytest.approx(circle, rel=0.08), "it goes round once"
    assert not surface.cut(axis, CENTRE[axis] + RADIUS + 3)


@pytest.mark.parametrize("axis", range(3))
def test_a_slice_through_vertices_keeps_whole_lines(axis):
    (surface,) = surfaces.surfaces_of(ball(), [3])
    heights = surface.points[:, axis]
    for height in np.unique(heights)[[40, 200, -40]]:
        lines = surface.cut(axis, float(height))
        assert lines
        assert all((line[0] == line[-1]).all() for line in lines)


def test_a_surface_with_a_rim_is_cut_in_open_lines():
    strip = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 2), (1, 0, 2), (2, 0, 2)], np.float32)
    triangles = np.array([(0, 1, 3), (1, 4, 3), (1, 2, 4), (2, 5, 4)], np.int32)
    (line,) = surfaces.Surface(strip, triangles).cut(2, 1.0)
    order = line if line[0, 0] < line[-1, 0] else line[::-1]
    np.testing.assert_allclose(order, [(0, 0, 1), (0.5, 0, 1), (1, 0, 1), (1.5, 0, 1), (2, 0, 1)])


def test_a_label_without_voxels_has_no_triangles():
    (surface,) = surfaces.surfaces_of(ball(), [7])
    assert not len(surface.triangles)
    assert not surface.cut(0, 0.0)


def test_voxels_are_put_together_where_there_are_too_many_triangles(monkeypatch):
    (fine,) = surfaces.surfaces_of(ball((0.5, 0.5, 0.5)), [3])
    monkeypatch.setattr(surfaces, "MOST_TRIANGLES", len(fine.triangles) // 2)
    (coarse,) = surfaces.surfaces_of(ball((0.5, 0.5, 0.5)), [3])
    assert 100 < len(coarse.triangles) <= len(fine.triangles) // 2
    assert enclosed(coarse) == pytest.approx(4 / 3 * np.pi * RADIUS**3, rel=0.12)
