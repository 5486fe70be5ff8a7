"""The polyrigid warp: every point moves by the exponential of a weighted mean of the structures' logarithms.

warp(x) = exp(sum_k w_k(x) log T_k) x, with T_k the motion of structure k, fixed to moving (V. Arsigny et al.,
"A fast and log-Euclidean polyaffine framework for locally linear registration", JMIV 2009). Two frames:

- "moving": w_k(x) is made of the distances d_k(T_k x), so that the weights travel with the bones. With the
  "rigid" weights every bone is exactly rigid: warp(x) = T_k x wherever T_k x lies inside bone k (and no other
  bone claims x as well).
- "fixed": w_k(x) is made of d_k(x), as in the paper. The weights then never change while the poses do, but
  bones that move far bend, because their weights stay behind.

The branch of the logarithm. The logarithm of a rotation by more than 180 degrees does not exist on the
principal branch: there the rotation vector jumps to its antipode, and soft tissue between two bones would
turn in the opposite direction. Motions are relative to the anchor, whose motion is the identity, so the
principal branch puts the jump as far from the anatomy as it can be, and joints do not reach it. PolyrigidWarp
therefore takes the principal branch and refuses rotations of more than MAX_ROTATION_DEG, where it is about to
jump.

Rotation falloff. A rotation that is extrapolated far beyond its bone moves tissue further than any bone: at 100 mm
from a femur that turns by 13 degrees, by 23 mm. Tissue at the distance d therefore takes the share
1 / (1 + (d / reach)^2) of a bone's own motion, and for the rest only the displacement of the bone's centroid, without
its rotation: it keeps the orientation of the anchor. On the bone the share is 1, so bones stay rigid; an infinite
reach gives back the plain mean.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import Literal

import numpy as np
import torch
from torch import Tensor
from torch.utils.checkpoint import checkpoint

from PolyPoseLib.data.options import USUAL_EPSILON
from PolyPoseLib.errors import InputError, NotFiniteError
from PolyPoseLib.geometry import se3
from PolyPoseLib.warp.weights import DistanceMaps, WeightForm, weights

WeightFrame = Literal["moving", "fixed"]
"""Where distances are measured: at T_k x, so that weights travel with the bones, or at x."""

MAX_ROTATION_DEG = 175.0
"""Rotations above this are refused: their logarithm is about to change its sign."""

POINTS_PER_CHUNK = 1 << 17
"""Points that are warped at once; with 26 structures a chunk takes about 200 MiB, twice that with gradients."""


@dataclass(frozen=True)
class RotationFalloff:
    """How far bones turn the tissue around them.

    Attributes
    ----------
    reach_mm : float
        Distance at which tissue takes half of a bone's rotation.
    centroids : (K, 3) array
        Of the structures in the CT, moving LPS mm.

    Raises
    ------
    InputError
        The reach is not a finite number above 0.

    """

    reach_mm: float
    centroids: np.ndarray

    def __post_init__(self) -> None:
        """Check the reach."""
        if not 0 < self.reach_mm < np.inf:
            raise InputError(
                f"The reach of a bone's rotation is {self.reach_mm:g} mm; give a finite distance above 0 mm."
            )


class PolyrigidWarp:
    """A warp of fixed points to moving points by K structures' motions.

    Parameters
    ----------
    distances : DistanceMaps
        Maps of K structures.
    share : (K,) Tensor or array
        Their shares of the structures' volume, above 0.
    poses : (K, 4, 4) Tensor or array
        Fixed to moving, LPS mm, float64; gradients flow into them.
    frame : {"moving", "fixed"}
        Where distances are measured: at T_k x, or at x.
    form : {"rigid", "mass", "epsilon"}
        Form of the weights, see :func:`PolyPoseLib.warp.weights.weights`.
    epsilon : float
        1/mm^2, for the form "epsilon".
    center : (3,) array, optional
        LPS mm about which logarithms are taken; the middle of the distance maps' grid by default. The warp is the
        same for every center (a logarithm changes by the adjoint, and so does the mean of several); one near the
        anatomy keeps translations small and digits many.
    rotation_falloff : RotationFalloff, optional
        By default every bone rotates all tissue, however far.

    Raises
    ------
    InputError
        Shapes that do not fit, poses that are not finite, an unknown frame, or a rotation above
        MAX_ROTATION_DEG.

    References
    ----------
    V. Arsigny et al., "A fast and log-Euclidean polyaffine framework for locally linear registration", JMIV 2009.

    """

    def __init__(
        self,
        distances: DistanceMaps,
        share: Tensor | np.ndarray,
        poses: Tensor | np.ndarray,
        frame: WeightFrame = "moving",
        form: WeightForm = "rigid",
        epsilon: float = USUAL_EPSILON,
        center: np.ndarray | None = None,
        rotation_falloff: RotationFalloff | None = None,
    ) -> None:
        """Check the arguments and take the logarithms."""
        device = distances.signed.device
        self.distances = distances
        self.frame: WeightFrame = frame
        self.form: WeightForm = form
        self.epsilon, self.rotation_falloff = epsilon, rotation_falloff
        self.share = torch.as_tensor(share, dtype=torch.float64, device=device)
        self.poses = torch.as_tensor(poses, dtype=torch.float64, device=device)
        count = distances.count
        if self.share.shape != (count,) or not bool((self.share > 0).all()):
            raise InputError(f"The warp needs {count} volume shares above 0, not {self.share.tolist()}.")
        if self.poses.shape != (count, 4, 4):
            raise InputError(
                f"The warp needs poses of shape ({count}, 4, 4), one for each structure, "
                f"not {tuple(self.poses.shape)}."
            )
        if not bool(torch.isfinite(self.poses).all()):
            raise NotFiniteError("A pose of the warp holds NaN or infinity: the registration diverged.")
        if frame not in ("moving", "fixed"):
            raise InputError(f"The weights' frame {frame!r} is not known; choose 'moving' or 'fixed'.")
        if rotation_falloff is not None and rotation_falloff.centroids.shape != (count, 3):
            raise InputError(
                f"The warp needs {count} centroids (x, y, z), one for each structure, not an array of shape "
                f"{rotation_falloff.centroids.shape}."
            )
        middle = _grid_center(distances) if center is None else np.asarray(center, dtype=np.float64)
        self.center = torch.as_tensor(middle, dtype=torch.float64, device=device)
        self.logs = se3.log(_about(self.poses, self.center))
        if self.largest_rotation_deg > MAX_ROTATION_DEG:
            raise InputError(
                f"A structure is rotated by {self.largest_rotation_deg:.1f} degrees against the anchor; "
                f"above {MAX_ROTATION_DEG:g} the direction of the rotation is ambiguous: check the cameras."
            )

    @property
    def largest_rotation_deg(self) -> float:
        """Largest rotation of a structure against the anchor, in degrees."""
        return degrees(float(self.logs.detach()[:, :3].norm(dim=1).max()))

    def with_poses(self, poses: Tensor | np.ndarray) -> PolyrigidWarp:
        """The same warp with other poses (K, 4, 4), fixed to moving, LPS mm."""
        return PolyrigidWarp(
            self.distances,
            self.share,
            poses,
            self.frame,
            self.form,
            self.epsilon,
            self.center.cpu().numpy(),
            self.rotation_falloff,
        )

    @property
    def shifts(self) -> Tensor:
        """(K, 3) mm, how far each structure's centroid moves from its fixed to its moving place."""
        if self.rotation_falloff is None:
            return torch.zeros_like(self.poses[:, :3, 3])
        moving = torch.as_tensor(
            self.rotation_falloff.centroids, dtype=torch.float64, device=self.poses.device
        )
        back = self.poses[:, :3, :3].transpose(1, 2)
        return moving - (back @ (moving - self.poses[:, :3, 3])[:, :, None])[:, :, 0]

    def weights(self, points: Tensor) -> Tensor:
        """Weights (K, N) of the structures at fixed points (N, 3) LPS mm; they sum to 1."""
        return weights(self._distance(points), self.share, self.form, self.epsilon)

    def __call__(self, points: Tensor, chunk: int = POINTS_PER_CHUNK) -> Tensor:
        """Warp fixed points to moving points.

        Differentiable in points and poses; with gradients on, chunks are recomputed in the backward pass
        instead of kept, so that memory does not grow with N.

        Parameters
        ----------
        points : (N, 3) Tensor
            Fixed points, LPS mm.
        chunk : int
            Points that are warped at once.

        Returns
        -------
        (N, 3) Tensor
            Moving points, LPS mm, in the points' type and on the maps' device.

        """
        parts = points.to(self.distances.signed.device).split(chunk)
        if torch.is_grad_enabled() and len(parts) > 1:
            return torch.cat([checkpoint(self._warp, part, use_reentrant=False) for part in parts])
        return torch.cat([self._warp(part) for part in parts])

    def jacobian(self, points: Tensor, chunk: int = POINTS_PER_CHUNK) -> Tensor:
        """Jacobian matrices of the warp.

        By automatic differentiation, exact for the interpolated distance maps (whose gradient jumps at the
        planes through their nodes). Not differentiable itself.

        Parameters
        ----------
        points : (N, 3) Tensor
            Fixed points, LPS mm.
        chunk : int
            Points that are computed at once.

        Returns
        -------
        (N, 3, 3) Tensor
            Row a, column b: d warp_a / d x_b (no unit).

        """
        rows = []
        for part in points.detach().to(self.distances.signed.device).split(chunk):
            with torch.enable_grad():
                place = part.clone().requires_grad_()
                warped = self._detached()._warp(place)
                gradients = [
                    torch.autograd.grad(warped[:, a].sum(), place, retain_graph=a < 2)[0] for a in range(3)
                ]
            rows.append(torch.stack(gradients, dim=1))
        return torch.cat(rows)

    def jacobian_determinant(self, points: Tensor, chunk: int = POINTS_PER_CHUNK) -> Tensor:
        """Determinants (N,) of the Jacobian at fixed points (N, 3); 0 or less means folding (no unit)."""
        return torch.linalg.det(self.jacobian(points, chunk))

    def _distance(self, points: Tensor) -> Tensor:
        """Distances (K, N) mm of fixed points (N, 3) to the structures, in the weights' frame."""
        return self.distances(points) if self.frame == "fixed" else self.distances.under(points, self.poses)

    def _warp(self, points: Tensor) -> Tensor:
        distance = self._distance(points)
        center = self.center.to(points)
        mean = self._mean_logs(weights(distance, self.share, self.form, self.epsilon), distance)
        return apply_exp(mean, points - center) + center

    def _mean_logs(self, weight: Tensor, distance: Tensor) -> Tensor:
        """Logarithms (N, 6) by which points move, from weights and distances (K, N)."""
        logs = self.logs.to(weight)
        if self.rotation_falloff is None:
            return weight.T @ logs
        rotating = weight / (1 + (distance / self.rotation_falloff.reach_mm) ** 2)
        shift = (weight - rotating).T @ self.shifts.to(weight)
        return rotating.T @ logs + torch.nn.functional.pad(shift, (3, 0))

    def _detached(self) -> PolyrigidWarp:
        """The same warp without the poses' gradients."""
        return self if not self.poses.requires_grad else self.with_poses(self.poses.detach())


def apply_exp(logs: Tensor, points: Tensor) -> Tensor:
    """exp(v) x for one logarithm and one point each, without forming matrices.

    Parameters
    ----------
    logs : (N, 6) Tensor
        [rotation rad, translation part mm].
    points : (N, 3) Tensor
        mm.

    Returns
    -------
    (N, 3) Tensor
        mm; equal to se3.exp(logs) applied to the points: x + A w x p + B w x (w x p) with the translation part's
        own coefficients.

    References
    ----------
    T. Barfoot, "State Estimation for Robotics", 2017, eq. 7.16 and 7.37.

    """
    rotation, translation = logs[:, :3], logs[:, 3:]
    squared = (rotation * rotation).sum(1, keepdim=True)
    small = squared < 1e-2
    safe = torch.where(small, torch.ones_like(squared), squared)
    angle = safe.sqrt()
    sine, half = torch.sin(angle), torch.sin(angle / 2)
    first = torch.where(small, 1 - squared / 6 * (1 - squared / 20 * (1 - squared / 42)), sine / angle)
    second = torch.where(
        small, 0.5 - squared / 24 * (1 - squared / 30 * (1 - squared / 56)), 2 * half * half / safe
    )
    third = torch.where(
        small,
        1 / 6 - squared / 120 * (1 - squared / 42 * (1 - squared / 72)),
        (angle - sine) / (angle * safe),
    )
    around_point = torch.linalg.cross(rotation, points)
    around_translation = torch.linalg.cross(rotation, translation)
    once = first * around_point + translation + second * around_translation
    twice = torch.linalg.cross(rotation, second * around_point + third * around_translation)
    return points + once + twice


def _about(poses: Tensor, center: Tensor) -> Tensor:
    """The motions (K, 4, 4) in coordinates whose origin is center (3,)."""
    rotation, translation = poses[:, :3, :3], poses[:, :3, 3]
    moved = translation + rotation @ center - center
    top = torch.cat([rotation, moved[:, :, None]], dim=2)
    last = poses.new_tensor([0.0, 0.0, 0.0, 1.0]).expand(len(poses), 1, 4)
    return torch.cat([top, last], dim=1)


def _grid_center(distances: DistanceMaps) -> np.ndarray:
    """Middle of the distance maps' grid (3,), LPS mm."""
    last = np.array(distances.signed.shape[:0:-1]) - 1
    return distances.affine[:3, :3] @ (last / 2) + distances.affine[:3, 3]
