"""A simulated case survives its folder: what is read back is what was simulated."""

import numpy as np
import pytest
from simulation_phantom import NAMES, phantom

from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.io.truths import load_truth
from PolyPoseLib.simulation.case_study import case_to_study
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

LABEL_IDS = {name: [10 * number] for number, name in enumerate(NAMES, start=1)}


@pytest.fixture(scope="module")
def case():
    ct, structures, source = phantom(spacing=(5.0, 5.0, 5.0), handedness=-1)
    options = SimulationOptions(projector="sum", node_mm=5.0, pad_mm=10.0)
    cameras = view_cameras(ct, pixels=40, detector_mm=350)
    return simulate_case(ct, structures, None, cameras, 3, options, "pelvis", source)


@pytest.mark.parametrize("image_format", ["nifti", "dicom"])
@pytest.mark.parametrize("label_ids", [None, LABEL_IDS])
def test_the_study_that_is_read_is_the_case(case, tmp_path, image_format, label_ids):
    path = write_case(case, tmp_path / "case", label_ids, image_format=image_format)
    study = Study.load(path)
    assert study.anchor == "pelvis" and study.structures.names == NAMES
    assert np.array_equal(study.structures.labels, case.structures.labels)
    assert np.abs(study.ct.voxels - case.ct.voxels).max() <= 0.5
    assert np.allclose(study.ct.affine, case.ct.affine, atol=1e-4)
    for number, xray in enumerate(study.xrays):
        camera = case.initial_cameras[number]
        assert xray.camera == "initial"
        assert np.abs(xray.image - case.images[number]).max() < 3e-3
        assert xray.mask.mean() > 0.95
        assert np.allclose(xray.intrinsics, camera.intrinsics, rtol=1e-4)
        assert np.allclose(xray.extrinsic, camera.extrinsic, atol=1e-6)


def test_the_truth_lies_beside_the_study(case, tmp_path):
    folder = write_case(case, tmp_path, LABEL_IDS, {5: "liver"}, image_format="nifti").parent
    truth = load_truth(folder / "truth")
    assert truth.organ_names == {5: "liver"}
    for name in NAMES:
        assert np.allclose(truth.fixed_to_moving[name], case.fixed_to_moving[name])
    assert np.array_equal(truth.fixed_labels.voxels, case.fixed_labels.voxels)


@pytest.mark.parametrize("camera", ["initial", "known", "absent"])
def test_cameras_are_given_as_asked(case, tmp_path, camera):
    written = Study.load(write_case(case, tmp_path, image_format="nifti", camera=camera)).xrays[0]
    direct = case_to_study(case, {"preset": "fast"}, camera).xrays[0]
    assert written.camera == direct.camera == camera
    assert np.allclose(written.intrinsics, direct.intrinsics, rtol=1e-6)
    assert np.allclose(written.pixel_spacing_mm, direct.pixel_spacing_mm)
    if camera == "absent":
        assert written.extrinsic is None and direct.extrinsic is None
    else:
        true = (case.cameras if camera == "known" else case.initial_cameras)[0].extrinsic
        assert np.allclose(written.extrinsic, true, atol=1e-9)
        assert np.allclose(direct.extrinsic, true, atol=1e-12)


def test_nothing_is_overwritten_and_wrong_words_are_refused(case, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="empty"):
        write_case(case, tmp_path)
    with pytest.raises(InputError, match="dicom"):
        write_case(case, tmp_path / "new", image_format="bmp")
    with pytest.raises(InputError, match="camera"):
        write_case(case, tmp_path / "new", camera="lost")
    with pytest.raises(InputError, match="femur_left"):
        write_case(case, tmp_path / "other", {"pelvis": [10]}, image_format="nifti")
