"""What is timed: the public pelvis, and a phantom of any size with any number of bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from benchmark_cases import DISTANCES_MM, STRUCTURES, load_anatomy
from scipy.ndimage import zoom

from PolyPoseLib.baselines.published.method import attenuation_grid, view_of
from PolyPoseLib.baselines.published.objective import PolyrigidObjective
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.registration.fit.levels import Level, Observation
from PolyPoseLib.registration.fit.problem import RigidProblem, State
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.fit.views import LevelViews
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.simulation.simulate import structures_centre, view_cameras
from PolyPoseLib.warp.polyrigid import PolyrigidWarp
from PolyPoseLib.warp.weights import distance_maps

PHANTOM_MM = 320.0
"""Side of the phantom, whatever its voxels."""


@dataclass(frozen=True)
class Setting:
    """A CT (HU) with structures, the first of which is the anchor, cameras, and poses' parameters (K, 6)."""

    ct: Volume
    structures: Structures
    cameras: list[Camera]
    parameters: np.ndarray


def pelvis(views: int = 2, pixels: int = 200, count: int = 6) -> Setting:
    """The public pelvis with its first ``count`` structures, and views 30 degrees apart."""
    ct, structures, _, _ = load_anatomy("pelvis")
    labels = np.where(structures.labels <= count, structures.labels, 0).astype(np.int16)
    structures = Structures(tuple(STRUCTURES["pelvis"])[:count], labels)
    to_detector, to_isocenter = DISTANCES_MM["pelvis"]
    cameras = view_cameras(
        ct,
        [30.0 * n for n in range(views)],
        pixels,
        source_to_detector_mm=to_detector,
        source_to_isocenter_mm=to_isocenter,
        isocenter=structures_centre(structures, ct.affine),
    )
    return Setting(ct, structures, cameras, some_parameters(count))


def phantom(
    views: int = 2, pixels: int = 200, count: int = 6, shape: tuple[int, int, int] = (128, 128, 128)
) -> Setting:
    """Rods of bone in a grid, in a textured body of PHANTOM_MM a side."""
    rng = np.random.default_rng(0)
    coarse = rng.normal(40, 60, (16, 16, 16))
    hu = zoom(coarse, np.array(shape) / 16, order=1).astype(np.float32)
    labels = np.zeros(shape, np.int16)
    across = int(np.ceil(np.sqrt(count)))
    for n in range(count):
        cell = [slice(int(s * 0.2), int(s * 0.8)) for s in shape[:1]]
        for size, place in zip(shape[1:], divmod(n, across), strict=True):
            width = 0.8 / across
            low = 0.1 + width * place
            cell.append(slice(int(size * (low + 0.2 * width)), int(size * (low + 0.8 * width))))
        labels[tuple(cell)] = n + 1
        hu[tuple(cell)] = 800 + 30 * n
    affine = np.eye(4)
    affine[:3, :3] = np.diag(PHANTOM_MM / np.array(shape[::-1]))
    ct = Volume(hu, affine)
    names = tuple(f"bone_{n + 1}" for n in range(count))
    angles = [30.0 * n for n in range(views)]
    return Setting(ct, Structures(names, labels), view_cameras(ct, angles, pixels), some_parameters(count))


def some_parameters(count: int) -> np.ndarray:
    """Motions of a few degrees and mm; the anchor rests."""
    parameters = np.random.default_rng(1).normal(size=(count, 6)) * ([0.05] * 3 + [3.0] * 3)
    parameters[0] = 0
    return parameters


def regular_grid(ct: Volume, spacing_mm: float) -> Grid:
    """The CT's attenuation (1/mm) on voxels of exactly ``spacing_mm``, without a border."""
    grid = attenuation_grid(ct, None)
    mu = grid.voxels[1:-1, 1:-1, 1:-1]
    factors = ct.spacing / spacing_mm
    shape = np.round(np.array(mu.shape) * factors[::-1]).astype(int)
    axes = [(np.arange(n) + 0.5) / f - 0.5 for n, f in zip(shape, factors[::-1], strict=True)]
    from scipy.ndimage import map_coordinates

    index = np.meshgrid(*axes, indexing="ij")
    voxels = map_coordinates(mu, index, order=1, mode="nearest").astype(np.float32)
    affine = ct.affine.copy()
    affine[:3, :3] = ct.affine[:3, :3] / factors
    affine[:3, 3] = ct.affine[:3, 3] + ct.affine[:3, :3] @ ((1 / factors - 1) / 2)
    return Grid(voxels, affine)


def weight_field(setting: Setting) -> PolyrigidWarp:
    """The paper's weights, about the anchor's centroid."""
    scene = Scene(setting.ct, setting.structures, setting.structures.names[0])
    maps = distance_maps(setting.structures, setting.ct.affine)
    return SoftTissue(scene, "fixed", "mass").warp(maps, scene.rest_poses)


def quiet_run(setting: Setting, backend: Backend) -> Run:
    """A run that reports to nobody."""
    scene = Scene(setting.ct, setting.structures, setting.structures.names[0])
    return Run(SoftTissue(scene), backend, Monitor(None, None))


def paper_objective(
    setting: Setting, grid: Grid, warp: PolyrigidWarp, step_mm: float, backend: Backend
) -> PolyrigidObjective:
    """The paper's objective, with X-rays of the CT at rest as targets."""
    run = quiet_run(setting, backend)
    blank = [
        Observation(np.zeros((c.height, c.width), np.float32), np.ones((c.height, c.width), bool), c)
        for c in setting.cameras
    ]
    size = max(setting.cameras[0].height, setting.cameras[0].width)
    first = PolyrigidObjective(run, grid, warp, [view_of(each, size) for each in blank], step_mm)
    rest = np.zeros_like(setting.parameters)
    seen = [
        view_of(Observation(projector.image(rest), each.mask, each.camera), size)
        for projector, each in zip(first.projectors, blank, strict=True)
    ]
    return PolyrigidObjective(run, grid, warp, seen, step_mm)


def bone_problem(setting: Setting, size_mm: float, backend: Backend) -> tuple[RigidProblem, State]:
    """The default's least-squares problem for one level, all bones but the anchor free."""
    run = quiet_run(setting, backend)
    observations = []
    for camera in setting.cameras:
        image = np.random.default_rng(0).random((camera.height, camera.width)).astype(np.float32)
        observations.append(Observation(image, np.ones(image.shape, bool), camera))
    problem = LevelViews(run, observations, Level(size_mm, 14.0, 1)).structures(run.scene.moving)
    return problem, State.of_poses(run.scene.rest_poses, len(observations))
