"""How far the dense transform is from the bones' own motions at their voxels, before and after it is fitted to them.

Takes a study and its result, and labels interpolated to finer voxels, because nodes on the CT's own voxels would agree
with the bones by construction. Voxels whose true place two bones claim are counted apart: nothing can follow both.

    python Testing/Benchmarks/joint_surfaces.py case/study.json case/result --finer 3 --spacing 3 2
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.ndimage import zoom

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.studies import load_study
from PolyPoseLib.registration.outputs import transform_grid
from PolyPoseLib.registration.presets import PRESETS
from PolyPoseLib.warp.dense import displacement_field, jacobian_determinant
from PolyPoseLib.warp.on_bones import fitted_to_bones
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff
from PolyPoseLib.warp.weights import distance_maps

MOST = 200_000
"""Voxels of a bone that are looked at."""


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", type=Path)
    parser.add_argument("result", type=Path)
    parser.add_argument("--finer", type=int, default=3, help="times that the labels are finer than the CT")
    parser.add_argument("--spacing", type=float, nargs="+", default=[3.0], help="of the transform, mm")
    arguments = parser.parse_args()
    study, result = load_study(arguments.study), load_result(arguments.result)
    labels = finer(Volume(study.structures.labels, study.ct.affine), arguments.finer)
    structures = Structures(study.structures.names, labels.voxels)
    poses = np.stack([result.structures[name].fixed_to_moving for name in structures.names])
    centroids = structures.centroids(labels.affine)
    falloff = RotationFalloff(PRESETS["default"].rotation_reach_mm or 40.0, centroids)
    maps = distance_maps(structures, labels.affine)
    warp = PolyrigidWarp(maps, structures.volume_share(), poses, rotation_falloff=falloff)
    print(
        "| transform | bone | off by > 1 mm, % | off and not claimed twice, % | mean mm | claimed twice, % |"
    )
    print("| --- | --- | --- | --- | --- | --- |")
    for spacing in arguments.spacing:
        affine, shape, _ = transform_grid(labels, spacing)
        plain = displacement_field(warp, affine, shape)
        for name, field in (("plain", plain), ("fitted", fitted_to_bones(plain, labels, poses))):
            folds = 100 * float((jacobian_determinant(field) <= 0).mean())
            print_rows(f"{name}, {spacing:g} mm, {folds:.4f} % folds", field, labels, structures.names, poses)


def finer(labels: Volume, times: int) -> Volume:
    """Labels on voxels so many times smaller, by the largest interpolated share."""
    if times == 1:
        return labels
    out = np.zeros([size * times for size in labels.shape], np.int16)
    most = np.full(out.shape, 0.5, np.float32)
    for n in range(1, int(labels.voxels.max()) + 1):
        share = zoom((labels.voxels == n).astype(np.float32), times, order=1, grid_mode=True, mode="nearest")
        more = share > most
        out[more], most[more] = n, share[more]
    affine = labels.affine.copy()
    affine[:3, :3] /= times
    affine[:3, 3] -= affine[:3, :3] @ np.full(3, (times - 1) / 2)
    return Volume(out, affine)


def print_rows(
    label: str, field: DisplacementField, labels: Volume, names: tuple[str, ...], poses: np.ndarray
) -> None:
    """One row per bone."""
    for n, (name, pose) in enumerate(zip(names, poses, strict=True)):
        index = np.argwhere(labels.voxels == n + 1)[:, ::-1]
        moving = labels.to_world(index[:: max(1, len(index) // MOST)])
        fixed = (moving - pose[:3, 3]) @ pose[:3, :3]
        error = np.linalg.norm(field(fixed) - moving, axis=1)
        twice = claimed_twice(fixed, n, labels, poses)
        print(
            f"| {label} | {name} | {100 * (error > 1).mean():.2f} | {100 * ((error > 1) & ~twice).mean():.2f} | "
            f"{error.mean():.3f} | {100 * twice.mean():.2f} |"
        )


def claimed_twice(fixed: np.ndarray, owner: int, labels: Volume, poses: np.ndarray) -> np.ndarray:
    """(N,) whether another bone's motion brings it to the same place (N, 3)."""
    twice = np.zeros(len(fixed), bool)
    for n, pose in enumerate(poses):
        if n == owner:
            continue
        index = np.rint(labels.to_index(fixed @ pose[:3, :3].T + pose[:3, 3])).astype(int)
        inside = ((index >= 0) & (index < np.array(labels.shape[::-1]))).all(axis=1)
        i, j, k = index[inside].T
        twice[inside] |= labels.voxels[k, j, i] == n + 1
    return twice


if __name__ == "__main__":
    main()
