"""What a view contributes to the normal equations of the soft tissue's motion, by numpy or on torch's device."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from PolyPoseLib.registration.fit.device_views import DeviceView
from PolyPoseLib.registration.fit.problem import View
from PolyPoseLib.similarity.local_contrast import NormalisedImage

CHANGES_AT_ONCE = 32
"""Derivatives that are normalised at once on a device, each with some ten temporary images of float64."""


@dataclass(frozen=True)
class Products:
    """Weighted sums over a view's pixels.

    Attributes
    ----------
    matrix : (P, P) ndarray
        Of the residual's derivatives by P unknowns with each other.
    gradient : (P,) ndarray
        Of the derivatives with the residual.

    """

    matrix: np.ndarray
    gradient: np.ndarray


def products(view: View, image: NormalisedImage, weight: np.ndarray, changes: np.ndarray) -> Products:
    """Sums of a view.

    Parameters
    ----------
    view : View
        The X-ray.
    image : NormalisedImage
        Its rendering.
    weight : (H, W) ndarray
        Of the pixels.
    changes : (P, H, W) ndarray
        Derivatives of the rendering before it is normalised.

    """
    whole = (0, view.camera.height, 0, view.camera.width)
    changes = view.contrast.derivative(image, changes, whole)[0].reshape(len(changes), -1)
    weighted = changes * weight.reshape(-1)
    residual = image.values - view.target
    return Products(weighted @ changes.T, weighted @ residual.reshape(-1))


def device_products(view: View, bones: np.ndarray, weight: np.ndarray, changes: Tensor) -> Products:
    """The same on the changes' device, which are overwritten; bones: (H, W) their line integrals, without static."""
    shown = DeviceView.of(replace(view, weight=weight), changes.device)
    image = shown.normalised(torch.as_tensor(bones, dtype=torch.float64, device=changes.device)[None])
    for start in range(0, len(changes), CHANGES_AT_ONCE):
        part = changes[None, start : start + CHANGES_AT_ONCE]
        part[:] = shown.derivatives(image, part)
    flat, root = changes.flatten(1), shown.weight.sqrt().float()
    flat *= root.reshape(-1)
    residual = ((image.values[0] - shown.target) * root).float()
    found = torch.cat([flat @ flat.T, (flat @ residual.reshape(-1))[:, None]], dim=1).cpu().numpy()
    return Products(found[:, :-1], found[:, -1])
