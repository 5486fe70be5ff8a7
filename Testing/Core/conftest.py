"""Grids that the tests of several rooms share, and the library's logging as it is without a command line."""

import logging
from collections.abc import Callable

import numpy as np
import pytest
from bones_case import grid_affine


@pytest.fixture
def affine_of() -> Callable[..., np.ndarray]:
    return grid_affine


@pytest.fixture(autouse=True)
def library_logging() -> None:
    """Undo what a command line that ran in this process left: its handler, its level, and no propagation."""
    logger = logging.getLogger("PolyPoseLib")
    logger.propagate = True
    logger.handlers.clear()
    logger.setLevel(logging.NOTSET)
