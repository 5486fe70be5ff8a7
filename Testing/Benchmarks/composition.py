"""What composing the warped CT from rigid bones is good for: a hip that dislocates.

The femoral head leaves its socket by two centimetres. A smooth warp fills the gap with what lies between the bones in
the CT, which is bone stretched out; the composed CT lays both bones over soft tissue. The poses are given, nothing is
registered; the truth moves the bones of the pelvis CT exactly and lets soft tissue follow Laplace's equation.

    python Testing/Benchmarks/composition.py
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from benchmark_cases import load_anatomy
from benchmark_runs import RESULTS
from benchmark_tables import machine
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.ndimage import binary_dilation, binary_fill_holes

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.registration.articulations import find_articulations
from PolyPoseLib.simulation.motion import rigid_about
from PolyPoseLib.simulation.posed_ct import pose_ct
from PolyPoseLib.warp.composition import compose_warped_ct
from PolyPoseLib.warp.dense import warp_volume
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff
from PolyPoseLib.warp.weights import distance_maps

FEMUR = "femur_left"
BONE_HU = 200.0
REACH_MM = 40.0
ROOM_MM = 35.0
"""Around the joint, shown and counted."""


def main() -> int:
    """Warp both ways, count bone where none is, and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shift-mm", type=float, default=20.0, help="of the femoral head, outward and up")
    parser.add_argument("--output", type=Path, default=RESULTS, help="folder of the figure and the numbers")
    arguments = parser.parse_args()
    ct, structures, _, _ = load_anatomy("pelvis")
    joint = _hip(ct, structures)
    motion = _dislocation(ct, structures, joint, arguments.shift_mm)
    poses = np.stack([np.linalg.inv(motion) if n == FEMUR else np.eye(4) for n in structures.names])
    true = pose_ct(ct, structures, {FEMUR: np.linalg.inv(motion)})
    volumes = {
        "CT": ct.voxels,
        "truth": true.grid.core(true.hu),
        "smooth warp": _smooth(ct, structures, poses).voxels,
        "composed": compose_warped_ct(ct, structures, poses, _warp(ct, structures, poses)).voxels,
    }
    ghosts = _ghosts(ct, structures, volumes, true.grid.core(true.labels), joint)
    arguments.output.mkdir(parents=True, exist_ok=True)
    report = {"machine": machine(), "shift_mm": arguments.shift_mm, "bone_outside_bones_ml": ghosts}
    (arguments.output / "composition.json").write_text(json.dumps(report, indent=1) + "\n")
    _draw(ct, volumes, ghosts, joint, arguments.output / "composition.png")
    print(", ".join(f"{name}: {value:.2f} ml" for name, value in ghosts.items()))
    return 0


def _hip(ct: Volume, structures: Structures) -> np.ndarray:
    """(3,) LPS mm, where the femur meets the pelvis."""
    pair = {structures.index(FEMUR), structures.index("pelvis")}
    found = find_articulations(structures, ct.affine, structures.index("pelvis"))
    return next(each.point for each in found if {each.first, each.second} == pair)


def _dislocation(ct: Volume, structures: Structures, joint: np.ndarray, shift_mm: float) -> np.ndarray:
    """(4, 4) moving to fixed: away from the pelvis, with a turn of 10 degrees inward."""
    outward = structures.centroids(ct.affine)[structures.index(FEMUR)] - joint
    outward = np.array([np.sign(outward[0]), 0.0, 0.6])
    shift = shift_mm * outward / np.linalg.norm(outward)
    return rigid_about(joint, np.radians([0.0, -10.0 * np.sign(outward[0]), 0.0]), shift)


def _warp(ct: Volume, structures: Structures, poses: np.ndarray) -> PolyrigidWarp:
    rotation_falloff = RotationFalloff(REACH_MM, structures.centroids(ct.affine))
    maps = distance_maps(structures, ct.affine)
    return PolyrigidWarp(maps, structures.volume_share(), poses, rotation_falloff=rotation_falloff)


def _smooth(ct: Volume, structures: Structures, poses: np.ndarray) -> Volume:
    return warp_volume(ct, _warp(ct, structures, poses))


def _near(ct: Volume, joint: np.ndarray) -> np.ndarray:
    """(k, j, i) voxels within ROOM_MM of the joint."""
    index = np.stack(np.meshgrid(*map(np.arange, ct.shape), indexing="ij"), -1)[..., ::-1]
    return np.linalg.norm(ct.to_world(index.reshape(-1, 3)) - joint, axis=1).reshape(ct.shape) < ROOM_MM


def _ghosts(
    ct: Volume, structures: Structures, volumes: dict[str, np.ndarray], true: np.ndarray, joint: np.ndarray
) -> dict[str, float]:
    """Millilitres brighter than bone near the joint, away from where the bones truly are."""
    bones = binary_dilation(true > 0, iterations=1)
    bones = np.stack([binary_fill_holes(part) for part in bones])
    outside = _near(ct, joint) & ~bones
    millilitre = float(np.prod(ct.spacing)) / 1000
    return {
        name: float((outside & (voxels > BONE_HU)).sum() * millilitre)
        for name, voxels in volumes.items()
        if name != "CT"
    }


def _draw(
    ct: Volume, volumes: dict[str, np.ndarray], ghosts: dict[str, float], joint: np.ndarray, path: Path
) -> None:
    """One coronal slice through the joint of every volume."""
    figure = Figure(figsize=(13.0, 3.2), layout="constrained")
    FigureCanvasAgg(figure)
    i, j, k = np.rint(ct.to_index(joint)).astype(int)
    wide, high = (int(1.8 * ROOM_MM / ct.spacing[n]) for n in (0, 2))
    low, left = max(k - high, 0), max(i - wide, 0)
    flip = -1 if ct.affine[2, 2] > 0 else 1
    for axis, (name, voxels) in zip(figure.subplots(1, len(volumes)), volumes.items(), strict=True):
        part = voxels[low : k + high, j, left : i + wide][::flip]
        axis.imshow(
            part,
            cmap="gray",
            vmin=-200,
            vmax=900,
            aspect=ct.spacing[2] / ct.spacing[0],
            interpolation="bilinear",
        )
        caption = "" if name == "CT" else f"\nbone where none is: {ghosts[name]:.2f} ml"
        axis.set_title(name + caption, fontsize=10)
        axis.set_axis_off()
    figure.savefig(path, dpi=100)


if __name__ == "__main__":
    raise SystemExit(main())
