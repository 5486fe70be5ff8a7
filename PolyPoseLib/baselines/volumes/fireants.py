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

SETTINGS = {
    "scales": [4, 2, 1],
    "iterations": [200, 100, 25],
    "cc_kernel_size": 5,
    "smooth_grad_sigma": 1.0,
    "optimizer_lr": 0.5,
}
"""Of the quickstart in the package's documentation; its scripts for brains have the same.

Its script for CT of lungs (scripts/hyperparameter_tuning/tune_empire10.py: scales 6, 4, 2, 1; 200, 150, 75, 25
iterations; gradients smoothed by 6 voxels, rate 0.25, volumes from 0 to 1) is made for voxels of less than 1 mm. With
3 mm, a sixth of the resolution shows little but outlines: from nine views of a pelvis it ended 12 mm from the truth,
the quickstart 4 mm. With volumes from 0 to 1 the quickstart ended 6 mm from it: the package's correlation takes
contrasts below some thousandths for none. Hence HU.
"""


class FdkFireAnts(FdkSystem):
    """FDK, then FireANTs' greedy registration with masked local cross-correlation; no affine stage, as for greedy."""

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
            masks: Any = importlib.import_module("fireants.io.imagemask")
            greedy: Any = importlib.import_module("fireants.registration.greedy")
            fixed, moving = (images.Image(each, device=setting.device) for each in pair.images())
            seen = images.Image(pair.seen_image(), device=setting.device)
            # The package masks both or none, by a further channel.
            everywhere = masks.generate_image_mask_allones(moving)
            fixed, moving = (
                images.BatchedImages([masks.apply_mask_to_image(image, mask)])
                for image, mask in ((fixed, seen), (moving, everywhere))
            )
            registration = greedy.GreedyRegistration(
                fixed_images=fixed,
                moving_images=moving,
                loss_type="masked_cc",
                loss_params={},  # the package writes to its default, which all registrations share
                progress_bar=False,
                **SETTINGS,
            )
            registration.optimize()
            with torch.no_grad():
                # (1, k, j, i, 3), (x, y, z) from -1 to 1 between the outermost voxels' centres.
                warped = registration.get_warped_coordinates(fixed, moving)[0].cpu().numpy()
        size = np.array(pair.fixed.shape[::-1])
        moved = pair.origin + (warped + 1) / 2 * (size - 1) * pair.spacing_mm
        return finite_field(pair, (moved - pair.points()).astype(np.float32), self.name)
