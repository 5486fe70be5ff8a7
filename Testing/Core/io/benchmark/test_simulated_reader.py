"""Simulated cases as benchmark cases: everything is known, and the known fits together."""

import shutil

import numpy as np
import pytest
from simulation_phantom import NAMES, phantom
from two_postures import dice_of, pixel_of, plain_rendering

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark import simulated
from PolyPoseLib.io.benchmark.places import subject_name
from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.simulation.independent_projector import project
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

_ = plain_rendering


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """One case whose initial cameras are wrong; its folder carries a patient's name."""
    ct, structures, source = phantom(spacing=(5.0, 5.0, 5.0), handedness=-1)
    options = SimulationOptions(projector="sum", node_mm=5.0, pad_mm=10.0)
    cameras = view_cameras(ct, (0.0, 40.0), pixels=40, detector_mm=350)
    made = simulate_case(ct, structures, None, cameras, 3, options, "pelvis", source)
    root = tmp_path_factory.mktemp("simulated")
    ids = {name: [10 * number] for number, name in enumerate(NAMES, start=1)}
    write_case(made, root / "Miller Anna", ids, {5: "liver"}, image_format="nifti")
    return root, made


@pytest.fixture(scope="module")
def cases(root):
    (subject,) = simulated.subjects(root[0])
    return list(simulated.cases(root[0], subject, ["own", "3x180"]))


def test_names_tell_nothing_of_a_person(root, cases):
    (subject,) = simulated.subjects(root[0])
    assert all(part not in f"{subject} {cases[0].name}".lower() for part in ("miller", "anna"))
    assert [case.views for case in cases] == ["own-2x40", "3x180"]
    shutil.copytree(root[0] / "Miller Anna", root[0] / "case_07")
    assert set(simulated.subjects(root[0])) == {subject, "case_07"}
    assert simulated.subjects(root[0] / "case_07") == ["case_07"]
    shutil.rmtree(root[0] / "case_07")


def test_cameras_are_the_true_ones_and_fit_the_pictures(root, cases):
    _, made = root
    own = cases[0]
    for xray, camera, clean in zip(own.study.xrays, made.cameras, made.clean_images, strict=True):
        assert xray.camera == "known" and np.allclose(xray.extrinsic, camera.extrinsic)
        again = project_of(own, camera)
        assert np.corrcoef(again.ravel(), clean.ravel())[0, 1] > 0.99
        assert np.corrcoef(again.ravel(), xray.image.ravel())[0, 1] > 0.95


def project_of(case, camera):
    from PolyPoseLib.data.volume import hounsfield_to_attenuation

    ct = case.truth.ct
    return project(ct.with_voxels(hounsfield_to_attenuation(ct.voxels)), camera, "sum")


def test_the_true_motion_scores_near_one_and_rest_does_not(root, cases):
    _, made = root
    for case in cases:
        assert set(case.labels) == {*NAMES, "liver"} and case.truth.field is not None
        moved = [name for name in NAMES if not np.allclose(made.fixed_to_moving[name], np.eye(4))]
        assert len(moved) >= 2
        rest, true = [], []
        for name in moved:
            pose = case.truth.poses[name]
            assert pose == pytest.approx(made.fixed_to_moving[name])
            rest.append(dice_of(case, case.labels[name], np.eye(4)))
            true.append(dice_of(case, case.labels[name], pose))
        assert min(true) > 0.9 and np.mean(rest) < 0.95 and np.all(np.greater_equal(true, rest))


def test_held_out_masks_show_the_fixed_posture(cases):
    own, rendered = cases
    assert {view.name for view in own.truth.held_out} == {view.name for view in rendered.truth.held_out}
    for view in own.truth.held_out[:2]:
        for name in NAMES:
            number = own.labels[name][0]
            truth = own.truth.labels
            points = truth.to_world(np.argwhere(truth.voxels == number)[::7, ::-1])
            pixels = np.rint([pixel_of(view.camera, point) for point in points]).astype(int)
            kept = ((pixels >= 0) & (pixels < view.camera.width)).all(axis=1)
            assert view.masks[name][pixels[kept, 1], pixels[kept, 0]].mean() > 0.99


def test_what_is_not_a_simulated_case_is_told(root, tmp_path):
    with pytest.raises(InputError, match="polypose simulate"):
        simulated.subjects(tmp_path)
    shutil.copytree(root[0] / "Miller Anna", tmp_path / "case1")
    (tmp_path / "case1" / "truth" / "truth.json").unlink()
    with pytest.raises(InputError, match=r"no truth/truth\.json"):
        simulated.subjects(tmp_path)


def test_truths_of_another_case_are_refused(root, tmp_path):
    shutil.copytree(root[0] / "Miller Anna", tmp_path / "case1")
    truth = tmp_path / "case1" / "truth" / "truth.json"
    truth.write_text(truth.read_text().replace('"pelvis"', '"ilium"'))
    with pytest.raises(InputError, match="other structures"):
        list(simulated.cases(tmp_path, "case1", []))


def test_links_out_of_the_root_are_refused(root, tmp_path):
    shutil.copytree(root[0] / "Miller Anna", tmp_path / "away")
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "case1").symlink_to(tmp_path / "away")
    with pytest.raises(InputError, match="leads out of"):
        list(simulated.cases(tmp_path / "data", "case1", []))


def test_every_reader_answers_to_its_name():
    assert set(READERS) == {"deepfluoro", "headneck", "thoraxcbct", "simulated"}
    assert all(reader.name == name and reader.default_views for name, reader in READERS.items())


@pytest.mark.parametrize("name", ["case-doe", "case_john_doe", "head-smith", "Case-1", "simulated miller"])
def test_names_of_folders_that_may_be_a_persons_are_not_shown(tmp_path, name):
    assert subject_name(tmp_path / name, simulated._KNOWN) != name


@pytest.mark.parametrize(
    "name", ["case-1", "pelvis-12", "chest_breathing_3", "seed7", "head-neck-001", "case-b"]
)
def test_names_that_tell_nothing_of_a_person_stay(tmp_path, name):
    assert subject_name(tmp_path / name, simulated._KNOWN) == name
