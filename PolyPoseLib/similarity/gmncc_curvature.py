"""Curvature of gmNCC by the poses, to first order in the images (Gauss-Newton).

One minus a correlation is half the mean squared difference of the two normalised images, so that gmNCC is a sum of
least squares over patches. With a patch's mean m and variance s^2 = var + floor, an image's change J changes its
normalised image by (J - E J) / s - (a - m) c / s^3, c = E[(a - m) J], and the patch's curvature is
(E[J J'] - E J E J') / s^2 + (var / s^2 - 2) c c' / s^4.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d, pad

from PolyPoseLib.similarity.ncc import PATCH_FLOOR, blurred, blurred_mask
from PolyPoseLib.similarity.torch_threads import one_torch_thread


def gmncc_curvature(
    image: np.ndarray, mask: np.ndarray, jacobian: np.ndarray, blur_px: float = 0.0
) -> np.ndarray:
    """Curvature of 1 - gmNCC by P unknowns.

    Parameters
    ----------
    image : (H, W) array
        Rendering.
    mask : (H, W) array of bool
        True = use.
    jacobian : (P, H, W) array
        Its derivative by the unknowns.
    blur_px : float
        As :func:`PolyPoseLib.similarity.ncc.gmncc` takes it.

    Returns
    -------
    (P, P) array
        Positive semidefinite.

    """
    with one_torch_thread():
        use = torch.as_tensor(mask)
        picture, slopes = torch.as_tensor(image).double(), torch.as_tensor(jacobian).double()
        return (0.25 * _curvature(picture, slopes, use, blur_px)).numpy()


def _curvature(picture: Tensor, slopes: Tensor, use: Tensor, blur_px: float) -> Tensor:
    """Sum of the four correlations' curvatures."""
    picture, slopes = _standardised(picture, slopes, use)
    inside = blurred_mask(use[None], blur_px)[0]
    total = _whole(picture, slopes, use) + _patches(picture, slopes, use, 9)
    picture, slopes = blurred(picture[None], blur_px)[0], blurred(slopes, blur_px)
    for derivative in (_across, _down):
        part, change = _standardised(derivative(picture), derivative(slopes), inside)
        total = total + _patches(part, change, inside, 11)
    return total


def _standardised(picture: Tensor, slopes: Tensor, use: Tensor) -> tuple[Tensor, Tensor]:
    """Picture of mean 0 and variance 1 over the pixels in use, 0 outside, and its slopes in the same unit."""
    values = picture[use]
    deviation = values.std(unbiased=False).clamp(min=1e-12)
    zero = picture.new_zeros(())
    return torch.where(use, (picture - values.mean()) / deviation, zero), torch.where(
        use, slopes / deviation, zero
    )


def _whole(picture: Tensor, slopes: Tensor, use: Tensor) -> Tensor:
    """Curvature of the global correlation."""
    flat, values = slopes[:, use], picture[use]
    flat = flat - flat.mean(1, keepdim=True)
    along = flat @ values / len(values)
    return flat @ flat.T / len(values) - torch.outer(along, along)


def _patches(picture: Tensor, slopes: Tensor, use: Tensor, size: int) -> Tensor:
    """Curvature of the mean over patches of size x size pixels."""
    share = _box(use.double()[None], size)[0]
    safe = share.clamp(min=1e-3 / size**2)

    def mean(images: Tensor) -> Tensor:
        return _box(images, size) / safe

    moments = mean(torch.stack([picture, picture * picture]))
    variance = (moments[1] - moments[0] ** 2).clamp(min=0)
    squared = variance + PATCH_FLOOR
    weight = share / share.sum().clamp(min=1e-12)
    slope_mean = mean(slopes)
    along = mean(slopes * picture) - moments[0] * slope_mean
    spread = pad((weight / squared / safe)[None], [size - 1] * 4)
    by_pixel = _box(spread, size)[0]
    return (
        _gram(slopes, by_pixel)
        - _gram(slope_mean, weight / squared)
        + _gram(along, weight * (variance / squared - 2) / squared**2)
    )


def _box(images: Tensor, size: int) -> Tensor:
    """Means over patches of size x size pixels of (P, H, W) images."""
    for kernel in ((size, 1), (1, size)):
        images = avg_pool2d(images[:, None], kernel, stride=1)[:, 0]
    return images


def _gram(images: Tensor, weight: Tensor) -> Tensor:
    """Sums (P, P) over pixels of weighted products of (P, H, W) images."""
    return (images * weight).flatten(1) @ images.flatten(1).T


def _across(images: Tensor) -> Tensor:
    """Sobel derivative (..., H - 2, W - 2) along columns."""
    smooth = images[..., :-2, :] + 2 * images[..., 1:-1, :] + images[..., 2:, :]
    return smooth[..., 2:] - smooth[..., :-2]


def _down(images: Tensor) -> Tensor:
    """Sobel derivative (..., H - 2, W - 2) along rows."""
    return _across(images.transpose(-1, -2)).transpose(-1, -2)
