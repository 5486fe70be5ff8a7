"""The paper's objective at one level: mean gmNCC of the X-rays with renderings of the polyrigidly warped CT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from PolyPoseLib.baselines.published.optimizers import Expansion
from PolyPoseLib.baselines.published.projector import Judge
from PolyPoseLib.baselines.published.projectors import polyrigid_projector
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import about
from PolyPoseLib.rendering.backend import Backend
from PolyPoseLib.similarity.gmncc_curvature import gmncc_curvature
from PolyPoseLib.similarity.ncc import gmncc
from PolyPoseLib.similarity.torch_threads import one_torch_thread
from PolyPoseLib.warp.polyrigid import PolyrigidWarp

WEIGHTS_BYTES = 3 << 28
"""Memory in which the samples' weights of all views are kept together."""


@dataclass(frozen=True)
class View:
    """image: (H, W) float32 line integrals; mask: (H, W) bool, True where it counts; camera: of this size."""

    image: np.ndarray
    mask: np.ndarray
    camera: Camera


class PolyrigidObjective:
    """Similarity as a function of the poses' parameters (K, 6), fixed to moving.

    A row [rotation (rad), translation part (mm)] is the logarithm of a pose about its structure's centroid. voxels:
    (D, H, W) in 1/mm with a border of zeros; affine: (4, 4); warp: gives the weights; centres: (K, 3) centroids,
    LPS mm; step_mm: distance of ray samples.
    """

    def __init__(
        self,
        voxels: np.ndarray,
        affine: np.ndarray,
        warp: PolyrigidWarp,
        views: Sequence[View],
        centres: np.ndarray,
        step_mm: float,
        backend: Backend,
    ) -> None:
        room = WEIGHTS_BYTES // len(views)
        self.views = list(views)
        self.projectors = [
            polyrigid_projector(voxels, affine, warp, view.camera, step_mm, backend, weights_bytes=room)
            for view in views
        ]
        self.judges = [gmncc_with_gradient(view.image, view.mask) for view in views]
        self.centres = np.asarray(centres, float)
        self.levers = self.centres - warp.center.cpu().numpy()

    def __call__(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """Similarity and its gradient (K, 6)."""
        logs = self._about_one_centre(parameters)
        found = [p.judged(logs, judge) for p, judge in zip(self.projectors, self.judges, strict=True)]
        gradient = np.mean([each.gradient for each in found], axis=0)
        return float(np.mean([each.value for each in found])), self._about_centroids(gradient)

    def value(self, parameters: np.ndarray) -> float:
        """Similarity alone."""
        logs = self._about_one_centre(parameters)
        pairs = zip(self.projectors, self.judges, strict=True)
        return float(np.mean([judge(projector.image(logs))[0] for projector, judge in pairs]))

    def expand(self, parameters: np.ndarray, which: Sequence[int]) -> Expansion:
        """Similarity, gradient and curvature by the parameters of some structures, six each."""
        logs = self._about_one_centre(parameters)
        size = 6 * len(which)
        values, gradient, curvature = [], np.zeros(size), np.zeros((size, size))
        for view, projector, judge in zip(self.views, self.projectors, self.judges, strict=True):
            image, jacobian = projector.image_and_jacobian(logs)
            value, slope = judge(image)
            by_pixel = self._about_centroids(np.moveaxis(jacobian, (0, 1), (-2, -1)))
            columns = np.moveaxis(by_pixel, (-2, -1), (0, 1))[list(which)].reshape(size, *image.shape)
            values.append(value)
            gradient += np.tensordot(columns, slope, 2)
            curvature += gmncc_curvature(image, view.mask, columns)
        count = len(self.views)
        return Expansion(float(np.mean(values)), gradient / count, curvature / count)

    def poses(self, parameters: np.ndarray) -> np.ndarray:
        """Poses (K, 4, 4) fixed to moving."""
        motions = se3.exp(torch.as_tensor(np.asarray(parameters, np.float64))).numpy()
        return np.stack([about(m, centre) for m, centre in zip(motions, self.centres, strict=True)])

    def _about_one_centre(self, parameters: np.ndarray) -> np.ndarray:
        """Logarithms (K, 6) about the warp's centre: the adjoint of the way from there to the centroids."""
        logs = np.array(parameters, float)
        logs[:, 3:] += np.cross(self.levers, logs[:, :3])
        return logs

    def _about_centroids(self, gradient: np.ndarray) -> np.ndarray:
        """Derivatives (..., K, 6) by the parameters, of those by the logarithms about one centre."""
        turned = gradient[..., :3] + np.cross(gradient[..., 3:], self.levers)
        return np.concatenate([turned, gradient[..., 3:]], axis=-1)


def gmncc_with_gradient(target: np.ndarray, mask: np.ndarray) -> Judge:
    """Returns a function of an image (H, W): its gmNCC with ``target`` over ``mask``, and the derivative (H, W)."""
    other, use = torch.as_tensor(target)[None], torch.as_tensor(mask)

    def judge(image: np.ndarray) -> tuple[float, np.ndarray]:
        picture = torch.as_tensor(image)[None].requires_grad_()
        with one_torch_thread():
            value = gmncc(picture, other, use)[0]
            (slope,) = torch.autograd.grad(value, picture)
        return float(value.detach()), slope[0].numpy()

    return judge
