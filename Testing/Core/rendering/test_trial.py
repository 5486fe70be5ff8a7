"""The trial takes the backend that renders faster, and says what it measured."""

import logging
import time

import numpy as np
import pytest
from backend_cases import assert_close

from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.rigid import project_body
from PolyPoseLib.rendering.select import device_of, select_backend
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.rendering.trial import faster_of, sample


class Slow(TorchBackend):
    """Sleeps before every rendering."""

    def __init__(self, name):
        super().__init__()
        self.name = name

    def project(self, *arguments):
        time.sleep(0.3)
        return super().project(*arguments)


def test_the_faster_one_is_taken_wherever_it_stands(caplog):
    quick, slow = TorchBackend(), Slow("slow")
    with caplog.at_level(logging.INFO):
        assert faster_of([slow, quick], 0.2) is quick
        assert faster_of([quick, slow], 0.2) is quick
    assert "Rendering with torch (cpu)" in caplog.text
    assert " ms" in caplog.text and "slow" in caplog.text


def test_without_time_every_one_renders_once_all_the_same():
    slow = Slow("slow")
    assert faster_of([slow], 0.0) is slow


def test_the_sample_is_seen_alike():
    pytest.importorskip("numba")
    body, camera = sample()
    one, other = (
        project_body(body, camera, np.eye(4), 2.0, backend).image
        for backend in (NumbaBackend(), TorchBackend())
    )
    assert one.max() > 2
    assert_close(one, other, 1e-5)


@pytest.mark.parametrize("device", ["auto", "cpu"])
def test_a_machine_without_a_gpu_needs_no_trial(device):
    import torch

    if torch.cuda.is_available():
        pytest.skip("there is a GPU")
    pytest.importorskip("numba")
    backend = select_backend("auto", device)
    assert isinstance(backend, NumbaBackend)
    assert device_of(backend) == "cpu"
    assert device_of(select_backend("torch", device)) == "cpu"
