"""Renderings on the network's grid against the independent projector, and warps against known motions."""

import learned_phantom
import numpy as np
import torch
import trained_case

from PolyPoseLib.baselines.trained.grid_projector import GridProjector
from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.network_inputs import scaled_ct, view_of
from PolyPoseLib.baselines.trained.warping import (
    dissimilarity,
    gradient_penalty,
    identity_coordinates,
    inverse,
    warped,
)
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.independent_projector import project


def test_renderings_agree_with_the_independent_projector():
    ct, _ = learned_phantom.phantom()
    grid, cameras = NetworkGrid.of(ct, 32), trained_case.cameras((0.0, 35.0, 90.0))
    volume = scaled_ct(ct, grid)
    for image, camera in zip(
        GridProjector(grid, cameras)(torch.from_numpy(volume)[None, None]), cameras, strict=True
    ):
        truth = project(Volume(volume + 1, grid.affine), camera, "sum")
        inner = truth > 0.2 * truth.max()  # the box's edge is a step here and a ramp there
        np.testing.assert_allclose(image[0].numpy()[inner], truth[inner], atol=0.03 * truth.max())
        assert np.corrcoef(image[0].numpy().ravel(), truth.ravel())[0, 1] > 0.998


def test_rays_that_miss_the_grid_are_zero():
    ct, _ = learned_phantom.phantom()
    grid = NetworkGrid.of(ct, 16)
    (camera,) = trained_case.cameras((20.0,))
    beside = np.eye(4)
    beside[0, 3] = 3000.0
    (image,) = GridProjector(grid, [camera.with_extrinsic(beside @ camera.extrinsic)])(
        torch.ones(1, 1, 16, 16, 16)
    )
    assert (image == 0).all()


def test_projections_have_gradients_everywhere_inside():
    ct, _ = learned_phantom.phantom()
    grid = NetworkGrid.of(ct, 16)
    volume = torch.zeros(1, 1, 16, 16, 16, requires_grad=True)
    images = GridProjector(grid, trained_case.cameras())(volume)
    torch.stack([image.sum() for image in images]).sum().backward()
    assert volume.grad is not None and (volume.grad[0, 0, 2:-2, 2:-2, 2:-2] > 0).all()


def smooth(side=16, size=0.08):
    coordinates = identity_coordinates(side, torch.zeros(1))
    x, y, z = coordinates[0]
    bump = torch.cos(x * np.pi / 2) * torch.cos(y * np.pi / 2) * torch.cos(z * np.pi / 2)
    return size * torch.stack([bump, -bump, 0.5 * bump])[None]


def test_a_warp_samples_where_the_displacement_points():
    ramp = identity_coordinates(16, torch.zeros(1))
    moved = warped(ramp, smooth())
    inner = (slice(None), slice(None), *(slice(2, -2),) * 3)
    assert torch.allclose(moved[inner], (ramp + smooth())[inner], atol=1e-5)


def test_outside_is_air():
    assert torch.allclose(
        warped(torch.ones(1, 1, 16, 16, 16), torch.full((1, 3, 16, 16, 16), 3.0)), torch.tensor(-1.0)
    )


def test_an_inverse_undoes_the_displacement():
    forth = smooth()
    back = inverse(forth)
    coordinates = identity_coordinates(16, forth)
    at = (coordinates + back).permute(0, 2, 3, 4, 1)
    there = torch.nn.functional.grid_sample(forth, at, align_corners=True)
    assert (back + there).abs().max() < 2e-3 < 0.05 < forth.abs().max()


def test_the_penalty_is_that_of_a_linear_displacement():
    slope = torch.tensor([[0.1, -0.2, 0.3], [0.0, 0.4, 0.1], [0.2, 0.1, -0.1]])
    displacement = torch.einsum("ab,nbkji->nakji", slope, identity_coordinates(16, slope))
    assert torch.allclose(gradient_penalty(displacement), slope.square().sum(), rtol=1e-4)


def test_dissimilarity_ignores_scale_and_offset():
    image = torch.rand(2, 1, 8, 8, generator=torch.Generator().manual_seed(0))
    assert abs(float(dissimilarity(image, 3 * image - 7, 2))) < 1e-4
    assert abs(float(dissimilarity(image, -image, 2)) - 2) < 1e-4


def test_dose_and_scale_of_an_xray_do_not_matter():
    (camera,) = trained_case.cameras((0.0,))
    image = np.random.default_rng(0).gamma(2.0, size=(48, 48)).astype(np.float32)
    mask = np.ones(image.shape, bool)
    mask[:8] = False
    one, other = (
        view_of(image, mask, camera, 16),
        view_of(np.where(mask, 5 * image + 3, 1e6), mask, camera, 16),
    )
    np.testing.assert_allclose(one.image, other.image, atol=1e-5)
    assert (one.image[:4] == 0).all() and one.image.shape == (one.camera.height, one.camera.width)
    assert max(one.image.shape) <= 32
