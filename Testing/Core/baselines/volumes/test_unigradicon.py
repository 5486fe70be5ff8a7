"""uniGradICON: units of its fields, and that the package's own warped image is ours.

The published weights are not to be had here; a network with random ones, of the package's own class, is.
"""

import numpy as np
import pytest
import SimpleITK as sitk
import torch
from moved_volumes import TRANSLATION, moved_pair

from PolyPoseLib.baselines.packages import is_installed
from PolyPoseLib.baselines.volumes.unigradicon import FdkUniGradIcon, FdkUniGradIconIo
from PolyPoseLib.data.benchmark.system import SystemSetting

VOXELS = 72
"""Fewer than 68 leave the network nothing to pool."""

needs_package = pytest.mark.skipif(not is_installed("unigradicon"), reason="unigradicon is not installed")


def test_a_field_of_the_network_is_in_its_units():
    """An affine motion in mm, expressed as the package does: 1 is from the first to the last voxel's centre."""
    pair, _ = moved_pair(TRANSLATION)
    system = FdkUniGradIcon()
    system.voxels = 40
    size = np.array(pair.fixed.shape)
    # Centres of the network's voxels, in voxels of the volume, which torch's interpolate divides evenly.
    kji = np.stack(np.meshgrid(*[np.arange(system.voxels)] * 3, indexing="ij"), axis=-1)
    volume_index = (kji + 0.5) * size / system.voxels - 0.5
    points = volume_index[..., ::-1] * pair.spacing_mm + pair.origin
    matrix, shift = (
        np.array([[0.02, -0.05, 0.01], [0.04, -0.01, 0.03], [-0.02, 0.06, 0.02]]),
        [3.0, -7.0, 5.0],
    )
    moved_index = (points + points @ matrix.T + shift - pair.origin)[..., ::-1] / pair.spacing_mm
    moved = (moved_index + 0.5) * system.voxels / size - 0.5
    unit = np.moveaxis((moved - kji) / (system.voxels - 1), -1, 0)
    field = system._field(pair, unit)
    inside = pair.points()[1:-1, 1:-1, 1:-1]
    np.testing.assert_allclose(field.sample(inside), inside @ matrix.T + shift, atol=1e-3)


@pytest.fixture(scope="module")
def random_weights(tmp_path_factory):
    unigradicon = pytest.importorskip("unigradicon")
    torch.manual_seed(1)
    network = unigradicon.make_network([1, 1, *[VOXELS] * 3], include_last_step=True)
    last = network.regis_net.netPsi.net.lastConv
    torch.nn.init.normal_(last.weight, std=0.004)
    # Along k, j, i of a volume from 0 to 1.
    last.bias.data = torch.tensor([0.03, -0.05, 0.07])
    path = tmp_path_factory.mktemp("weights") / "random.trch"
    torch.save(network.regis_net.state_dict(), path)
    return path


@pytest.mark.long
@needs_package
@pytest.mark.parametrize("system", [FdkUniGradIcon, FdkUniGradIconIo])
def test_our_warped_ct_is_the_package_s(system, random_weights, monkeypatch):
    """Resampled by ITK through our field, the moving volume is what the package's network warps it to."""
    monkeypatch.setattr(system, "voxels", VOXELS)
    monkeypatch.setattr(FdkUniGradIconIo, "steps", 2)
    warped = {}
    unigradicon = pytest.importorskip("unigradicon")
    forward = unigradicon.GradientICONSparse.forward

    def seen(network, *images, **more):
        loss = forward(network, *images, **more)
        warped["moving"] = network.warped_image_A.detach().numpy()[0, 0]
        return loss

    monkeypatch.setattr(unigradicon.GradientICONSparse, "forward", seen)
    pair, _ = moved_pair(TRANSLATION)
    field = system().register(pair, SystemSetting(weights={"fdk-unigradicon": random_weights}))
    _, moving = pair.images()
    ours = sitk.GetArrayFromImage(
        sitk.Resample(moving, moving, field.to_sitk_transform(), sitk.sitkLinear, -1000.0)
    )
    scaled = torch.from_numpy((np.clip(ours, -1000, 1000) + 1000) / 2000)[None, None]
    ours = torch.nn.functional.interpolate(scaled, [VOXELS] * 3, mode="trilinear")[0, 0].numpy()
    inner = (slice(10, -10),) * 3
    unmoved = sitk.GetArrayFromImage(moving)
    unmoved = torch.from_numpy((np.clip(unmoved, -1000, 1000) + 1000) / 2000)[None, None]
    unmoved = torch.nn.functional.interpolate(unmoved, [VOXELS] * 3, mode="trilinear")[0, 0].numpy()
    difference = np.abs(ours - warped["moving"])[inner].mean()
    assert difference < 0.3 * np.abs(unmoved - warped["moving"])[inner].mean()
    # And the constant part of the field, which the last layer's bias gives: fractions of the volume's extent.
    extent = np.array(pair.fixed.shape[::-1]) * pair.spacing_mm
    expected = np.array([0.07, -0.05, 0.03]) * extent * (VOXELS - 1) / VOXELS
    assert np.sign(field.vectors[8:-8, 8:-8, 8:-8].mean((0, 1, 2))).tolist() == np.sign(expected).tolist()
