"""Training pairs from several CTs of a patient: every one against every other, in both directions, or some of these.

The field between two CTs, which LiftReg's subspace and the held-out error need, is found by a 3D/3D registration:
symmetric demons. It is a stand-in for a truth that nobody knows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import permutations

import numpy as np
import SimpleITK as sitk

from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.network_inputs import PIXELS_PER_NODE, scaled_ct, view_of
from PolyPoseLib.baselines.trained.training_pairs import TrainingPair
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, review_camera
from PolyPoseLib.simulation.independent_projector import project
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

BONE_HU = 200.0
POINTS = 2000
"""Nodes in bone, at most, at which held-out errors are measured."""

LEVELS = (4, 2, 1)
"""Factors by which the demons' images are shrunk, one after another."""

ITERATIONS = 30
SMOOTHING_NODES = 1.5
"""Of the field after every iteration, standard deviation."""


def demons_field(moving: Volume, fixed: Volume, side: int) -> DisplacementField:
    """The displacement from fixed to moving points that symmetric demons find on the moving CT's network grid.

    References
    ----------
    T. Vercauteren et al., "Diffeomorphic demons", NeuroImage 2009; SimpleITK's FastSymmetricForcesDemonsRegistration.

    """
    grid = NetworkGrid.of(moving, side)
    images = [Volume(scaled_ct(each, grid), grid.affine).to_sitk() for each in (fixed, moving)]
    found = None
    for factor in LEVELS:
        low = [
            sitk.Shrink(
                sitk.SmoothingRecursiveGaussian(each, (grid.spacing * factor / 2).tolist()), [factor] * 3
            )
            if factor > 1
            else each
            for each in images
        ]
        demons = sitk.FastSymmetricForcesDemonsRegistrationFilter()
        demons.SetNumberOfIterations(ITERATIONS)
        demons.SetSmoothDisplacementField(True)
        demons.SetStandardDeviations(SMOOTHING_NODES)
        if found is None:
            found = demons.Execute(*low)
        else:
            found = demons.Execute(*low, sitk.Resample(found, low[0], sitk.Transform(3, sitk.sitkIdentity)))
    assert found is not None
    return DisplacementField.from_sitk_image(found)


def ct_pairs(
    cts: Sequence[Volume],
    cameras: Sequence[Camera],
    side: int,
    seed: int,
    projector: str = "auto",
    wanted: Sequence[tuple[int, int]] | None = None,
) -> Iterator[TrainingPair]:
    """Pairs of one patient, each once.

    Parameters
    ----------
    cts : Sequence[Volume]
        HU, two or more, in one world: where the cameras' structure (the anchor) was brought to coincide.
    cameras : Sequence[Camera]
        Of the X-rays, which are simulated from every CT.
    side : int
        Nodes of the network's grid along every axis.
    seed : int
        Of the X-rays' noise.
    projector : {"auto", "rtk", "sum"}
        See :func:`PolyPoseLib.simulation.independent_projector.project`.
    wanted : sequence of (int, int), optional
        Numbers of the moving and the fixed CT of each pair; all pairs when None. A pair is the same with others beside
        it and without.

    Raises
    ------
    InputError
        Fewer than two CTs, or a CT without bone.

    """
    if len(cts) < 2:
        raise InputError("Pairs of CTs need two CTs of a patient or more.")
    small = [review_camera(camera, PIXELS_PER_NODE * side)[0] for camera in cameras]
    for numbers in permutations(range(len(cts)), 2) if wanted is None else wanted:
        moving, fixed = (cts[number] for number in numbers)
        rng = np.random.default_rng((seed, *numbers))
        coarse = NetworkGrid.of(fixed, side).coarsened(fixed)
        mu = coarse.with_voxels(hounsfield_to_attenuation(coarse.voxels))
        views = []
        for camera in small:
            image = measure(project(mu, camera, projector), XrayPhysics(), rng)
            views.append(view_of(image, np.ones(image.shape, bool), camera, side))
        field = demons_field(moving, fixed, side)
        points = _bone_nodes(fixed, NetworkGrid.of(moving, side), rng)
        yield TrainingPair(moving, fixed, tuple(views), field, points, field.sample(points))


def _bone_nodes(ct: Volume, grid: NetworkGrid, rng: np.random.Generator) -> np.ndarray:
    """Nodes of a grid (M, 3), LPS mm, that lie in a CT's bone; raises InputError when there are none."""
    points = grid.points()[grid.resampled(ct) > BONE_HU]
    if not len(points):
        raise InputError(
            f"A CT of the training pairs has no bone (nothing above {BONE_HU:g} HU) in the other's box."
        )
    return rng.choice(points, min(POINTS, len(points)), replace=False)
