"""Joints of bones, and the prior that bones stay together there.

A weak prior, strong only while the images are coarse: at each joint two bones stay together to within a few millimetres
and rotate relative to each other by no more than some tens of degrees. It keeps bones that the X-rays hardly show from
drifting away, and passes motions along the chain of bones; at the finest level the images decide.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import find_objects
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.geometry.rigid import rigid_inverse, rotation_vectors, skew

CONTACT_MM = 10.0
"""Bones with a smaller gap form a joint."""

CONTACT_BAND_MM = 5.0
"""Points of two bones that are at most this much farther apart than the closest ones make up their contact."""

SLIDE_MM = 5.0
"""How far a joint is expected to come apart (standard deviation), besides its gap in the CT."""

LOOP_YIELDS_AT = 2.0
"""Standard deviations beyond which the cost of a joint hardly grows where its bones hang together without it: bones may
touch where they have no joint, as a shoulder blade does that glides over ribs by centimetres."""

TURN_DEG = 20.0
"""How far a joint is expected to rotate: within it the cost grows with the square, far beyond it hardly any more, for
hips and shoulders rotate by 40 degrees and more."""

_POINTS = 4000


@dataclass(frozen=True)
class Articulation:
    """A joint of two structures.

    Attributes
    ----------
    first, second : int
        Indices of the structures.
    point : np.ndarray
        (3,) in the CT, LPS mm.
    slide_mm : float
        Standard deviation of how far it comes apart.
    weight : float
        Against that of other joints.
    yields_at : float
        How many times slide_mm it may come apart before the cost hardly grows any more.
    is_joint : bool
        Whether the bones touch; otherwise it links companions.

    """

    first: int
    second: int
    point: np.ndarray
    slide_mm: float
    weight: float = 1.0
    yields_at: float = np.inf
    is_joint: bool = True


def bone_clouds(structures: Structures, affine: np.ndarray) -> list[np.ndarray]:
    """Some thousand points (N, 3) LPS mm of every structure, evenly picked."""
    return [
        _sample(structures.labels, number, box, affine)
        for number, box in enumerate(find_objects(structures.labels), start=1)
    ]


def find_articulations(clouds: Sequence[np.ndarray], anchor: int) -> list[Articulation]:
    """Joints of all bones that nearly touch, and of each group of bones with the nearest bone outside it.

    Parameters
    ----------
    clouds : sequence of (N, 3) ndarray
        Of every structure, see :func:`bone_clouds`.
    anchor : int
        Index of the anchor.

    Returns
    -------
    list of Articulation
        They connect every structure to the anchor. One that is not needed for that, as there is another way round,
        yields where the bones come far apart.

    """
    trees = [KDTree(cloud, leafsize=16) for cloud in clouds]
    count = len(clouds)
    meetings = {}
    for a in range(count):
        for b in range(a + 1, count):
            distance, nearest = (np.asarray(each) for each in trees[b].query(clouds[a]))
            close = distance <= distance.min() + CONTACT_BAND_MM
            middle = (clouds[a][close] + clouds[b][nearest[close]]).mean(axis=0) / 2
            meetings[a, b] = (float(distance.min()), middle)
    chosen = {pair for pair, (gap, _) in meetings.items() if gap <= CONTACT_MM}
    chosen |= _missing_links(meetings, chosen, count, anchor)
    joints = []
    for first, second in sorted(chosen):
        gap, middle = meetings[first, second]
        is_needed = connected_groups(chosen - {(first, second)}, count).any()
        limit = np.inf if is_needed else LOOP_YIELDS_AT
        joints.append(Articulation(first, second, middle, SLIDE_MM + gap, yields_at=limit))
    return joints


def connected_groups(pairs: Collection[tuple[int, int]], count: int) -> np.ndarray:
    """(count,) number of the connected group of every bone, from 0."""
    first, second = np.array(list(pairs), int).reshape(-1, 2).T
    links = coo_array((np.ones(len(first)), (first, second)), shape=(count, count))
    return connected_components(links, directed=False)[1]


def _missing_links(
    meetings: dict[tuple[int, int], tuple[float, np.ndarray]],
    chosen: set[tuple[int, int]],
    count: int,
    anchor: int,
) -> set[tuple[int, int]]:
    """The shortest further pairs that connect every structure to the anchor."""
    reached, links = {anchor}, set()
    while len(reached) < count:
        grown = {b for pair in chosen | links for a, b in (pair, pair[::-1]) if a in reached} - reached
        if grown:
            reached |= grown
            continue
        crossing = [pair for pair in meetings if (pair[0] in reached) != (pair[1] in reached)]
        links.add(min(crossing, key=lambda pair: meetings[pair][0]))
    return links


def _sample(labels: np.ndarray, number: int, box: tuple[slice, ...], affine: np.ndarray) -> np.ndarray:
    """At most some thousand voxel centres (N, 3) LPS mm of a structure inside its box, evenly picked."""
    index = np.argwhere(labels[box] == number)
    index = index[:: max(1, len(index) // _POINTS)] + [part.start for part in box]
    return index[:, ::-1] @ affine[:3, :3].T + affine[:3, 3]


class ArticulationPrior:
    """The prior's cost, and its derivatives.

    The cost is weight / joints * the sum over joints and links of their weight * (rho(gap / slide) +
    rho(angle / TURN_DEG)) with
    rho(s) = s^2 / (1 + s^2 / c^2), which saturates at c^2 (S. Geman and D. McClure, Bulletin of the International
    Statistical Institute 52, 1987); c is 1 for angles and yields_at for gaps.

    Parameters
    ----------
    articulations : sequence of Articulation
        The joints.
    centres : (K, 3) ndarray
        LPS mm, about which poses are perturbed.
    free_poses : sequence of int
        Structures that move, in the order of the unknowns.
    weight : float
        In units of the images' cost.

    """

    def __init__(
        self,
        articulations: Sequence[Articulation],
        centres: np.ndarray,
        free_poses: Sequence[int],
        weight: float,
    ) -> None:
        self.articulations = list(articulations)
        self.centres = centres
        self.free_poses = list(free_poses)
        self.weight = weight
        self._pairs = np.array([(j.first, j.second) for j in articulations], int).reshape(-1, 2)
        self._points = np.array([j.point for j in articulations], float).reshape(-1, 3)
        self._slides = np.array([j.slide_mm for j in articulations], float).reshape(-1, 1)
        self._limits = np.array([j.yields_at for j in articulations], float).reshape(-1, 1)
        self._roots = np.sqrt([j.weight for j in articulations]).reshape(-1, 1)

    def cost(self, poses: np.ndarray) -> float:
        """For poses (K, 4, 4) fixed to moving."""
        return float(self.costs(poses[None])[0])

    def costs(self, poses: np.ndarray) -> np.ndarray:
        """(S,) for poses (S, K, 4, 4) fixed to moving."""
        return self._scale() * (self._residuals(poses) ** 2).sum(axis=(-2, -1))

    def add_to(self, poses: np.ndarray, matrix: np.ndarray, gradient: np.ndarray) -> float:
        """Add the Gauss-Newton terms of half the cost to ``matrix`` (P, P) and ``gradient`` (P,); returns the cost."""
        residuals = self._residuals(poses)
        for joint, root, residual in zip(self.articulations, self._roots[:, 0], residuals, strict=True):
            blocks = []
            for sign, k in ((1.0, joint.first), (-1.0, joint.second)):
                if k in self.free_poses:
                    first = 6 * self.free_poses.index(k)
                    blocks.append(
                        (slice(first, first + 6), sign * self._derivative(joint, k, poses, residual / root))
                    )
            for rows, a in blocks:
                gradient[rows] += self._scale() * (a.T @ residual)
                for columns, b in blocks:
                    matrix[rows, columns] += self._scale() * (a.T @ b)
        return self._scale() * float((residuals**2).sum())

    def strain(self, poses: np.ndarray) -> float:
        """How far joints are from where the CT has them, in squared standard deviations, for poses (K, 4, 4).

        Unlike in the cost, rotations do not saturate: of two places that the X-rays do not tell apart the one at which
        a joint turned by 50 degrees is less likely than one at 20.
        """
        gaps, turns = self._deviations(poses)
        gaps = _saturated(gaps, self._limits)
        return float((self._roots**2 * (gaps**2 + turns**2)).sum())

    def _scale(self) -> float:
        return self.weight / max(_joint_count(self.articulations), 1)

    def _residuals(self, poses: np.ndarray) -> np.ndarray:
        """(..., J, 6) gap (fixed frame) over slide and rotation over TURN_DEG of joints, saturated, by their weights.

        poses: (..., K, 4, 4).
        """
        gaps, turns = self._deviations(poses)
        both = [_saturated(gaps, self._limits), _saturated(turns, 1.0)]
        return self._roots * np.concatenate(both, axis=-1)

    def _deviations(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(..., J, 3) gaps (fixed frame) over slide, and rotations over TURN_DEG, of poses (..., K, 4, 4)."""
        bones = rigid_inverse(poses[..., self._pairs, :, :])
        first, second = bones[..., 0, :, :], bones[..., 1, :, :]
        apart = (first - second)[..., :3, :]
        gap = (apart[..., :3] @ self._points[..., None])[..., 0] + apart[..., 3]
        turn = rotation_vectors(first[..., :3, :3] @ np.swapaxes(second[..., :3, :3], -1, -2))
        return gap / self._slides, turn / np.radians(TURN_DEG)

    def _derivative(self, joint: Articulation, k: int, poses: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """(6, 6) derivative of the joint's residual by the perturbation of pose k; residual: (6,) of weight 1."""
        back = poses[k, :3, :3].T
        derivative = np.zeros((6, 6))
        derivative[:3, :3] = back @ skew(joint.point - self.centres[k]) / joint.slide_mm
        derivative[:3, 3:] = -back / joint.slide_mm
        derivative[3:, :3] = -back / np.radians(TURN_DEG)
        derivative[:3] = _saturation_slope(residual[:3], joint.yields_at) @ derivative[:3]
        derivative[3:] = _saturation_slope(residual[3:], 1.0) @ derivative[3:]
        return np.sqrt(joint.weight) * derivative


def _joint_count(articulations: Sequence[Articulation]) -> int:
    """Links of companions add to the cost of joints, and must not dilute it."""
    return sum(each.is_joint for each in articulations)


def _saturated(vectors: np.ndarray, limits: np.ndarray | float) -> np.ndarray:
    """Vectors (..., J, 3) shortened so that none is longer than its limit (J, 1)."""
    return vectors / np.sqrt(1 + (vectors**2).sum(axis=-1, keepdims=True) / limits**2)


def _saturation_slope(saturated: np.ndarray, limit: float) -> np.ndarray:
    """(3, 3) derivative of a saturated vector (3,) by the vector itself."""
    inner = saturated / limit
    return np.sqrt(max(1 - inner @ inner, 0.0)) * (np.eye(3) - np.outer(inner, inner))


class OneBonePrior:
    """The prior of one bone's own joints as a function of its pose, the others standing still."""

    def __init__(
        self, prior: ArticulationPrior, number: int, poses: np.ndarray, factor: float | None = None
    ) -> None:
        """number: of the bone; poses: (K, 4, 4) of all.

        factor: on the prior's weight, each joint counting as it does there; None for the weight over the own joints.
        """
        own = [joint for joint in prior.articulations if number in (joint.first, joint.second)]
        weight = prior.weight
        if factor is not None:
            weight *= factor * _joint_count(own) / max(_joint_count(prior.articulations), 1)
        self._prior = ArticulationPrior(own, prior.centres, [number], weight)
        self._number, self._poses = number, poses

    def cost(self, poses: np.ndarray) -> float:
        """For poses (1, 4, 4)."""
        return float(self.costs(poses[None])[0])

    def costs(self, poses: np.ndarray) -> np.ndarray:
        """(S,) for poses (S, 1, 4, 4)."""
        return self._prior.costs(self._all(poses))

    def strain(self, pose: np.ndarray) -> float:
        """As :meth:`ArticulationPrior.strain`, of the bone's own joints, for its pose (4, 4)."""
        return self._prior.strain(self._all(pose[None]))

    def add_to(self, poses: np.ndarray, matrix: np.ndarray, gradient: np.ndarray) -> float:
        """As :meth:`ArticulationPrior.add_to`."""
        return self._prior.add_to(self._all(poses), matrix, gradient)

    def _all(self, poses: np.ndarray) -> np.ndarray:
        """(..., K, 4, 4) those of all bones, where this one's are (..., 1, 4, 4)."""
        full = np.empty((*poses.shape[:-3], *self._poses.shape))
        full[:] = self._poses
        full[..., self._number, :, :] = poses[..., 0, :, :]
        return full
