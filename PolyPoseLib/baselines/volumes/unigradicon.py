"""The registration networks uniGradICON and multiGradICON, with and without instance optimisation.

References
----------
L. Tian et al., "uniGradICON: a foundation model for medical image registration", MICCAI 2024; B. Demir et al.,
"multiGradICON: a foundation model for multimodal medical image registration", WBIR 2024. Apache-2.0.

"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F

from PolyPoseLib.baselines.volumes.fdk_system import FdkSystem, finite_field, quiet_package, stop_if_cancelled
from PolyPoseLib.baselines.volumes.pair import VolumePair
from PolyPoseLib.baselines.weights import load_weights, weights_file
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField

NETWORK_VOXELS = 175
"""Along every side of what the networks were trained on."""

CT_WINDOW_HU = (-1000.0, 1000.0)
"""To which both volumes are clipped, and which becomes 0 to 1."""

STEPS = 50
LEARNING_RATE = 2e-5
SIGMA = 5
"""Of the instance optimisation, and of the local cross-correlation that it maximises: the package's own."""


class _GradIcon(FdkSystem):
    """FDK, then one of the two networks."""

    needs = ("itk-rtk", "icon-registration", "unigradicon")
    modules = ("itk.RTKPython", "icon_registration", "unigradicon")
    fixes = dict.fromkeys(
        ("icon-registration", "unigradicon"),
        "pip install --no-deps unigradicon icon_registration footsteps tqdm (what else they ask for is for training)",
    )
    model: str
    """Whose weights: they are one file with and without instance optimisation."""

    source: str
    """Where they come from."""

    steps = 0
    """Of instance optimisation."""

    voxels = NETWORK_VOXELS

    def require(self, setting: SystemSetting) -> None:
        """Packages, and the file of weights, before anything is computed."""
        super().require(setting)
        self._file(setting)

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        path = self._file(setting)
        package: Any = importlib.import_module("unigradicon")
        config: Any = importlib.import_module("icon_registration.config")
        icon: Any = importlib.import_module("icon_registration")
        config.device = torch.device(setting.device)
        with quiet_package(setting):
            network = package.make_network(
                [1, 1, *[self.voxels] * 3], include_last_step=True, loss_fn=icon.LNCC(sigma=SIGMA)
            )
            load_weights(network.regis_net, path, self.name)
            network.to(config.device).eval()
            moving, fixed = (self._network_input(each, config.device) for each in (pair.moving, pair.fixed))
            self._optimise(network, moving, fixed, setting)
            with torch.no_grad():
                network(moving, fixed)
                # The first image sampled here looks like the second: from fixed to moving points.
                moved = network.phi_AB_vectorfield - network.identity_map
        return self._field(pair, moved[0].cpu().numpy())

    def _file(self, setting: SystemSetting):
        """The weights given for this system, or else for the one that shares them."""
        name = self.name if self.name in setting.weights else self.model
        return weights_file(setting, name, self.source)

    def _network_input(self, hu: np.ndarray, device: torch.device) -> torch.Tensor:
        """(1, 1, n, n, n) from 0 to 1."""
        low, high = CT_WINDOW_HU
        scaled = (np.clip(hu, low, high) - low) / (high - low)
        tensor = torch.from_numpy(scaled.astype(np.float32))[None, None].to(device)
        return F.interpolate(tensor, size=[self.voxels] * 3, mode="trilinear", align_corners=False)

    def _optimise(
        self, network: Any, moving: torch.Tensor, fixed: torch.Tensor, setting: SystemSetting
    ) -> None:
        """Instance optimisation: the weights themselves, by Adam on the loss of the network's training."""
        optimiser = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
        for step in range(self.steps):
            stop_if_cancelled(setting)
            optimiser.zero_grad()
            loss = network(moving, fixed)
            loss.all_loss.backward()
            optimiser.step()
            setting.progress(step + 1, self.steps, -float(loss.similarity_loss.detach()))
            network.clean()

    def _field(self, pair: VolumePair, moved: np.ndarray) -> DisplacementField:
        """The network's displacements (3, n, n, n), along k, j, i, of which 1 is its first to its last voxel's centre.

        Its voxels divide the pair's volume evenly: their centres are half a voxel inside of the volume's edges.
        """
        size = np.array(pair.fixed.shape[::-1])
        spacing = size * pair.spacing_mm / self.voxels
        affine = np.diag([*spacing, 1.0])
        affine[:3, 3] = pair.origin + (spacing - pair.spacing_mm) / 2
        vectors = np.moveaxis(moved, 0, -1)[..., ::-1] * (self.voxels - 1) * spacing
        coarse = DisplacementField(vectors, affine) if np.isfinite(vectors).all() else None
        sampled = np.full((1,), np.nan) if coarse is None else coarse.sample(pair.points()).astype(np.float32)
        return finite_field(pair, sampled, self.name)


class FdkUniGradIcon(_GradIcon):
    """One pass of uniGradICON."""

    name = "fdk-unigradicon"
    model = "fdk-unigradicon"
    source = "Step_2_final.trch of the release unigradicon_weights at https://github.com/uncbiag/uniGradICON/releases"


class FdkUniGradIconIo(FdkUniGradIcon):
    """The same with 50 steps of instance optimisation."""

    name = "fdk-unigradicon-io"
    steps = STEPS


class FdkMultiGradIcon(_GradIcon):
    """One pass of multiGradICON."""

    name = "fdk-multigradicon"
    model = "fdk-multigradicon"
    source = "Step_2_final.trch of the release multigradicon_weights at https://github.com/uncbiag/uniGradICON/releases"


class FdkMultiGradIconIo(FdkMultiGradIcon):
    """The same with 50 steps of instance optimisation."""

    name = "fdk-multigradicon-io"
    steps = STEPS
