"""What an ablation changes: one setting of a simulated case or of the study that is registered, all else as usual."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from benchmark_cases import STRUCTURES, case_folder, fuse, give_true_cameras
from scipy.ndimage import find_objects, zoom
from system_fits import ITERATED

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.grid import grown_box
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.io.volumes import read_volume, write_volume
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.simulation.simulate import SimulationOptions
from PolyPoseLib.simulation.xray_physics import XrayPhysics
from PolyPoseLib.warp.distances import distance_at_voxels

PHOTONS = XrayPhysics().photons
VIEWS_ARC_DEG = 120.0
"""Arc over which the study of the number of views spreads them."""

FINE_MM = 1.0
"""Labels are eroded on voxels no larger than this."""

LEAST_KEPT = 0.1
"""A structure keeps at least its deepest tenth."""

GROUPS: dict[str, dict[int, dict[str, list[str]]]] = {
    "pelvis": {
        3: {
            "femurs": ["femur_left", "femur_right"],
            "lumbar_spine": [f"vertebrae_L{n}" for n in range(5, 0, -1)],
        },
        4: {"lumbar_spine": [f"vertebrae_L{n}" for n in range(5, 0, -1)]},
        5: {
            "vertebrae_L5_L4": ["vertebrae_L5", "vertebrae_L4"],
            "vertebrae_L3_L1": ["vertebrae_L3", "vertebrae_L2", "vertebrae_L1"],
        },
        8: {},
    },
    "chest": {
        5: {
            "cage": ["ribs_left", "ribs_right", "sternum"],
            "shoulder_left": ["clavicle_left", "scapula_left", "humerus_left"],
            "shoulder_right": ["clavicle_right", "scapula_right", "humerus_right"],
        },
        7: {
            "shoulder_left": ["clavicle_left", "scapula_left", "humerus_left"],
            "shoulder_right": ["clavicle_right", "scapula_right", "humerus_right"],
        },
        11: {},
    },
}
"""Bones fused into one structure, by the number of structures that remain; what is not named stays by itself."""

BODY_AND_ANCHOR = 2
"""With so few structures all bones but the anchor are one body."""


@dataclass(frozen=True)
class Settings:
    """One row.

    photons: per pixel; structures: None for all; weights to epsilon: None for the preset's; system: of
    ``polypose benchmark``, which is given the true cameras, None for a registration that finds them; iterations: None
    for the system's own.
    """

    anatomy: str
    seed: int
    pixels: int
    preset: str = "default"
    views: int = 2
    arc_deg: float = 30.0
    photons: float = PHOTONS
    structures: int | None = None
    erosion_mm: float = 0.0
    weights: str | None = None
    weight_frame: str | None = None
    rotation_reach_mm: float | None = None
    system: str | None = None
    iterations: int | None = None
    epsilon: float | None = None

    @classmethod
    def of(cls, row: Mapping) -> Settings:
        """Of a row; those that it is too old to have are as usual."""
        return cls(**row["settings"])

    def key(self) -> dict:
        """Ready for JSON; equal for equal rows."""
        return asdict(self)

    def tag(self) -> str:
        """A name for files: of what differs in the study, not in the case."""
        parts = [self.preset, self.weights, self.weight_frame]
        parts += [f"eps{self.epsilon:g}"] if self.epsilon else []
        parts += [f"{self.structures}s"] if self.structures else []
        parts += [f"{self.erosion_mm:g}mm"] if self.erosion_mm else []
        parts += [f"reach{self.rotation_reach_mm:g}mm"] if self.rotation_reach_mm else []
        parts += [self.system] if self.system else []
        parts += [f"{self.iterations}iterations"] if self.iterations else []
        return "-".join(part for part in parts if part)


@dataclass(frozen=True)
class Point:
    """One line of a study's table. label: its name; position: on the plot's axis; changes: of Settings."""

    label: str
    position: float
    changes: Mapping[str, object]


INFINITE_REACH_MM = 1e6
"""A reach at which bones rotate all tissue, as in the plain polyrigid model."""


class WeightFunction(NamedTuple):
    """A line of the study of weights: its name, and options of a registration, None for the preset's own."""

    words: str
    weights: str
    weight_frame: str
    epsilon: float | None = None


WEIGHTS = (
    WeightFunction("1/(1+d²), fixed", "epsilon", "fixed", 1.0),
    WeightFunction("1/(1+0.1 d²), fixed (predecessor)", "epsilon", "fixed"),
    WeightFunction("1/(1+0.01 d²), fixed", "epsilon", "fixed", 0.01),
    WeightFunction("1/(1+0.001 d²), fixed", "epsilon", "fixed", 0.001),
    WeightFunction("m/(1+d²), fixed (paper)", "mass", "fixed"),
    WeightFunction("m/d², fixed", "rigid", "fixed"),
    WeightFunction("m/(1+d²), moving", "mass", "moving"),
    WeightFunction("m/d², moving (default)", "rigid", "moving"),
)

REPRESENTATIONS = (
    ("nothing moves", "rest"),
    ("polyrigid (ours)", "polypose"),
    ("dense R3", "dense-r3"),
    ("dense SE(3)", "dense-se3"),
)
"""In words, and the system of ``polypose benchmark``."""

TITLES = {
    "representation": "Representation of the motion",
    "weights": "Weight functions",
    "rotation_falloff": "Distance at which tissue takes half of a bone's rotation, mm",
    "structures": "Number of structures",
    "erosion": "Erosion of the labels, mm",
    "views": f"Number of views over {VIEWS_ARC_DEG:g} degrees",
    "angle": "Angle between two views, degrees",
    "noise": "Photons per pixel",
}


def points(
    study: str,
    anatomy: str,
    weight_presets: Sequence[str],
    iterations: Sequence[int | None] = (None,),
) -> list[Point]:
    """The lines of a study; iterations: of the dense systems, a line each."""
    if study == "representation":
        return [
            Point(words if count is None else f"{words}, {count} iterations", n, _system(system, count))
            for n, (words, system) in enumerate(REPRESENTATIONS)
            for count in (iterations if system in ITERATED else (None,))
        ]
    if study == "weights":
        rows = [(preset, function) for preset in weight_presets for function in WEIGHTS]
        return [
            Point(f"{preset}: {function.words}", n, {"preset": preset, **_options(preset, function)})
            for n, (preset, function) in enumerate(rows)
        ]
    if study == "rotation_falloff":
        own = PRESETS["default"].rotation_reach_mm
        reaches = [(f"{reach:g} mm", reach) for reach in (10.0, 20.0, 40.0, 80.0)] + [
            ("all tissue", INFINITE_REACH_MM)
        ]
        return [
            Point(words, n, {"rotation_reach_mm": None if reach == own else reach})
            for n, (words, reach) in enumerate(reaches)
        ]
    if study == "structures":
        most = len(STRUCTURES[anatomy])
        return [
            Point(str(n), n, {"structures": n if n < most else None})
            for n in (BODY_AND_ANCHOR, *GROUPS[anatomy])
        ]
    if study == "erosion":
        return [Point(f"{depth} mm", depth, {"erosion_mm": float(depth)}) for depth in range(7)]
    if study == "views":
        return [Point(str(n), n, {"views": n, "arc_deg": VIEWS_ARC_DEG}) for n in range(2, 10)]
    if study == "angle":
        angles = (10, 20, 30, 45, 60, 90, 120, 150, 180)
        return [Point(f"{angle}°", angle, {"arc_deg": float(angle)}) for angle in angles]
    return [Point(f"{n:g}", n, {"photons": n}) for n in (5e2, 2e3, 1e4, PHOTONS, 1e6)]


def _system(system: str, iterations: int | None) -> dict[str, object]:
    return {"system": system, "iterations": iterations}


def _options(preset: str, function: WeightFunction) -> dict[str, Any]:
    """Options of a weight function; None where it is the preset's own, so that the usual row is not run twice."""
    own = ("mass", "fixed") if preset == "paper" else ("rigid", "moving")
    chosen = function._asdict()
    del chosen["words"]
    return dict.fromkeys(chosen) if own == (function.weights, function.weight_frame) else chosen


def settings_of(point: Point, base: Settings) -> Settings:
    """The settings of a line."""
    return replace(base, **point.changes)


def prepare(settings: Settings, work: Path) -> tuple[Path, dict[str, str], float]:
    """Simulate and write the study if necessary.

    Returns its path, {structure of the truth: structure of the study}, and the percentage of the structures' voxels
    that erosion left.
    """
    options = SimulationOptions(physics=XrayPhysics(photons=settings.photons))
    name = "" if settings.photons == PHOTONS else f"{settings.photons:g}photons"
    views = f"{settings.views}x{settings.arc_deg:g}"
    folder = case_folder(settings.anatomy, views, settings.seed, settings.pixels, work, options, name)
    fields = json.loads((folder / "study.json").read_text())
    if settings.system:
        give_true_cameras(fields, load_truth(folder / "truth").cameras)
    structures = fields["structures"]
    if settings.structures == BODY_AND_ANCHOR:
        groups = {"body": [name for name in structures if name != fields["anchor"]]}
    else:
        groups = GROUPS[settings.anatomy].get(settings.structures or len(structures), {})
    fields["structures"], stands_for = fuse(structures, groups)
    kept = 100.0
    if settings.erosion_mm:
        labels = read_volume(folder / fields["segmentation"])
        less = eroded(labels, list(structures.values()), settings.erosion_mm)
        bone = np.isin(labels.voxels, np.concatenate(list(structures.values())))
        kept = 100 * float((less.voxels[bone] > 0).mean())
        fields["segmentation"] = f"labels_eroded_{settings.erosion_mm:g}mm.nii.gz"
        write_volume(less, folder / fields["segmentation"])
    fields["options"] = {
        key: value
        for key in ("preset", "weights", "weight_frame", "rotation_reach_mm", "epsilon")
        if (value := getattr(settings, key)) is not None
    }
    study = folder / f"study_{settings.tag()}.json"
    study.write_text(json.dumps(fields, indent=1))
    return study, stands_for, kept


def eroded(labels: Volume, groups: Sequence[Sequence[int]], depth_mm: float) -> Volume:
    """The label map without the voxels of each group of labels whose centre lies less than ``depth_mm`` inside it.

    The group's surface is where its mask, interpolated linearly between voxels, is one half; a thick voxel is thus not
    all there or all gone.
    """
    voxels = labels.voxels.copy()
    for group in groups:
        mask = np.isin(labels.voxels, group)
        box = find_objects(mask.astype(np.int8))[0]
        box = grown_box(box, 2, mask.shape)
        depth = _depths(np.pad(mask[box], 2), labels.spacing)[2:-2, 2:-2, 2:-2]
        depth = np.where(mask[box], depth, np.inf)
        limit = min(depth_mm, float(np.quantile(depth[mask[box]], 1 - LEAST_KEPT)))
        voxels[box][depth < limit] = 0
    return labels.with_voxels(voxels)


def _depths(mask: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """How deep in mm the voxels' centres of a mask (k, j, i) lie below its surface; spacing: (3,) along (i, j, k)."""
    # Odd factors, so that a fine voxel has its centre where a coarse one has.
    factors = 2 * np.ceil((spacing / FINE_MM - 1) / 2).clip(0).astype(int) + 1
    fine = zoom(mask.astype(np.float32), factors[::-1], order=1, mode="nearest", grid_mode=True) >= 0.5
    inside = -distance_at_voxels(fine, spacing / factors, np.zeros(3, int))
    middle = tuple(slice(f // 2, None, f) for f in factors[::-1].tolist())
    return inside[middle] + float((spacing / factors).min()) / 2
