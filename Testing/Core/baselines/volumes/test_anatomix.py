"""anatomix: the published file's names and shapes, windows, and the direction of what ConvexAdam finds."""

import numpy as np
import pytest
import torch
from moved_volumes import ROTATION, TRANSLATION, errors, moved_pair

from PolyPoseLib.baselines.packages import is_installed
from PolyPoseLib.baselines.volumes.anatomix import FdkAnatomix, features_in_windows
from PolyPoseLib.baselines.volumes.anatomix_network import AnatomixUNet
from PolyPoseLib.baselines.volumes.feature_convexadam import _sampled
from PolyPoseLib.data.benchmark.system import SystemSetting


def test_parameters_are_named_and_shaped_as_the_published_ones():
    """Read off the public architecture: 3-voxel filters at these places of one list, 5.9 million parameters."""
    state = AnatomixUNet().state_dict()
    filters = {name: tuple(t.shape[:2]) for name, t in state.items() if t.ndim == 5}
    places = [0, 3, 6, 10, 13, 17, 20, 24, 27, 31, 34, 38, 41, 45, 48, 52, 55, 59, 62, 65]
    assert list(filters) == [f"model.{place}.weight" for place in places]
    outputs = [16, 16, 16, 32, 32, 64, 64, 128, 128, 256, 256, 128, 128, 64, 64, 32, 32, 16, 16, 16]
    inputs = [1, 16, 16, 16, 32, 32, 64, 64, 128, 128, 256, 384, 128, 192, 64, 96, 32, 48, 16, 16]
    assert list(filters.values()) == list(zip(outputs, inputs, strict=True))
    assert sum(p.numel() for p in AnatomixUNet().parameters()) == 5_899_344
    assert not [name for name in state if name.endswith("bias") and state[name].ndim != 1]


@pytest.mark.parametrize("shape", [(20, 33, 17), (40, 40, 150)])
def test_windows_cover_a_volume_without_seams(shape):
    """Blended windows of a network that sees one voxel at a time are that network on the whole volume."""
    network = torch.nn.Conv3d(1, 3, 1)
    volume = torch.rand(1, 1, *shape, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        found = features_in_windows(network, volume, SystemSetting())
        torch.testing.assert_close(found, network(volume), atol=1e-5, rtol=1e-5)


def test_displaced_samples_are_those_voxels():
    values = torch.rand(1, 2, 7, 9, 8, generator=torch.Generator().manual_seed(0))
    displacement = torch.tensor([1.0, -2.0, 3.0]).view(1, 3, 1, 1, 1).expand(1, 3, 7, 9, 8)
    found = _sampled(values, displacement)
    torch.testing.assert_close(found[..., :6, 2:, :5], values[..., 1:, :7, 3:], atol=1e-5, rtol=1e-5)


@pytest.mark.long
@pytest.mark.skipif(not is_installed("convexAdam"), reason="convexadam is not installed")
@pytest.mark.parametrize("motion", [TRANSLATION, ROTATION], ids=["translation", "rotation"])
def test_random_weights_register_in_the_right_direction(motion, tmp_path):
    """Features of random filters still tell places apart; that they are those of a trained network is not tested."""
    torch.manual_seed(0)
    torch.save(AnatomixUNet().state_dict(), tmp_path / "anatomix.pth")
    pair, truth = moved_pair(motion)
    weights = {"fdk-anatomix": tmp_path / "anatomix.pth"}
    field = FdkAnatomix().register(pair, SystemSetting(weights=weights))
    found, at_rest = errors(field, pair, truth)
    assert found < 0.7 * at_rest
    assert np.isfinite(field.vectors).all()
