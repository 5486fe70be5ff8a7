"""The pairs that a network is trained on, and those that are held out."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.baselines.trained.ct_digests import ct_digest
from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.training_pairs import Preparation, PreparedPair, TrainingPair
from PolyPoseLib.baselines.trained.view_directions import directions_of, matched_views, sources_of
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Prepared pairs and what they have in common.

    Attributes
    ----------
    training, held_out : tuple[PreparedPair, ...]
        The network never learns from the second; they choose the weights that are kept.
    side : int
        Nodes of the network's grid along every axis.
    directions : (V, 3) array
        Of the first pair's cameras; all others' agree with them.
    extent_mm : (2, 3) array
        Shortest and longest CT.
    sources_mm : (2, V, 3) array
        Least and largest coordinates of each view's source from the CT's middle.
    cts : tuple[str, ...]
        Digests of all CTs of patients, those of held-out pairs as well: they choose the weights.

    """

    training: tuple[PreparedPair, ...]
    held_out: tuple[PreparedPair, ...]
    side: int
    directions: np.ndarray
    extent_mm: np.ndarray
    sources_mm: np.ndarray
    cts: tuple[str, ...]

    @classmethod
    def collected(
        cls,
        pairs: Iterator[TrainingPair],
        counts: tuple[int, int],
        side: int,
        progress: Callable[[int, int], None] = lambda done, of: None,
    ) -> TrainingSet:
        """Take pairs until there are enough.

        Parameters
        ----------
        pairs : Iterator[TrainingPair]
            May be endless; the first are held out.
        counts : tuple[int, int]
            Pairs to train on, and pairs to hold out.
        side : int
            Nodes of the network's grid along every axis.
        progress : Callable[[int, int], None], optional
            Called with the pairs that there are and the pairs wanted; may raise CancelledError.

        Raises
        ------
        InputError
            Too few pairs, or pairs whose X-rays are not from the same directions.

        """
        training, held_out = counts
        wanted = training + held_out
        prepare, prepared, extents, sources = Preparation(side), [], [], []
        cts = _CtDigests()
        directions = None
        progress(0, wanted)
        while len(prepared) < wanted:
            pair = next(pairs, None)
            if pair is None:
                break
            cameras = [view.camera for view in pair.views]
            if directions is None:
                directions = directions_of(cameras)
            if _order(directions, cameras, len(prepared) + 1) != list(range(len(cameras))):
                raise InputError(
                    "The training pairs name their views in different orders: use one order for all."
                )
            grid = NetworkGrid.of(pair.moving, side)
            extents.append(grid.extent_mm)
            sources.append(sources_of(cameras, grid.middle))
            prepared.append(prepare(pair))
            cts.add(pair)
            progress(len(prepared), wanted)
        if directions is None or len(prepared) < held_out + 2:
            raise InputError(
                f"There are {len(prepared)} training pairs: give {held_out} to hold out and 2 or more to train on."
            )
        return cls(
            tuple(prepared[held_out:]),
            tuple(prepared[:held_out]),
            side,
            directions,
            np.stack([np.min(extents, axis=0), np.max(extents, axis=0)]),
            np.stack([np.min(sources, axis=0), np.max(sources, axis=0)]),
            tuple(sorted(set(cts.digests))),
        )

    def fingerprint(self) -> str:
        """SHA256 over all pairs: a training is resumed on the same ones alone."""
        digest = hashlib.sha256()
        for pair in (*self.training, *self.held_out):
            for values in (pair.moving, pair.fixed, pair.lifted, pair.displacement):
                digest.update(values.numpy().tobytes())
        return digest.hexdigest()


class _CtDigests:
    """Digests of the CTs of pairs, one CT computed once while it is the same object."""

    def __init__(self) -> None:
        self.digests: list[str] = []
        self._known: dict[int, Volume] = {}

    def add(self, pair: TrainingPair) -> None:
        """Take a pair's CTs, but none that was simulated."""
        for ct in (pair.moving,) if pair.simulated else (pair.moving, pair.fixed):
            if self._known.get(id(ct)) is not ct:
                self._known[id(ct)] = ct
                self.digests.append(ct_digest(ct))


def _order(directions: np.ndarray, cameras: list, number: int) -> list[int]:
    """Which camera of a pair stands for each direction; raises InputError."""
    try:
        return matched_views(directions, cameras)
    except InputError as error:
        raise InputError(f"Training pair {number} does not fit the first: {error}.") from error
