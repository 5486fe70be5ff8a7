"""Bones and motions that the tests of the warp share."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from bones_case import Bones, motion


@pytest.fixture(params=[0, 1, 2], ids=["straight", "left-handed", "oblique"])
def bones(request) -> Bones:
    return Bones(request.param)


@pytest.fixture
def straight_bones() -> Bones:
    return Bones(0)


@pytest.fixture
def motion_of() -> Callable[..., np.ndarray]:
    return motion


@pytest.fixture
def as_numpy() -> Callable:
    """Turn a torch point map into a numpy one."""
    return lambda warp: lambda points: warp(torch.as_tensor(points)).numpy()
