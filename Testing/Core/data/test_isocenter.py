"""An isocentre that was given stays; only one that nobody gave is put on the anchor."""

import numpy as np
import pytest

from PolyPoseLib.data.xray import Xray, place_isocenter
from PolyPoseLib.geometry.camera import intrinsics_matrix

ANCHOR = np.array([40.0, -20.0, 300.0])


def xray(isocenter) -> Xray:
    extrinsic = np.eye(4)
    extrinsic[2, 3] = 700 - isocenter[2]
    return Xray(
        image=np.ones((20, 20), np.float32),
        mask=np.ones((20, 20), bool),
        intrinsics=intrinsics_matrix(1000, 1.0, 20, 20),
        extrinsic=extrinsic,
        camera="initial",
        pixel_spacing_mm=(1.0, 1.0),
        source_to_detector_mm=1000.0,
        isocenter=tuple(isocenter),
        initial_radius=(5.0, 20.0),
    )


@pytest.mark.parametrize("seed", range(5))
def test_a_given_isocentre_does_not_move(seed: int) -> None:
    given = xray(np.random.default_rng(seed).uniform(1, 90, 3))
    assert place_isocenter((given,), ANCHOR)[0] is given


def test_one_that_nobody_gave_moves_onto_the_anchor() -> None:
    (placed,) = place_isocenter((xray((0.0, 0.0, 0.0)),), ANCHOR)
    np.testing.assert_allclose(placed.isocenter, ANCHOR)
    np.testing.assert_allclose(placed.extrinsic[:3] @ [*ANCHOR, 1], [0, 0, 700])
