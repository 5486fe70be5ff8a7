"""The simulation on a real CT: plausible postures, bones that do not collide, a field that hardly folds."""

import numpy as np
import pytest

from PolyPoseLib.data.structures import structures_from_labels
from PolyPoseLib.io.samples import CT_FILE, LABELS_FILE, cached_sample, sample_named
from PolyPoseLib.io.volumes import read_ct, read_volume
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras


@pytest.fixture(scope="module")
def case():
    folder = cached_sample("pelvis")
    if folder is None:
        pytest.skip(
            "the pelvis sample is not in the cache (python -m PolyPoseLib sample pelvis --output DIR)"
        )
    ct = read_ct(folder / CT_FILE)
    labels = read_volume(folder / LABELS_FILE)
    structures = structures_from_labels(labels, sample_named("pelvis").structures, ct)
    cameras = view_cameras(ct, pixels=64)
    return simulate_case(ct, structures, None, cameras, 2, SimulationOptions(projector="sum"), "pelvis")


def test_femurs_turn_far_and_stay_in_their_sockets(case):
    for name in ("femur_left", "femur_right"):
        assert 9 < case.statistics["structures"][name]["rotation_deg"] < 18.5
        head = case.joints[name].joint
        shift = np.linalg.inv(case.fixed_to_moving[name]) @ np.append(head, 1) - np.append(head, 1)
        assert np.linalg.norm(shift) < 5
        assert 2 < case.statistics["structures"][name]["rest_tre_mean_mm"] < 15


def test_bones_do_not_collide_and_tissue_does_not_fold(case):
    assert all(row["overlap"] < 0.035 for row in case.statistics["structures"].values())
    assert case.statistics["folds_percent_outside_bones"] < 0.01


def test_bones_stay_bone(case):
    for number, name in enumerate(case.structures.names, start=1):
        before = np.median(case.ct.voxels[case.structures.labels == number])
        after = np.median(case.fixed_ct.voxels[case.fixed_labels.voxels == number])
        assert abs(after - before) < 30, name


def test_every_bone_is_in_view(case):
    assert all(min(row["in_view"]) > 0.5 for row in case.statistics["structures"].values())
