"""The scene in three dimensions as meshes, which vtk.js draws in the browser: bones, C-arms with X-rays, points."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np

from PolyPoseLib.carrying.surfaces import Surface
from PolyPoseLib.data.carried import CHI2_95
from PolyPoseLib.geometry.camera import Camera, review_camera
from PolyPoseLib.geometry.grid import block_mean
from PolyPoseLib.viewer.content import Bone, Content, View
from PolyPoseLib.viewer.pictures import windowed

PICTURE_SIDE = 220
"""Longer side in pixels of an X-ray's picture in the scene; less where there are many."""

BEHIND_MM = 60.0
"""A detector whose distance is not known is drawn so far behind the CT."""

SOURCE_RADIUS_MM = 9.0
MOST_ELLIPSOIDS = 300
LETTER_MM = 26.0
VIEW_ANGLE_DEG = 30.0

Mesh = dict[str, Any]
"""A mesh as the page's vtk-mesh element takes it."""


def bone_mesh(bone: Bone) -> Mesh:
    """The surface of a bone in its own frame."""
    mesh = _mesh(bone.surface.points, polygons=bone.surface.triangles)
    mesh["pointArrays"] = [{
        "name": "Normals", "values": _encoded(_normals(bone.surface)), "numberOfComponents": 3, "type": "Float32Array",
        "registration": "setNormals",
    }]  # fmt: skip
    return mesh


def pose_between(bone: Bone, share: float) -> list[float]:
    """16 numbers, column by column, of a bone's motion carried out in part.

    `share` 0 is the CT's posture and 1 that of the X-rays; between them the bone turns evenly about its middle, which
    moves along a line.
    """
    from scipy.spatial.transform import Rotation

    centre = bone.surface.points.mean(axis=0, dtype=np.float64) if len(bone.surface.points) else np.zeros(3)
    vector = Rotation.from_matrix(bone.motion[:3, :3]).as_rotvec()
    rotation = Rotation.from_rotvec(share * vector).as_matrix()
    shift = bone.motion[:3, :3] @ centre + bone.motion[:3, 3] - centre
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = centre + share * shift - rotation @ centre
    return pose.T.ravel().tolist()


def detector_depth(view: View, content: Content) -> float:
    """Distance of a view's detector from its source in mm; behind the CT where it is not known."""
    if view.detector_mm is not None:
        return view.detector_mm
    return float(view.camera.camera.depth(content.result.warped_ct.corners()).max()) + BEHIND_MM


def detector_mesh(view: View, depth: float, views: int) -> Mesh:
    """The picture of a view on its detector, as coloured squares."""
    picture = view.rendering if view.xray is None else view.xray
    side = int(PICTURE_SIDE / max(1.0, views / 4) ** 0.5)
    camera, factor = review_camera(view.camera.camera, side)
    height, width = camera.height * factor, camera.width * factor
    small = block_mean(np.asarray(picture, np.float32)[None, :height, :width], (factor, factor, 1))[0]
    low, high = np.percentile(small, (1, 99.5))
    gray = windowed(small, low, high).ravel()
    column, row = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    points = _on_detector(camera, np.stack([column, row], axis=-1).reshape(-1, 2), depth)
    corner = np.arange(gray.size).reshape(camera.height, camera.width)
    squares = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1)
    mesh = _mesh(points, polygons=squares.reshape(-1, 4))
    colours = np.repeat(gray[:, None], 3, axis=1)
    mesh["field"] = {
        "name": "colours", "values": _encoded(colours), "numberOfComponents": 3, "type": "Uint8Array",
        "location": "PointData", "dataRange": [0, 255],
    }  # fmt: skip
    return mesh


def beam_mesh(view: View, depth: float) -> Mesh:
    """Lines from a source to its detector's corners, and around the detector."""
    camera = view.camera.camera
    right, bottom = camera.width - 0.5, camera.height - 0.5
    corners = np.array([(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)])
    points = np.concatenate([camera.source[None], _on_detector(camera, corners, depth)])
    lines = [(0, n) for n in range(1, 5)] + [(n, n % 4 + 1) for n in range(1, 5)]
    return _mesh(points, lines=np.array(lines))


def source_mesh(view: View) -> Mesh:
    """A small ball at a source."""
    points, triangles = _ball()
    return _mesh(view.camera.camera.source + SOURCE_RADIUS_MM * points, polygons=triangles)


def points_mesh(places: np.ndarray, radius_mm: float) -> Mesh:
    """Small balls at points (N, 3)."""
    points, triangles = _ball()
    return _joined([(place + radius_mm * points, triangles) for place in places])


def ellipsoids_mesh(places: np.ndarray, covariances: np.ndarray) -> Mesh:
    """95 % ellipsoids of points (N, 3) with covariances (N, 3, 3); those that are not known are left out."""
    points, triangles = _ball()
    known = np.flatnonzero(np.isfinite(covariances).all(axis=(1, 2)))[:MOST_ELLIPSOIDS]
    values, vectors = np.linalg.eigh(covariances[known])
    roots = vectors * np.sqrt(CHI2_95 * values.clip(min=0))[:, None, :]
    return _joined([(places[n] + points @ root.T, triangles) for n, root in zip(known, roots, strict=True)])


def letters_mesh(low: np.ndarray, high: np.ndarray) -> Mesh:
    """R and L, A and P, S and I around a box: right and left, front and back, head and feet."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter
    from vtkmodules.vtkRenderingFreeType import vtkVectorText

    middle = (low + high) / 2
    reach = (high - low) / 2 + 1.4 * LETTER_MM
    from_front = np.array([(1.0, 0, 0), (0, 0, 1.0)])  # what is right and what is up for who reads the letter
    from_left = np.array([(0, 1.0, 0), (0, 0, 1.0)])
    parts = []
    for letter, axis, sign, axes in (
        ("R", 0, -1, from_front), ("L", 0, 1, from_front), ("S", 2, 1, from_front), ("I", 2, -1, from_front),
        ("A", 1, -1, from_left), ("P", 1, 1, from_left),
    ):  # fmt: skip
        text = vtkVectorText()
        text.SetText(letter)
        triangles = vtkTriangleFilter()
        triangles.SetInputConnection(text.GetOutputPort())
        triangles.Update()
        mesh = triangles.GetOutput()
        flat = vtk_to_numpy(mesh.GetPoints().GetData())[:, :2].astype(np.float64)
        flat = (flat - (flat.min(axis=0) + flat.max(axis=0)) / 2) * LETTER_MM
        place = middle.copy()
        place[axis] += sign * reach[axis]
        cells = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        parts.append((place + flat @ axes, cells))
    return _joined(parts)


def bounds_of(bones: Sequence[Bone]) -> tuple[np.ndarray, np.ndarray]:
    """Box around all bones, at rest and as X-rayed, LPS mm."""
    places = [
        points
        for bone in bones
        if len(bone.surface.points)
        for points in (bone.surface.points, bone.surface.moved(bone.motion).points)
    ]
    if not places:
        return np.full(3, -100.0), np.full(3, 100.0)
    everything = np.concatenate(places).astype(np.float64)
    return everything.min(axis=0), everything.max(axis=0)


def looks(content: Content) -> dict[str, dict[str, Any]]:
    """Places to look from: around the patient, and from every source through its X-ray."""
    low, high = bounds_of(content.bones)
    middle = (low + high) / 2
    radius = float(np.linalg.norm(high - low)) / 2
    # Nearer than any source, which would stand in the way.
    reach = [float(np.linalg.norm(view.camera.camera.source - middle)) for view in content.views]
    distance = min([radius / np.sin(np.radians(VIEW_ANGLE_DEG / 2)), *(0.85 * each for each in reach)])
    angle = 2 * float(np.degrees(np.arcsin(min(radius / distance, 0.7))))
    found = {
        name: _look(middle + np.array(toward, float) * distance, middle, up, angle)
        for name, toward, up in (
            ("front", (0, -1, 0), (0, 0, 1)), ("left", (1, 0, 0), (0, 0, 1)), ("right", (-1, 0, 0), (0, 0, 1)),
            ("head", (0, 0, 1), (0, -1, 0)),
        )
    }  # fmt: skip
    for n, view in enumerate(content.views):
        camera = view.camera.camera
        depth = detector_depth(view, content)
        centre = _on_detector(camera, np.array([[(camera.width - 1) / 2, (camera.height - 1) / 2]]), depth)[0]
        half = (
            depth * max(camera.height / camera.intrinsics[1, 1], camera.width / camera.intrinsics[0, 0]) / 2
        )
        angle = 2 * np.degrees(np.arctan(1.05 * half / np.linalg.norm(centre - camera.source)))
        found[f"xray-{n}"] = _look(camera.source, centre, -camera.extrinsic[1, :3], float(angle))
    return found


def overview(content: Content) -> dict[str, Any]:
    """From beside the beams and a little above, with all bones, sources and detectors in sight."""
    low, high = bounds_of(content.bones)
    places = [low, high]
    beams = np.zeros(3)
    for view in content.views:
        camera = view.camera.camera
        right, bottom = camera.width - 1, camera.height - 1
        corners = np.array([(0, 0), (right, 0), (right, bottom), (0, bottom)], float)
        places += [camera.source, *_on_detector(camera, corners, detector_depth(view, content))]
        beams += camera.axis
    along = _unit(beams, np.array([0.0, 1.0, 0.0]))
    beside = _unit(np.cross((0.0, 0.0, 1.0), along), np.array([1.0, 0.0, 0.0]))
    beside = beside if beside[0] >= 0 else -beside  # from the patient's left rather than the right
    toward = _unit(beside - 0.45 * along + 0.35 * np.array([0.0, 0.0, 1.0]), beside)
    middle = (np.min(places, axis=0) + np.max(places, axis=0)) / 2
    radius = np.linalg.norm(np.array(places) - middle, axis=1).max()
    distance = 0.88 * radius / np.sin(np.radians(VIEW_ANGLE_DEG / 2))
    return _look(middle + toward * distance, middle, (0, 0, 1), VIEW_ANGLE_DEG)


def _unit(vector: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """A vector (3,) of length 1, or another where it has none."""
    length = np.linalg.norm(vector)
    return vector / length if length > 1e-9 else otherwise


def _look(position: np.ndarray, target: np.ndarray, up: Any, angle: float) -> dict[str, Any]:
    return {
        "position": np.asarray(position, float).tolist(), "focalPoint": np.asarray(target, float).tolist(),
        "centerOfRotation": np.asarray(target, float).tolist(), "viewUp": np.asarray(up, float).tolist(),
        "viewAngle": angle,
    }  # fmt: skip


def _on_detector(camera: Camera, pixels: np.ndarray, depth: float) -> np.ndarray:
    """LPS mm (N, 3) of pixels (N, 2) (column, row) on the plane at a depth."""
    homogeneous = np.concatenate([pixels, np.zeros((len(pixels), 1)), np.ones((len(pixels), 1))], axis=1)
    return (homogeneous @ camera.plane_at(depth).T)[:, :3]


def _normals(surface: Surface) -> np.ndarray:
    """(N, 3) float32 unit normals at the vertices, for smooth shading."""
    corners = surface.points[surface.triangles].astype(np.float64)
    faces = np.cross(
        corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    )  # as long as the face is large
    normals = np.zeros((len(surface.points), 3))
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(surface.triangles[:, corner], faces[:, axis], len(surface.points))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return (normals / np.maximum(lengths, 1e-12)).astype(np.float32)


def _ball() -> tuple[np.ndarray, np.ndarray]:
    """Unit vertices (N, 3) and triangles (M, 3) of a ball."""
    rings, columns = 9, 16
    polar, azimuth = np.meshgrid(
        np.linspace(0, np.pi, rings), np.linspace(0, 2 * np.pi, columns, endpoint=False), indexing="ij"
    )
    points = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1
    )
    place = np.arange(rings * columns).reshape(rings, columns)
    next_place = np.roll(place, -1, axis=1)
    upper = np.stack([place[:-1], place[1:], next_place[1:]], axis=-1)
    lower = np.stack([place[:-1], next_place[1:], next_place[:-1]], axis=-1)
    return points.reshape(-1, 3), np.concatenate([upper.reshape(-1, 3), lower.reshape(-1, 3)])


def _joined(parts: Sequence[tuple[np.ndarray, np.ndarray]]) -> Mesh:
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    points = np.concatenate([np.empty((0, 3)), *(points for points, _ in parts)])
    triangles = [cells + start for (_, cells), start in zip(parts, starts[:-1], strict=True)]
    return _mesh(points, polygons=np.concatenate([np.empty((0, 3), int), *triangles]))


def _mesh(points: np.ndarray, polygons: np.ndarray | None = None, lines: np.ndarray | None = None) -> Mesh:
    """Points (N, 3) with cells of equally many corners each."""
    mesh: Mesh = {"points": _encoded(np.asarray(points, np.float32))}
    for name, cells in (("polys", polygons), ("lines", lines)):
        if cells is not None:
            counted = np.empty((len(cells), cells.shape[1] + 1), np.uint32)
            counted[:, 0] = cells.shape[1]
            counted[:, 1:] = cells
            mesh[name] = _encoded(counted)
    return {"mesh": mesh}


def _encoded(array: np.ndarray) -> dict[str, Any]:
    """An array as vue-vtk-js reads it."""
    flat = np.ascontiguousarray(array).ravel()
    return {
        "bvals": base64.b64encode(flat.tobytes()).decode(),
        "dtype": str(flat.dtype),
        "shape": [flat.size],
    }
