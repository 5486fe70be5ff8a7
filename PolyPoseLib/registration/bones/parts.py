"""Bones that were united in one structure, compared with the X-rays one by one.

A structure has one pose. Where its bones moved against each other, that pose suits the one that weighs most in the
X-rays, and a mean over the whole structure hides how far off the others are. Each bone is therefore looked for by
itself, from where the structure's pose puts it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import binary_erosion
from scipy.spatial import KDTree

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import block_factors
from PolyPoseLib.geometry.rigid import perturbation, rigid_inverse
from PolyPoseLib.registration.bones.agreement import Agreement, PartAgreement, agreement_in, posed, shown_in
from PolyPoseLib.registration.bones.restarts import best_of
from PolyPoseLib.registration.fit.levels import COMPARISON_LEVEL, Observation, pixel_size_mm
from PolyPoseLib.registration.fit.problem import RigidProblem, State, View
from PolyPoseLib.registration.run import Run
from PolyPoseLib.registration.scene import Scene, body_points
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.warp.parts import Part, connected_parts

LEAST_SHARE = 0.08
"""Of a structure's voxels, at least, of a part that is compared: smaller ones are splinters, ribs or teeth, too little
for an X-ray to tell where they are."""

LEAST_LENGTH_MM = 45.0
"""Of a part within which the CT ends, towards that end: the rest of a vertebra fits its neighbour's place as well. What
the CT of a pelvis holds of a femur is 54 mm and longer."""

ITERATIONS = 10
"""Of the fit of a bone by itself."""

PLAIN = 0.6
"""Support from which on a bone is looked for only near where the structure's pose puts it."""

_SHIFTS = [perturbation(np.r_[np.zeros(3), 8.0 * sign * axis]) for axis in np.eye(3) for sign in (-1.0, 1.0)]
"""Where else it is looked for, mm along the patient's axes."""

POINTS = 200
"""Of a bone, over which its shift is averaged."""


@dataclass(frozen=True)
class UnitedBone:
    """One of several bones that were united in a structure.

    label: of the segmentation; None where one label holds several bones. body: at the comparison's voxels, about its
    own centre.
    """

    label: int | None
    body: Body


def agreement_by_parts(
    run: Run, observations: Sequence[Observation], poses: np.ndarray, segmentation: Volume | None
) -> Agreement:
    """Compare every structure with every X-ray, and the bones of those that unite several by themselves as well.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    observations : sequence of Observation
        N X-rays with their cameras.
    poses : (K, 4, 4) ndarray
        Fixed to moving.
    segmentation : Volume or None
        The labels that the structures were made of, on the CT's grid; without it bones that touch are one.

    Returns
    -------
    Agreement
        Of the K structures with the N X-rays, with their parts.

    """
    problem, state = posed(run, observations, poses)
    bones = united_bones(run.scene, segmentation)
    return replace(agreement_in(problem, state), parts=agreement_of_bones(problem, state, bones))


def united_bones(scene: Scene, segmentation: Volume | None) -> dict[int, list[UnitedBone]]:
    """The larger bones, one at least, of structures that unite several, by structure.

    segmentation: as for :func:`agreement_by_parts`.
    """
    bones = {}
    for k, labels in enumerate(_labels_by_structure(scene, segmentation)):
        found = [part for part in large_parts(labels) if not is_cut_short(scene, k, part)]
        alone = len(found) == 1 and _size(found[0]) > (1 - LEAST_SHARE) * np.count_nonzero(labels)
        if found and not alone:  # more than one bone with its splinters
            several = bool((labels[labels > 0] != found[0].label).any())
            bones[k] = [UnitedBone(part.label if several else None, _body(scene, k, part)) for part in found]
    return bones


def agreement_of_bones(
    problem: RigidProblem, state: State, bones: Mapping[int, Sequence[UnitedBone]]
) -> dict[int, list[PartAgreement]]:
    """Of bones that were united in structures, by structure, with the views of a problem of all structures.

    The problem is at COMPARISON_LEVEL, in front of the soft tissue.
    """
    if not bones:
        return {}
    images = [problem.render(state, n)[0] for n in range(len(problem.views))]
    return {
        k: [_agreement(problem, images, state.poses[k], bone) for bone in united]
        for k, united in bones.items()
    }


def large_parts(labels: np.ndarray) -> list[Part]:
    """The large connected parts of labels (k, j, i), each of one label."""
    least = LEAST_SHARE * np.count_nonzero(labels)
    return [part for part in connected_parts(labels, 0) if _size(part) >= least]


def _size(part: Part) -> int:
    """Its number of voxels."""
    return int(np.count_nonzero(part.mask))


def is_cut_short(scene: Scene, k: int, part: Part) -> bool:
    """Whether the CT ends within a part of structure k, and holds little of it."""
    spacing = np.linalg.norm(scene.whole.affine[:3, :3], axis=0)[::-1]
    return any(
        (side.start == 0 or side.stop == size) and (side.stop - side.start) * mm < LEAST_LENGTH_MM
        for side, size, mm in zip(_place(scene, k, part), scene.owners.shape, spacing, strict=True)
    )


def _place(scene: Scene, k: int, part: Part) -> tuple[slice, ...]:
    """Slices (k, j, i) of the working voxels in which a part of structure k lies."""
    return tuple(
        slice(of.start + at.start, of.start + at.stop) for of, at in zip(scene.box(k), part.box, strict=True)
    )


def _labels_by_structure(scene: Scene, segmentation: Volume | None) -> Iterator[np.ndarray]:
    """Labels at the working voxels (k, j, i) in each structure's box, 0 outside it; 1 where it has but one.

    A structure grew beyond its labels; there the nearest label counts.
    """
    spacing = np.linalg.norm(scene.whole.affine[:3, :3], axis=0)[::-1]
    for k in range(len(scene.names)):
        owned = labels = scene.owned(k)
        if segmentation is not None:
            own = scene.working_labels(scene.structures.labels, k) == k + 1
            labels = np.where(owned & own, scene.working_labels(segmentation.voxels, k), 0)
        known = labels[labels > 0]
        if len(known) and (known != known[0]).any():
            grown = owned & (labels == 0)
            labels[grown] = labels[tuple(_nearest(labels > 0, grown, spacing).T)]
            yield labels
        else:
            yield owned.astype(np.int32)


def _nearest(known: np.ndarray, wanted: np.ndarray, spacing: np.ndarray) -> np.ndarray:
    """(P, 3) index (k, j, i) of the known voxel nearest to each of the P wanted ones; spacing: mm along (k, j, i)."""
    surface = known & ~np.asarray(binary_erosion(known), bool)  # the nearest one lies there
    places = np.argwhere(surface)
    _, nearest = KDTree(places * spacing).query(np.argwhere(wanted) * spacing)
    return places[nearest]


def _body(scene: Scene, k: int, part: Part) -> Body:
    """A part of structure k, about its own centre, in the same blocks of voxels as the whole."""
    size_mm = COMPARISON_LEVEL.size_mm
    blocks = block_factors(scene.whole.affine, size_mm)[::-1]
    before = [side.start % block for side, block in zip(part.box, blocks, strict=True)]
    box = tuple(
        slice(side.start - more, side.stop) for side, more in zip(_place(scene, k, part), before, strict=True)
    )
    body = scene.body_of(k, box, np.pad(part.mask, [(more, 0) for more in before]), size_mm)
    return replace(body, centre=body_points(body, POINTS).mean(axis=0))


def _agreement(
    problem: RigidProblem, images: Sequence[np.ndarray], pose: np.ndarray, bone: UnitedBone
) -> PartAgreement:
    """Of a bone whose structure has a pose (4, 4); images: (H, W) renderings of everything in the problem's views."""
    pairs = zip(problem.views, images, strict=True)
    views = [_view_without(problem, view, image, pose, bone.body) for view, image in pairs]
    alone = replace(problem, bodies=[bone.body], views=views)
    there = State.of_poses(pose[None], len(alone.views))
    support = _support(alone, there)
    starts = [pose] if (support >= PLAIN).any() else [pose, *(pose @ shift for shift in _SHIFTS)]
    found = best_of(alone, there, 0, starts, ITERATIONS)
    found = pose if found is None else found
    points = body_points(bone.body, POINTS)
    shifts = [_shift_mm(points, view.camera, pose, found) for view in alone.views]
    return PartAgreement(bone.label, support, _support(alone, there.with_pose(0, found)), np.array(shifts))


def _view_without(problem: RigidProblem, view: View, image: np.ndarray, pose: np.ndarray, bone: Body) -> View:
    """A view whose static image is a rendering (H, W) of everything, less a bone at a pose (4, 4)."""
    static = image.copy()
    part = project_body(bone, view.camera, pose, problem.step_mm, problem.backend)
    static[part.slices] -= part.image
    return replace(view, static=static)


def _support(alone: RigidProblem, state: State) -> np.ndarray:
    """(N,) support of the one bone of a problem by its views, NaN where it hardly shows."""
    support = np.full(len(alone.views), np.nan)
    for n, view in enumerate(alone.views):
        image, (part,) = alone.render(state, n)
        shown = shown_in(view, image, view.contrast.normalise(image).values, part)
        if shown is not None:
            support[n], _ = shown.support_and_contrast()
    return support


def _shift_mm(points: np.ndarray, camera: Camera, before: np.ndarray, after: np.ndarray) -> float:
    """How far two poses (4, 4), fixed to moving, put a bone's points (P, 3) apart across the beam, on average."""
    first, second = (
        points @ inverse[:3, :3].T + inverse[:3, 3] for inverse in map(rigid_inverse, (before, after))
    )
    pixels = np.linalg.norm(camera.project(second) - camera.project(first), axis=1)
    return float(pixels.mean()) * pixel_size_mm(camera, first.mean(axis=0))
