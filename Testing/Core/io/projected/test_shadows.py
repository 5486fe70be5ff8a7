"""Where points and surfaces fall, against the matrices of result.json applied here."""

import csv
import json

import numpy as np
import pytest
import SimpleITK as sitk
from report_case import seen_result

from PolyPoseLib.io.projected.drawing import drawn_xray, free_corners
from PolyPoseLib.io.projected.folder import shown_xrays, write_projections
from PolyPoseLib.io.projected.plan import PlanRegions, PlanSurface, read_plan
from PolyPoseLib.io.projected.shadows import view_shadows
from PolyPoseLib.io.results import load_result


@pytest.fixture
def saved(tmp_path):
    """A result's folder, and its result.json."""
    folder = seen_result(3).save(tmp_path / "result")
    return folder, json.loads((folder / "result.json").read_text())


def by_matrix(camera, points):
    """Pixels by K [R t] of result.json."""
    matrix = np.array(camera["K"]) @ np.array(camera["extrinsic"])[:3]
    image = np.c_[points, np.ones(len(points))] @ matrix.T
    return image[:, :2] / image[:, 2:]


def in_femur(result, count=20):
    labels = result.structure_labels
    index = np.argwhere(labels.voxels == 2)[:, ::-1]
    return labels.to_world(np.random.default_rng(0).permutation(index)[:count])


def write_points(path, labels, points):
    rows = ["label,x,y,z", *(f"{n},{x},{y},{z}" for n, (x, y, z) in zip(labels, points, strict=True))]
    path.write_text("\n".join(rows) + "\n")
    return path


def test_points_of_a_bone_fall_where_its_matrix_and_the_cameras_put_them(tmp_path, saved):
    folder, fields = saved
    result = load_result(folder)
    points = in_femur(result)
    plan = write_points(tmp_path / "plan.csv", range(len(points)), points)
    (tmp_path / "out").mkdir()
    parts = read_plan(result, plan)
    assert write_projections(result, parts, shown_xrays(result, folder), tmp_path / "out") == []
    with (tmp_path / "out" / "points.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    moved = np.linalg.inv(fields["structures"]["femur"]["fixed_to_moving"])
    expected = points @ moved[:3, :3].T + moved[:3, 3]
    for n, camera in enumerate(fields["cameras"]):
        found = [each for each in rows if each["view"] == camera["name"]]
        assert [each["label"] for each in found] == [str(k) for k in range(len(points))]
        told = np.array([[float(each["column_px"]), float(each["row_px"])] for each in found])
        assert np.abs(told - by_matrix(camera, expected)).max() < 1e-3
        assert {each["moved_by"] for each in found} == {"femur"}
        assert all(
            0 < float(each["half_axis_95_minor_px"]) <= float(each["half_axis_95_major_px"]) for each in found
        )
        picture = sitk.ReadImage(str(tmp_path / "out" / f"xray_{n}.png"))
        assert picture.GetSize()[0] % camera["width"] == 0 and picture.GetNumberOfComponentsPerPixel() == 3


def test_points_behind_the_source_and_beside_the_picture_are_named_and_not_drawn(tmp_path, saved):
    folder, _ = saved
    result = load_result(folder)
    first = result.cameras[0].camera
    behind, beside, seen = first.source - 30 * first.axis, (300.0, 0, 0), in_femur(result, 1)[0]
    plan = write_points(tmp_path / "plan.csv", ("behind", "beside", "seen"), (behind, beside, seen))
    shadows = view_shadows(result.cameras[0], read_plan(result, plan))
    assert [each.where for each in shadows.points] == [
        "behind the source",
        "beside the picture",
        "in the picture",
    ]
    assert [each.drawn for each in shadows.points] == [False, False, True]
    assert len(shadows.sentences) == 2
    assert '"behind" lies behind the source of X-ray "view 1"' in shadows.sentences[0]
    assert '"beside" falls beside X-ray "view 1" (column' in shadows.sentences[1]
    many = write_points(tmp_path / "many.csv", range(100), np.tile(beside, (100, 1)))
    sentences = view_shadows(result.cameras[0], read_plan(result, many)).sentences
    assert len(sentences) == 21 and sentences[-1].startswith("80 more points")


def sphere(centre, radius):
    """A closed surface: an octahedron, divided and blown up."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
    faces = np.array([[a, b, c] for a in (0, 1) for b in (2, 3) for c in (4, 5)])
    for _ in range(5):
        corners = points[faces]
        middles = (corners + np.roll(corners, -1, axis=1)) / 2
        a, b, c = np.swapaxes(corners, 0, 1)
        ab, bc, ca = np.swapaxes(middles, 0, 1)
        points = np.concatenate(
            [np.stack(each, axis=1) for each in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
        faces = np.arange(3 * len(points)).reshape(-1, 3)
        points = points.reshape(-1, 3)
    return centre + radius * points / np.linalg.norm(points, axis=1, keepdims=True), faces


@pytest.mark.parametrize("seed", range(4))
def test_a_surface_is_drawn_by_the_edge_of_its_shadow(seed):
    rng = np.random.default_rng(seed)
    view = seen_result(seed).cameras[seed % 2]
    centre, radius = rng.uniform(-15, 15, 3), rng.uniform(8, 20)
    shadows = view_shadows(view, [PlanSurface("ball", *sphere(centre, radius))])
    (outline,) = shadows.outlines
    (line,) = outline.polygons
    rays = np.c_[line, np.ones(len(line))] @ np.linalg.inv(view.intrinsics).T @ view.extrinsic[:3, :3]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    to_ball = centre - view.camera.source
    passed = np.linalg.norm(to_ball - (rays @ to_ball)[:, None] * rays, axis=1)
    pixel_mm = 700 / view.intrinsics[0, 0]
    assert np.abs(passed - radius).max() < 0.6 * pixel_mm and not shadows.sentences


def test_surfaces_and_regions_that_do_not_show_are_named():
    view = seen_result(0).cameras[0]
    source, axis = view.camera.source, view.camera.axis
    vertices, triangles = sphere(source, 10.0)
    for centre, words in (
        (source - 40 * axis, '"ball" lies behind the source'),
        (source, '% of "ball" lies behind the source'),
        (source + 700 * axis + 5000 * view.extrinsic[0, :3], '"ball" does not show in X-ray "view 1"'),
    ):
        shadows = view_shadows(view, [PlanSurface("ball", vertices - source + centre, triangles)])
        assert len(shadows.sentences) == 1 and words in shadows.sentences[0]
    labels = seen_result(0).structure_labels
    shadows = view_shadows(view, [PlanRegions(("pelvis", "femur", "absent"), labels)])
    assert [each.name for each in shadows.outlines] == ["pelvis", "femur"]
    assert len(shadows.sentences) == 1 and '"absent" does not show' in shadows.sentences[0]


def test_a_surface_and_the_region_that_it_encloses_have_one_outline():
    view = seen_result(1).cameras[1]
    size = 60
    labels = seen_result(1).structure_labels
    affine = np.diag([1.0, 1, 1, 1])
    affine[:3, 3] = -(size - 1) / 2
    index = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij")[::-1], axis=-1)
    ball = np.linalg.norm(index + affine[:3, 3] - (3, -4, 5), axis=-1) <= 18
    region = PlanRegions(("ball",), type(labels)(ball.astype(np.int16), affine))
    both = view_shadows(view, [PlanSurface("ball", *sphere(np.array([3.0, -4, 5]), 18.0)), region]).outlines
    boxes = [np.r_[each.polygons[0].min(axis=0), each.polygons[0].max(axis=0)] for each in both]
    assert np.abs(boxes[0] - boxes[1]).max() < 1.0


@pytest.mark.parametrize("seed", range(8))
def test_names_do_not_hide_each_other_where_there_is_room(seed):
    rng = np.random.default_rng(seed)
    places = list(rng.uniform((5, 5), (395, 295), (10, 2)))
    boxes = [(float(rng.uniform(20, 90)), 10.0) for _ in places]
    corners = free_corners(places, boxes, 4.0, ((0, 400), (0, 300)))
    spans = [(x, x + w, y - h, y) for (x, y), (w, h) in zip(corners, boxes, strict=True)]
    for n, (a0, a1, b0, b1) in enumerate(spans):
        assert a0 >= 0 and a1 <= 400 and b0 >= 0 and b1 <= 300
        assert all(a0 >= c1 or a1 <= c0 or b0 >= d1 or b1 <= d0 for c0, c1, d0, d1 in spans[:n])


@pytest.mark.parametrize("name", ["$\\frac$", "\ud800", "a\nb\x1b", "骨盤", "x" * 500])
def test_hard_labels_are_drawn(name):
    result = seen_result(0)
    view = result.cameras[0]
    vertices, triangles = sphere(np.zeros(3), 12.0)
    shadows = view_shadows(view, [PlanSurface(name, vertices, triangles)])
    plain = drawn_xray(result.xray_images[0], view_shadows(view, []), name)
    drawn = drawn_xray(result.xray_images[0], shadows, name, "NOT TO BE TRUSTED")
    assert drawn.shape == plain.shape and drawn.dtype == np.uint8
    assert (np.abs(drawn.astype(int) - plain).max(axis=-1) > 60).sum() > 500
