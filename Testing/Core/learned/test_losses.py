"""Losses are zero at the truth, grow with the error, and have the gradients that they claim."""

import learned_phantom
import numpy as np
import torch
from scipy.ndimage import gaussian_filter

from PolyPoseLib.evaluation.metrics import projection_error_mm
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.image_loss import ImageLoss
from PolyPoseLib.learned.loss import SOFT_MM, geodesic_mm, projection_mm
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.registration.scene import body_points
from PolyPoseLib.rendering.select import select_backend

RANGE = ViewRange(("AP",), 700.0, angle_deg=20, offset_mm=30)
SCENE = learned_phantom.scene()
CENTRE = torch.as_tensor(SCENE.anchor_centre)
POINTS = torch.as_tensor(body_points(SCENE.bodies(6.0)[0], 40))


def pairs(count, size, seed=0):
    """True cameras, and others that differ by motions of about ``size`` (rad, and mm / 100)."""
    rng = np.random.default_rng(seed)
    true = torch.as_tensor(np.stack([RANGE.draw(rng, SCENE.anchor_centre)[1] for _ in range(count)]))
    change = torch.as_tensor(rng.normal(size=(count, 6)) * size * np.array([1, 1, 1, 100, 100, 100]))
    return true, moved(true, change)


def moved(true, change):
    about = torch.eye(4, dtype=torch.float64)
    about[:3, 3] = CENTRE
    return true @ about @ se3.exp(change) @ se3.inverse(about)


def test_zero_at_the_truth_and_growing():
    true, _ = pairs(20, 0.0)
    assert projection_mm(true, true, POINTS).abs().max() < 1e-9
    assert geodesic_mm(true, true, CENTRE, 50.0).abs().max() < 1e-6
    sizes = [pairs(20, size)[1] for size in (0.01, 0.05, 0.2)]
    for loss in (lambda p: projection_mm(p, true, POINTS), lambda p: geodesic_mm(p, true, CENTRE, 50.0)):
        small, middle, large = (loss(each).mean() for each in sizes)
        assert 0 < small < middle < large


def test_projection_loss_is_the_error_that_is_reported():
    true, other = pairs(10, 0.05)
    intrinsics = VirtualDetector(64, 0.2).intrinsics
    losses = projection_mm(other, true, POINTS)
    for n in range(10):
        cameras = [Camera(intrinsics, each[n].numpy(), 64, 64) for each in (true, other)]
        error = projection_error_mm(POINTS.numpy(), *cameras).mean()
        assert abs(float(losses[n]) - error) <= SOFT_MM


def test_gradients():
    true, other = pairs(2, 0.05)
    change = torch.zeros(2, 6, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda v: projection_mm(moved(other, v), true, POINTS), (change,))
    assert torch.autograd.gradcheck(lambda v: geodesic_mm(moved(other, v), true, CENTRE, 50.0), (change,))
    at_truth = projection_mm(moved(true, change), true, POINTS) + geodesic_mm(
        moved(true, change), true, CENTRE, 50.0
    )
    (gradient,) = torch.autograd.grad(at_truth.sum(), change)
    assert torch.isfinite(gradient).all()


def test_image_loss_is_least_at_the_truth_and_its_gradient_points_there():
    loss = ImageLoss.of(SCENE, VirtualDetector(48, 0.2).camera(np.eye(4)), 9, 6.0, select_backend(threads=1))
    true, _ = pairs(3, 0.0)
    images = loss.render(true).detach()
    mask = torch.ones(images.shape, dtype=torch.bool)
    least = loss(true, images, mask)  # not 0: patches of air tell nothing
    rng = np.random.default_rng(1)
    change = torch.as_tensor(rng.normal(size=(3, 6)) * 0.03 * np.array([1, 1, 1, 100, 100, 10]))
    change.requires_grad_()
    found = loss(moved(true, change), images, mask)
    assert (found > least).all()
    (gradient,) = torch.autograd.grad(found.sum(), change)
    assert ((gradient * change).sum(1) > 0).all()


def test_derivative_of_the_rendering_agrees_with_differences():
    loss = ImageLoss.of(SCENE, VirtualDetector(48, 0.2).camera(np.eye(4)), 9, 6.0, select_backend(threads=1))
    true, _ = pairs(1, 0.0)
    weight = torch.as_tensor(gaussian_filter(np.random.default_rng(2).normal(size=(1, 48, 48)), (0, 3, 3)))
    change = torch.zeros(1, 6, dtype=torch.float64, requires_grad=True)
    (gradient,) = torch.autograd.grad((loss.render(moved(true, change)) * weight).sum(), change)
    steps = torch.tensor([2e-3, 2e-3, 2e-3, 0.2, 0.2, 0.2], dtype=torch.float64)
    slopes = gradient[0] * steps
    for axis in range(6):
        small = (steps * (torch.arange(6) == axis))[None]
        up, down = (float((loss.render(moved(true, sign * small)) * weight).sum()) for sign in (1, -1))
        difference = (up - down) / 2
        assert abs(float(slopes[axis]) - difference) < 0.1 * abs(difference) + 0.05 * float(
            slopes.abs().max()
        )
