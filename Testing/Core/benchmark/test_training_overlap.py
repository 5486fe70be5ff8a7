"""Whether a case's CTs are known from a training."""

import dataclasses

import numpy as np
import pytest
import scored_case
import torch

from PolyPoseLib.baselines.trained.ct_digests import ct_digest
from PolyPoseLib.baselines.trained.trained_weights import TrainedWeights
from PolyPoseLib.benchmark.training_overlap import trained_on
from PolyPoseLib.data.volume import Volume


@pytest.fixture(scope="module")
def case():
    return scored_case.drawn_case(views=0)


@pytest.fixture
def weights(tmp_path):
    def written(cts, system="liftreg"):
        box = np.array([[100.0] * 3, [200.0] * 3])
        made = TrainedWeights(
            system, 16, np.eye(3)[:2], box, np.zeros((2, 2, 3)), {"w": torch.ones(2)}, {}, cts
        )
        torch.save(made.to_fields(), tmp_path / "weights.pt")
        return tmp_path / "weights.pt"

    return written


@pytest.mark.parametrize("system", ["liftreg", "2d3d-regnet"])
@pytest.mark.parametrize(
    ("known", "said"),
    [
        ((), ""),
        (("other",), ""),
        (("other", "ct"), "ct"),
        (("truth",), "truth"),
        (("ct", "truth"), "truth"),
        (None, "unknown"),
    ],
)
def test_cts_of_a_case_are_looked_for_among_those_of_the_training(case, weights, system, known, said):
    digests = {"ct": ct_digest(case.study.ct), "truth": ct_digest(case.truth.ct), "other": "0" * 64}
    path = weights(None if known is None else tuple(digests[each] for each in known), system)
    assert trained_on(system, path, case) == said


def test_a_scan_that_was_moved_onto_the_first_one_is_still_that_scan(case, weights):
    """Which every benchmark of two scans does, and everybody who trains on pairs of CTs by another program."""
    path = weights((ct_digest(case.truth.ct),))
    ct = Volume(case.truth.ct.voxels, scored_case.MOTION @ case.truth.ct.affine)
    moved = dataclasses.replace(case, truth=dataclasses.replace(case.truth, ct=ct))
    assert trained_on("liftreg", path, moved) == "truth"


def test_no_more_is_said_than_is_known(case, weights, tmp_path):
    path = weights((ct_digest(case.study.ct),))
    assert trained_on("mine", path, case) == trained_on("rigid", path, case) == ""
    bare = dataclasses.replace(case, truth=dataclasses.replace(case.truth, ct=None))
    assert trained_on("liftreg", path, bare) == "ct"
    assert trained_on("liftreg", tmp_path / "removed.pt", case) == "unknown"
