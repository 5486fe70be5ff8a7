"""Grids that the tests of several rooms share."""

from collections.abc import Callable

import numpy as np
import pytest
from bones_case import grid_affine


@pytest.fixture
def affine_of() -> Callable[..., np.ndarray]:
    return grid_affine
