"""Greedy diffeomorphic registration with adaptive Riemannian optimisation, by FireANTs.

References
----------
R. Jena, P. Chaudhari, J. C. Gee, "FireANTs: adaptive Riemannian optimization for multi-scale diffeomorphic
registration", 2024. The package has a licence of its own that asks for attribution; none of its code is here.

"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import torch

from PolyPoseLib.baselines.volumes.fdk_system import FdkSystem, finite_field, quiet_package
from PolyPoseLib.baselines.volumes.pair import VolumePair
from PolyPoseLib.data.benchmark.system import SystemSetting
from PolyPoseLib.data.displacement_field import DisplacementField

SCALES = [4, 2, 1]
ITERATIONS = [100, 50, 20]
"""Of the example in the package's own registration module; an iteration at full resolution takes seconds on a CPU."""


class FdkFireAnts(FdkSystem):
    """FDK, then FireANTs' greedy registration with local cross-correlation; no affine stage, as for greedy."""

    name = "fdk-fireants"
    needs = ("itk-rtk", "fireants")
    modules = ("itk.RTKPython", "fireants.registration.greedy")
    fixes = {  # noqa: RUF012 (never changed)
        "fireants": "pip install --no-deps fireants nibabel tqdm (it asks for an old SimpleITK, which it does not need)"
    }

    def register(self, pair: VolumePair, setting: SystemSetting) -> DisplacementField:
        """See :meth:`FdkSystem.register`."""
        with quiet_package(setting):
            images: Any = importlib.import_module("fireants.io.image")
            greedy: Any = importlib.import_module("fireants.registration.greedy")
            fixed, moving = (
                images.BatchedImages([images.Image(each, device=setting.device)]) for each in pair.images()
            )
            registration = greedy.GreedyRegistration(
                scales=SCALES,
                iterations=ITERATIONS,
                fixed_images=fixed,
                moving_images=moving,
                loss_type="cc",
                progress_bar=False,
            )
            registration.optimize()
            with torch.no_grad():
                # (1, k, j, i, 3), (x, y, z) from -1 to 1 between the outermost voxels' centres.
                warped = registration.get_warped_coordinates(fixed, moving)[0].cpu().numpy()
        size = np.array(pair.fixed.shape[::-1])
        moved = pair.origin + (warped + 1) / 2 * (size - 1) * pair.spacing_mm
        return finite_field(pair, (moved - pair.points()).astype(np.float32), self.name)
