"""How alike two X-ray images are: normalised cross-correlations (torch).

Every measure takes images (B, H, W), compares them pair by pair and returns (B,), higher for more alike; it is
differentiable in both images and does not change when an image's gain (above 0) or offset does. A mask (B, H, W)
or (H, W), True = use, excludes pixels altogether: what they hold, NaN included, changes neither value nor
gradient. A pair with nothing to compare (all masked, or a flat image) scores 0 with zero gradient.

Sums run in float64 over images whose global mean is subtracted, so that local variances keep their digits.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import avg_pool2d, conv2d, max_pool2d

PATCH_FLOOR = 1e-5
"""Local variance, as a share of the image's variance, below which a patch counts as flat and its score fades."""

BLUR_SIZE = 5
"""Side in pixels of the Gaussian by which images may be blurred before their gradients are compared."""

_FLAT = 1e-20  # variance over squared mean that rounding alone can leave


def ncc(a: Tensor, b: Tensor, mask: Tensor | None = None) -> Tensor:
    """Normalised cross-correlation (Pearson's r) over all pixels in use.

    Parameters
    ----------
    a, b : (B, H, W) Tensor
        Images to compare, any unit.
    mask : (B, H, W) or (H, W) Tensor of bool, optional
        True = use; all pixels by default.

    Returns
    -------
    (B,) Tensor
        From -1 to 1, one for each pair.

    Raises
    ------
    ValueError
        Shapes that do not fit.

    """
    a, b, mask = _checked(a, b, mask)
    x, y = _standardised(a, mask), _standardised(b, mask)
    return ((x * y).sum((1, 2)) / _count(mask)[:, 0, 0]).to(a.dtype)


def patch_ncc(a: Tensor, b: Tensor, size: int = 9, mask: Tensor | None = None) -> Tensor:
    """Mean over every size x size patch inside the image of the patch's normalised cross-correlation.

    A patch's score is cov(a, b) / sqrt((var a + f) (var b + f)) over its pixels in use, f = PATCH_FLOOR times
    the image's variance; a patch counts by its share of pixels in use.

    Parameters
    ----------
    a, b : (B, H, W) Tensor
        Images to compare, any unit.
    size : int
        Side of the patches in pixels.
    mask : (B, H, W) or (H, W) Tensor of bool, optional
        True = use; all pixels by default.

    Returns
    -------
    (B,) Tensor
        From -1 to 1, one for each pair.

    Raises
    ------
    ValueError
        Shapes that do not fit, or an image smaller than a patch.

    """
    a, b, mask = _checked(a, b, mask)
    _require_room(a, size, size)
    return _patch_ncc(a, b, size, mask).to(a.dtype)


def gradient_ncc(
    a: Tensor, b: Tensor, size: int = 11, mask: Tensor | None = None, blur_px: float = 0.0
) -> Tensor:
    """Patch correlation of Sobel derivatives, the mean of both directions.

    Derivatives exist where the whole 3 x 3 neighbourhood (7 x 7 after a blur) lies inside the image and the mask.

    Parameters
    ----------
    a, b : (B, H, W) Tensor
        Images to compare, any unit.
    size : int
        Side of the patches in pixels, on the image of derivatives (H - 2, W - 2).
    mask : (B, H, W) or (H, W) Tensor of bool, optional
        True = use; all pixels by default.
    blur_px : float
        See :func:`blurred`.

    Returns
    -------
    (B,) Tensor
        From -1 to 1, one for each pair.

    Raises
    ------
    ValueError
        Shapes that do not fit, or an image smaller than a patch and the filter's border.

    """
    a, b, mask = _checked(a, b, mask)
    _require_room(a, size + 2 + (BLUR_SIZE - 1 if blur_px else 0), size)
    return _gradient_ncc(a, b, size, mask, blur_px).to(a.dtype)


def gmncc(a: Tensor, b: Tensor, mask: Tensor | None = None, blur_px: float = 0.0) -> Tensor:
    """Gradient and multiscale normalised cross-correlation: 0.5 (0.5 NCC + 0.5 NCC_9) + 0.5 gNCC_11.

    NCC is `ncc`, NCC_9 `patch_ncc` of 9 x 9 and gNCC_11 `gradient_ncc` of 11 x 11 pixels.

    Parameters
    ----------
    a, b : (B, H, W) Tensor
        Images to compare, any unit, 13 pixels or more a side, 17 with a blur.
    mask : (B, H, W) or (H, W) Tensor of bool, optional
        True = use; all pixels by default.
    blur_px : float
        Of the gradient term, see :func:`blurred`.

    Returns
    -------
    (B,) Tensor
        From -1 to 1, one for each pair.

    Raises
    ------
    ValueError
        Shapes that do not fit, or images too small.

    """
    multiscale = 0.5 * (ncc(a, b, mask) + patch_ncc(a, b, 9, mask))
    return 0.5 * multiscale + 0.5 * gradient_ncc(a, b, 11, mask, blur_px)


def blurred(images: Tensor, blur_px: float) -> Tensor:
    """Images smoothed by a Gaussian that is cut to BLUR_SIZE x BLUR_SIZE pixels, where all of it lies in the image.

    Parameters
    ----------
    images : (N, H, W) Tensor
        Any unit.
    blur_px : float
        Standard deviation; 0 returns the images as they are. From about 5 on it is nearly a mean of all pixels.

    Returns
    -------
    (N, H - 4, W - 4) Tensor
        Or (N, H, W) without a blur.

    """
    if not blur_px:
        return images
    place = torch.arange(BLUR_SIZE, dtype=images.dtype, device=images.device) - (BLUR_SIZE - 1) / 2
    weights = torch.exp(-0.5 * (place / blur_px) ** 2)
    weights = weights / weights.sum()
    images = conv2d(images[:, None], weights.reshape(1, 1, -1, 1))
    return conv2d(images, weights.reshape(1, 1, 1, -1))[:, 0]


def blurred_mask(mask: Tensor, blur_px: float) -> Tensor:
    """Where images (N, H, W) that are blurred and filtered by 3 x 3 pixels know only pixels of the mask."""
    size = 3 + (BLUR_SIZE - 1 if blur_px else 0)
    return max_pool2d((~mask).double()[:, None], size, stride=1)[:, 0] == 0


def _patch_ncc(a: Tensor, b: Tensor, size: int, mask: Tensor) -> Tensor:
    """patch_ncc in float64 without checks."""
    x, y = _standardised(a, mask), _standardised(b, mask)
    moments = torch.stack([mask.to(x.dtype), x, y, x * x, y * y, x * y], dim=1)
    for kernel in ((size, 1), (1, size)):
        moments = avg_pool2d(moments, kernel, stride=1)
    share = moments[:, 0]
    mean_x, mean_y, xx, yy, xy = (moments[:, 1:] / share.clamp(min=1e-3 / size**2)[:, None]).unbind(1)
    variance_x, variance_y = xx - mean_x * mean_x, yy - mean_y * mean_y
    score = (xy - mean_x * mean_y) / ((variance_x + PATCH_FLOOR) * (variance_y + PATCH_FLOOR)).sqrt()
    return (share * score).sum((1, 2)) / share.sum((1, 2)).clamp(min=1e-3 / size**2)


def _gradient_ncc(a: Tensor, b: Tensor, size: int, mask: Tensor, blur_px: float) -> Tensor:
    """gradient_ncc in float64 without checks."""
    inside = blurred_mask(mask, blur_px)
    pairs = zip(_sobel(a, mask, blur_px), _sobel(b, mask, blur_px), strict=True)
    across, down = (_patch_ncc(x, y, size, inside) for x, y in pairs)
    return 0.5 * (across + down)


def _sobel(image: Tensor, mask: Tensor, blur_px: float) -> tuple[Tensor, Tensor]:
    """Sobel derivatives (B, H - 2, W - 2) along columns and rows, of the standardised image, which may be blurred."""
    image = blurred(_standardised(image, mask), blur_px)
    smooth_down = image[:, :-2] + 2 * image[:, 1:-1] + image[:, 2:]
    smooth_across = image[:, :, :-2] + 2 * image[:, :, 1:-1] + image[:, :, 2:]
    return smooth_down[:, :, 2:] - smooth_down[:, :, :-2], smooth_across[:, 2:] - smooth_across[:, :-2]


def _standardised(image: Tensor, mask: Tensor) -> Tensor:
    """Float64 image of mean 0 and variance 1 over the mask, 0 outside; all 0 where the image is flat."""
    count = _count(mask)
    zero = torch.zeros((), dtype=torch.float64, device=image.device)
    values = torch.where(mask, image.double(), zero)
    mean = values.sum((1, 2), keepdim=True) / count
    centred = torch.where(mask, values - mean, zero)
    variance = centred.square().sum((1, 2), keepdim=True) / count
    flat = variance <= _FLAT * mean.square()
    return torch.where(flat, zero, centred) / torch.where(flat, torch.ones_like(variance), variance).sqrt()


def _count(mask: Tensor) -> Tensor:
    """Pixels in use (B, 1, 1) float64, at least 1."""
    return mask.sum((1, 2), keepdim=True).clamp(min=1).double()


def _checked(a: Tensor, b: Tensor, mask: Tensor | None) -> tuple[Tensor, Tensor, Tensor]:
    """Images of one dtype and a full boolean mask, or ValueError."""
    if a.ndim != 3 or a.shape != b.shape or not a.is_floating_point() or not b.is_floating_point():
        raise ValueError(
            f"The images have shapes {tuple(a.shape)} and {tuple(b.shape)} and dtypes {a.dtype} and {b.dtype}; "
            "give two floating-point stacks of the same shape (B, H, W)."
        )
    dtype = torch.promote_types(a.dtype, b.dtype)
    if mask is None:
        mask = torch.ones_like(a, dtype=torch.bool)
    elif mask.dtype != torch.bool or tuple(mask.shape) not in {tuple(a.shape), tuple(a.shape[1:])}:
        raise ValueError(
            f"mask has shape {tuple(mask.shape)} and dtype {mask.dtype}; give booleans of shape "
            f"{tuple(a.shape)} or {tuple(a.shape[1:])}."
        )
    return a.to(dtype), b.to(dtype), mask.expand_as(a)


def _require_room(image: Tensor, needed: int, size: int) -> None:
    """Refuse images in which no patch fits."""
    if size < 1 or min(image.shape[1:]) < needed:
        raise ValueError(
            f"The images are {image.shape[1]} x {image.shape[2]} pixels; patches of {size} x {size} need "
            f"{needed} or more a side."
        )
