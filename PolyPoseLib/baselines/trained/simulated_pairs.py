"""Simulated training pairs: a CT's bones moved at random, soft tissue and X-rays by the simulation's laws."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.network_inputs import PIXELS_PER_NODE, view_of
from PolyPoseLib.baselines.trained.training_pairs import TrainingPair
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera, review_camera
from PolyPoseLib.geometry.grid import block_centres
from PolyPoseLib.simulation.motion import apply
from PolyPoseLib.simulation.simulate import SimulatedCase, SimulationOptions, simulate_case

POINTS = 2000
"""Of a pair's moving bones at which held-out errors are measured, as many of each bone."""

NODE_SHARE = 1.5
"""Distance of the soft tissue's nodes in coarse voxels, 3 mm or more; in bones the field is exact all the same."""


@dataclass(frozen=True, eq=False)
class SimulatedPatient:
    """A patient whose motions are simulated at a network's resolution.

    Attributes
    ----------
    ct : Volume
        The CT as it is.
    coarse : Volume
        The same, with voxels about as large as the network's nodes are apart.
    structures : Structures
        On the coarse grid; those that are smaller than its voxels are left out.
    anchor : str
        The structure that stays.
    cameras : tuple[Camera, ...]
        Of the X-rays, binned as networks take them.
    side : int
        Nodes of the network's grid along every axis.

    """

    ct: Volume
    coarse: Volume
    structures: Structures
    anchor: str
    cameras: tuple[Camera, ...]
    side: int

    @classmethod
    def of(
        cls, ct: Volume, structures: Structures, anchor: str, cameras: Sequence[Camera], side: int
    ) -> SimulatedPatient:
        """Of a CT, its structures and the cameras of its X-rays; raises InputError when no bone is left that moves."""
        grid = NetworkGrid.of(ct, side)
        # The blocks by which the CT itself is averaged: at rest, both postures are alike to the last bit.
        coarse = grid.coarsened(ct)
        labels = block_centres(structures.labels, grid.factors(ct))
        kept = [n for n in range(len(structures)) if np.any(labels == n + 1)]
        names = tuple(structures.names[n] for n in kept)
        if anchor not in names or len(names) < 2:
            raise InputError(
                f"At the network's {grid.spacing.mean():.1f} mm no bone but the anchor is left of this CT, or not even "
                "that: train with a larger --side."
            )
        numbers = np.zeros(len(structures) + 1, np.int16)
        numbers[np.array(kept) + 1] = np.arange(1, len(kept) + 1)
        small = tuple(review_camera(camera, PIXELS_PER_NODE * side)[0] for camera in cameras)
        return cls(ct, coarse, Structures(names, numbers[labels]), anchor, small, side)

    def pair(self, seed: int, options: SimulationOptions | None = None) -> TrainingPair:
        """One random motion; the same seed gives the same pair. The options' node_mm is chosen here."""
        node_mm = max(3.0, NODE_SHARE * float(self.coarse.spacing.mean()))
        case = simulate_case(
            self.coarse,
            self.structures,
            cameras=self.cameras,
            seed=seed,
            options=replace(options or SimulationOptions(), node_mm=node_mm),
            anchor=self.anchor,
        )
        views = tuple(
            view_of(image, np.ones(image.shape, bool), camera, self.side)
            for image, camera in zip(case.images, case.cameras, strict=True)
        )
        points, moved = bone_points(case, seed)
        return TrainingPair(self.ct, case.fixed_ct, views, self._field(case), points, moved, simulated=True)

    def _field(self, case: SimulatedCase) -> DisplacementField:
        """The true field on the coarse voxels: rigid in bones, the soft tissue's between them."""
        points = self.coarse.to_world(np.moveaxis(np.indices(self.coarse.shape)[::-1], 0, -1))
        vectors = case.field.sample(points)
        labels = case.fixed_labels.voxels_at(case.fixed_labels.to_index(points.reshape(-1, 3)), 0)
        labels = labels.reshape(self.coarse.shape)
        for number, name in enumerate(case.structures.names, start=1):
            inside = labels == number
            vectors[inside] = apply(case.fixed_to_moving[name], points[inside]) - points[inside]
        return DisplacementField(vectors, self.coarse.affine)


def bone_points(case: SimulatedCase, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Fixed points (M, 3) of the bones that move, as many of each, and their displacements (M, 3); LPS mm."""
    labels = case.fixed_labels
    moving = [(n, name) for n, name in enumerate(case.structures.names, start=1) if name != case.anchor]
    rng = np.random.default_rng((seed, 1))
    points, moved = [], []
    for number, name in moving:
        index = np.argwhere(labels.voxels == number)
        if len(index):
            chosen = labels.to_world(rng.choice(index, POINTS // len(moving))[:, ::-1])
            points.append(chosen)
            moved.append(apply(case.fixed_to_moving[name], chosen) - chosen)
    if not points:
        raise InputError("All moving bones left the CT: lower the motion scale.")
    return np.concatenate(points), np.concatenate(moved)


def simulated_pairs(
    patients: Sequence[SimulatedPatient], seed: int, options: SimulationOptions | None = None
) -> Iterator[TrainingPair]:
    """Pairs without end, of one patient after another.

    Parameters
    ----------
    patients : Sequence[SimulatedPatient]
        With as many X-rays each, from nearly the same directions.
    seed : int
        Of everything random; two seeds give other motions.
    options : SimulationOptions, optional
        Motions, tissue and detector.

    """
    streams = np.random.SeedSequence(seed)
    while True:
        for patient in patients:
            yield patient.pair(int(streams.spawn(1)[0].generate_state(1)[0]), options)
