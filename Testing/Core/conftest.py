"""Grids and a GPU that the tests of several rooms share, and the library's logging as it is without a command line."""

import logging
from collections.abc import Callable, Iterator

import numpy as np
import pytest
import torch
from bones_case import grid_affine
from pretended_gpu import CUDA, gpu_at


@pytest.fixture
def affine_of() -> Callable[..., np.ndarray]:
    return grid_affine


@pytest.fixture(params=["pretended", CUDA])
def gpu(request) -> Iterator[torch.device]:
    """A GPU, and one that is only pretended."""
    with gpu_at(request.param):
        yield torch.device("cuda")


@pytest.fixture(autouse=True)
def library_logging() -> None:
    """Undo what a command line that ran in this process left: its handler, its level, and no propagation."""
    logger = logging.getLogger("PolyPoseLib")
    logger.propagate = True
    logger.handlers.clear()
    logger.setLevel(logging.NOTSET)
