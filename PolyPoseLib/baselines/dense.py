"""What both dense systems share: a CT on a grid of nodes, warped by a field and compared with X-rays by gmNCC.

As in the published comparison the nodes are the CT's voxels: the CT at node x is sampled at x + u(x), and the warped CT
is rendered. That comparison ran on the CT's own voxels, on a GPU; here voxels are averaged to NODE_MM or so far that
MOST_NODES suffice, so that a whole body fits a processor's memory, and Adam is scaled to match (EPSILON). Similarity
(its gradients blurred), X-rays of about 180 pixels, and 501 iterations of one Adam are those of the published program;
the attenuation of bone is not (BONE_MULTIPLIER).

References
----------
github.com/eigenvivek/polypose: experiments/deepfluoro/models.py, src/polypose/warp.py and loss.py; V. Gopalakrishnan et
al., "PolyPose: deformable 2D/3D registration via polyrigid transformations", 2025.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import grid_sample

from PolyPoseLib.baselines.known_views import known_views, over_the_ct
from PolyPoseLib.baselines.published.method import attenuation, view_of
from PolyPoseLib.baselines.published.objective import View
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.paper_options import PUBLISHED
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import CancelledError
from PolyPoseLib.geometry.grid import Grid
from PolyPoseLib.rendering.projector import render
from PolyPoseLib.rendering.select import resolve_device
from PolyPoseLib.similarity.ncc import gmncc
from PolyPoseLib.similarity.torch_threads import torch_threads

ITERATIONS = 501
PIXELS = 180

BONE_MULTIPLIER = 1.0
"""Of HU of bone. The published program has 2, which its real X-rays ask for; X-rays that are rendered from a CT, and
those of this project's detector model, are as bright as attenuation says, and a dense field answers a wrong brightness
by shrinking bones."""

EPSILON = 1e-8
"""What torch's Adam adds to the root of the second moment. A slope by one of the CT's own voxels is of that size, so it
moves less than its whole step size; a node that stands for r of them has an r times larger slope and r times this."""

NODE_MM = 4.0
MOST_NODES = 750_000
"""About 1.5 KiB each while twists are differentiated. The public pelvis (112 x 101 x 122 voxels of 3 mm) has nodes of
6 mm with it, 0.7 GiB, and with two X-rays 1.0 (DenseR3) and 1.5 (DenseSE3) processor seconds an iteration, measured
over 3 of the 501."""

COARSER = 1.15
"""Factor by which the nodes' distance grows until they are few enough."""


@dataclass(frozen=True)
class Nodes:
    """The CT on the grid of nodes.

    Attributes
    ----------
    volume : Tensor
        (D, H, W) attenuation in 1/mm.
    affine : np.ndarray
        (4, 4) index (i, j, k) to LPS mm, orthogonal axes.
    voxel_mm : np.ndarray
        (3,) the CT's own voxels along (i, j, k).

    """

    volume: Tensor
    affine: np.ndarray
    voxel_mm: np.ndarray

    @classmethod
    def of(cls, ct: Volume, device: str = "cpu", dtype: torch.dtype = torch.float32) -> Nodes:
        """Nodes at NODE_MM, or so far apart that there are at most MOST_NODES."""
        mu = Grid(attenuation(ct.voxels, BONE_MULTIPLIER), ct.affine)
        size, grid = NODE_MM, mu.coarsened(NODE_MM)
        while grid.voxels.size > MOST_NODES:
            size *= COARSER
            grid = mu.coarsened(size)
        volume = torch.as_tensor(np.ascontiguousarray(grid.voxels)).to(device, dtype)
        return cls(volume, grid.affine, ct.spacing)

    @property
    def spacing(self) -> np.ndarray:
        """Distance of nodes along (i, j, k) in mm, (3,)."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    @property
    def share(self) -> float:
        """How many of the CT's own voxels a node stands for."""
        return float(np.prod(self.spacing / self.voxel_mm))

    @property
    def axes(self) -> Tensor:
        """Unit vectors of the grid's axes, columns, (3, 3) in LPS."""
        return self._tensor(self.affine[:3, :3] / self.spacing)

    @property
    def points(self) -> Tensor:
        """The nodes (D, H, W, 3) in LPS mm about the grid's centre."""
        depth, height, width = self.volume.shape
        along = [
            self._tensor((np.arange(n) - (n - 1) / 2) * step)
            for n, step in zip((width, height, depth), self.spacing, strict=True)
        ]
        k, j, i = torch.meshgrid(along[2], along[1], along[0], indexing="ij")
        return torch.stack([i, j, k], dim=-1) @ self.axes.T

    def warped(self, displacement: Tensor) -> Tensor:
        """The volume (D, H, W) at x + u(x) for displacements u (D, H, W, 3) in mm along the grid's axes.

        Beyond the outer nodes it goes on as at the nearest one, as in the published program.
        """
        depth, height, width = self.volume.shape
        place = displacement / self._tensor(self.spacing)
        place = place + torch.stack(
            torch.meshgrid(
                *(torch.arange(n, dtype=place.dtype, device=place.device) for n in (depth, height, width)),
                indexing="ij",
            )[::-1],
            dim=-1,
        )
        place = (2 * place + 1) / self._tensor(np.array([width, height, depth])) - 1
        found = grid_sample(self.volume[None, None], place[None], padding_mode="border", align_corners=False)
        return found[0, 0]

    def differences(self, values: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Forward differences per mm of node values (D, H, W, C) along (i, j, k), (D - 1, H - 1, W - 1, C) each."""
        here = values[:-1, :-1, :-1]
        i, j, k = (float(step) for step in self.spacing)
        return (
            (values[:-1, :-1, 1:] - here) / i,
            (values[:-1, 1:, :-1] - here) / j,
            (values[1:, :-1, :-1] - here) / k,
        )

    def _tensor(self, values: np.ndarray) -> Tensor:
        return torch.as_tensor(values).to(self.volume)


class FieldModel(Protocol):
    """What is fitted: a displacement per node."""

    @property
    def groups(self) -> list[dict[str, Any]]:
        """Parameters and step sizes, as torch.optim.Adam takes them."""
        ...

    def displacement(self) -> Tensor:
        """(D, H, W, 3) mm along the grid's axes, differentiable in the parameters."""
        ...

    def penalty(self, displacement: Tensor) -> Tensor:
        """What is taken off the similarity, with its weight."""
        ...


class DenseObjective:
    """Mean gmNCC of the X-rays with renderings of the warped CT.

    Parameters
    ----------
    nodes : Nodes
        The CT.
    views : sequence of View
        X-rays at one resolution.
    step_mm : float, optional
        Distance of ray samples; the nodes' smallest by default.

    """

    def __init__(self, nodes: Nodes, views: Sequence[View], step_mm: float | None = None) -> None:
        self.nodes, self.views, self.step_mm = nodes, list(views), step_mm
        self.targets = [torch.as_tensor(view.image)[None].to(nodes.volume) for view in self.views]
        self.masks = [torch.as_tensor(view.mask).to(nodes.volume.device) for view in self.views]

    def similarity(self, displacement: Tensor, gradient: bool = False) -> float:
        """For displacements (D, H, W, 3) in mm along the grid's axes; adds its slope to the graph's leaves if asked.

        The views are rendered and differentiated one after another, so that one view's graph is kept at a time.
        """
        warped = self.nodes.warped(displacement)
        volume = warped.detach().requires_grad_(gradient)
        total = 0.0
        for view, target, mask in zip(self.views, self.targets, self.masks, strict=True):
            with torch.set_grad_enabled(gradient):
                score = gmncc(self._image(volume, view), target, mask, PUBLISHED.gradient_blur_px)[0]
                score = score / len(self.views)
            if gradient:
                score.backward()
            total += float(score.detach())
        if gradient:
            assert volume.grad is not None, "every view was differentiated"
            warped.backward(volume.grad, retain_graph=True)  # the penalty shares the displacement's graph
        return total

    def _image(self, volume: Tensor, view: View) -> Tensor:
        camera = view.camera
        return render(
            volume,
            torch.as_tensor(self.nodes.affine),
            torch.as_tensor(np.array(camera.intrinsics)),
            torch.as_tensor(np.array(camera.extrinsic))[None],
            camera.height,
            camera.width,
            self.step_mm,
        )


def fit_field(study: Study, setting: SystemSetting, make: Any, iterations: int = ITERATIONS) -> Motion:
    """Fit a model of the field to all X-rays of a study, from rest.

    Parameters
    ----------
    study : Study
        With a camera for every X-ray.
    setting : SystemSetting
        Device, threads, seed, progress and cancelling.
    make : callable
        Takes the Nodes and the seed, and returns a FieldModel.
    iterations : int
        Of Adam.

    Returns
    -------
    Motion
        Its field covers the CT; it has no poses, since nothing in it is rigid.

    Raises
    ------
    InputError
        An X-ray has no camera, or the device is missing.
    CancelledError
        The setting's ``cancelled`` returned True.

    """
    views = [view_of(each, PIXELS) for each in known_views(study)]
    with torch_threads(setting.threads):
        nodes = Nodes.of(study.ct, resolve_device(setting.device))
        model: FieldModel = make(nodes, setting.seed)
        objective = DenseObjective(nodes, views)
        optimizer = torch.optim.Adam(model.groups, maximize=True, eps=EPSILON * nodes.share)
        for iteration in range(iterations):
            if setting.cancelled():
                raise CancelledError("The fit was cancelled.")
            optimizer.zero_grad()
            displacement = model.displacement()
            similarity = objective.similarity(displacement, gradient=True)
            (-model.penalty(displacement)).backward()
            optimizer.step()
            setting.progress(iteration, iterations, similarity)
        with torch.no_grad():
            vectors = (model.displacement() @ nodes.axes.T).cpu().numpy()
    field = over_the_ct(DisplacementField(vectors, nodes.affine), study.ct)
    spacing = " x ".join(f"{step:.1f}" for step in nodes.spacing)
    return Motion(
        field, notes=(f"torch {torch.__version__}", f"{iterations} iterations on nodes of {spacing} mm")
    )
