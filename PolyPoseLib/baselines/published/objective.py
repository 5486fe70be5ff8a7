"""The paper's objective at one level: mean gmNCC of the X-rays with renderings of the polyrigidly warped CT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from PolyPoseLib.baselines.published.projector import ImageScore, Sampling
from PolyPoseLib.baselines.published.projectors import polyrigid_projector
from PolyPoseLib.data.paper_options import PUBLISHED, PaperOptions
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.geometry.rigid import about
from PolyPoseLib.registration.fit.problem import Normal
from PolyPoseLib.registration.run import Run
from PolyPoseLib.similarity.gmncc_curvature import gmncc_curvature
from PolyPoseLib.similarity.ncc import gmncc
from PolyPoseLib.similarity.torch_threads import one_torch_thread
from PolyPoseLib.warp.polyrigid import PolyrigidWarp

WEIGHTS_BYTES = 3 << 28
"""Memory in which the samples' weights of all views are kept together."""


@dataclass(frozen=True)
class View:
    """One X-ray at one resolution.

    Attributes
    ----------
    image : np.ndarray
        (H, W) float32 line integrals.
    mask : np.ndarray
        (H, W) bool, True where it counts.
    camera : Camera
        With the image's size.

    """

    image: np.ndarray
    mask: np.ndarray
    camera: Camera


class PolyrigidObjective:
    """Similarity as a function of the poses' parameters (K, 6), fixed to moving; also a least-squares problem.

    A row [rotation (rad), translation part (mm)] is the logarithm of a pose about its structure's centroid. As a
    :class:`Problem` the cost is twice one minus the similarity (0 = identical), of the structures that move.

    Parameters
    ----------
    run : Run
        The patient and the renderer.
    volume : Grid
        The CT in 1/mm with a border of zeros.
    warp : PolyrigidWarp
        Gives the weights.
    views : sequence of View
        The X-rays at one resolution.
    step_mm : float
        Distance of ray samples.
    options : PaperOptions
        Whether the anchor moves, and the blur of the gradient term.

    """

    def __init__(
        self,
        run: Run,
        volume: Grid,
        warp: PolyrigidWarp,
        views: Sequence[View],
        step_mm: float,
        options: PaperOptions = PUBLISHED,
    ) -> None:
        sampling = Sampling(step_mm, weights_bytes=WEIGHTS_BYTES // len(views))
        self.views = list(views)
        self.projectors = [
            polyrigid_projector(volume, warp, view.camera, sampling, run.backend) for view in views
        ]
        self.blur_px = options.gradient_blur_px
        self.scores = [gmncc_with_gradient(view.image, view.mask, self.blur_px) for view in views]
        self.centres = run.scene.centres
        free = options.anchor == "free"
        self.moving = list(range(len(run.scene.names))) if free else run.scene.moving
        self.levers = self.centres - warp.center.cpu().numpy()

    def __call__(self, parameters: np.ndarray) -> tuple[float, np.ndarray]:
        """Similarity and its gradient (K, 6)."""
        logs = self._about_one_centre(parameters)
        found = [p.scored(logs, score) for p, score in zip(self.projectors, self.scores, strict=True)]
        gradient = np.mean([each.gradient for each in found], axis=0)
        return float(np.mean([each.value for each in found])), self._about_centroids(gradient)

    def value(self, parameters: np.ndarray) -> float:
        """Similarity alone."""
        logs = self._about_one_centre(parameters)
        pairs = zip(self.projectors, self.scores, strict=True)
        return float(np.mean([score(projector.image(logs))[0] for projector, score in pairs]))

    @property
    def size(self) -> int:
        """Number of scalar unknowns."""
        return 6 * len(self.moving)

    def cost(self, parameters: np.ndarray) -> float:
        """Twice one minus the similarity."""
        return 2 * (1 - self.value(parameters))

    def moved(self, parameters: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Parameters after a step (P,) of the structures that move."""
        changed = parameters.copy()
        changed[self.moving] += step.reshape(-1, 6)
        return changed

    def normal_equations(self, parameters: np.ndarray) -> Normal:
        """Gauss-Newton normal equations of the structures that move."""
        logs = self._about_one_centre(parameters)
        values, gradient, curvature = [], np.zeros(self.size), np.zeros((self.size, self.size))
        for view, projector, score in zip(self.views, self.projectors, self.scores, strict=True):
            image, jacobian = projector.image_and_jacobian(logs)
            value, slope = score(image)
            by_pixel = self._about_centroids(np.moveaxis(jacobian, (0, 1), (-2, -1)))
            columns = np.moveaxis(by_pixel, (-2, -1), (0, 1))[self.moving].reshape(self.size, *image.shape)
            values.append(value)
            gradient += np.tensordot(columns, slope, 2)
            curvature += gmncc_curvature(image, view.mask, columns, self.blur_px)
        count = len(self.views)
        return Normal(2 * (1 - float(np.mean(values))), curvature / count, -gradient / count)

    def _about_one_centre(self, parameters: np.ndarray) -> np.ndarray:
        """Logarithms (K, 6) about the warp's centre: the adjoint of the shift from there to the centroids."""
        logs = np.array(parameters, float)
        logs[:, 3:] += np.cross(self.levers, logs[:, :3])
        return logs

    def _about_centroids(self, gradient: np.ndarray) -> np.ndarray:
        """Derivatives (..., K, 6) by the parameters, of those by the logarithms about one centre."""
        turned = gradient[..., :3] + np.cross(gradient[..., 3:], self.levers)
        return np.concatenate([turned, gradient[..., 3:]], axis=-1)


def poses_of(parameters: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Poses (K, 4, 4) fixed to moving, whose logarithms about the centres (K, 3) LPS mm are the parameters (K, 6)."""
    motions = se3.exp(torch.as_tensor(np.asarray(parameters, np.float64))).numpy()
    return np.stack([about(motion, centre) for motion, centre in zip(motions, centres, strict=True)])


def gmncc_with_gradient(target: np.ndarray, mask: np.ndarray, blur_px: float = 0.0) -> ImageScore:
    """The gmNCC of images with a target, and its derivative.

    Parameters
    ----------
    target : (H, W) ndarray
        float32 line integrals.
    mask : (H, W) ndarray
        bool, True where a pixel counts.
    blur_px : float
        Of the gradient term, see :func:`PolyPoseLib.similarity.ncc.blurred`.

    Returns
    -------
    callable
        Takes an image (H, W) and returns its gmNCC in [-1, 1] with the derivative (H, W).

    """
    other, use = torch.as_tensor(target)[None], torch.as_tensor(mask)

    def score(image: np.ndarray) -> tuple[float, np.ndarray]:
        picture = torch.as_tensor(image)[None].requires_grad_()
        with one_torch_thread():
            value = gmncc(picture, other, use, blur_px)[0]
            (slope,) = torch.autograd.grad(value, picture)
        return float(value.detach()), slope[0].numpy()

    return score
