"""The initial camera: from DICOM or the study file, mirrored images included."""

import numpy as np
import pytest
from pydicom.dataset import Dataset
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.data.xray import place_isocenter
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.carm import carm_extrinsic, equipment_to_patient, iec_axes, view_from_axes
from PolyPoseLib.io.xray.read import read_xray


def read(tmp_path, ds, isocenter=None, **fields):
    return read_xray(save(ds, tmp_path / "x.dcm"), fields=fields, isocenter=isocenter)


def c_arm(primary=30, secondary=-10, modality="XA", **attributes):
    return dataset(
        modality=modality,
        PositionerPrimaryAngle=primary,
        PositionerSecondaryAngle=secondary,
        DistanceSourceToPatient=700,
        **attributes,
    )


def pixel_of(xray, point):
    camera = Camera(xray.intrinsics, xray.extrinsic, *xray.image.shape)
    return camera.project(np.asarray(point, float))


def test_a_c_arms_initial_camera_is_the_view_of_its_angles(tmp_path):
    xray = read(tmp_path, c_arm(), isocenter=(1, 2, 3))
    assert xray.camera == "initial"
    np.testing.assert_allclose(xray.extrinsic, carm_extrinsic(30, -10, 700, (1, 2, 3)), atol=1e-9)
    np.testing.assert_allclose(pixel_of(xray, (1, 2, 3)), xray.intrinsics[:2, 2])
    assert xray.isocenter == (1, 2, 3)
    degrees, millimetres = xray.initial_radius
    assert degrees > 5
    assert millimetres > 50


def test_a_displayed_c_arm_image_is_reversed_to_the_sources_view(tmp_path):
    pixels = random_pixels()
    shown = read(tmp_path, dataset(pixels))
    assert not shown.mirrored
    xray = read(tmp_path, c_arm(0, 0))
    assert xray.mirrored
    np.testing.assert_array_equal(xray.image, shown.image[:, ::-1])
    left, head = pixel_of(xray, (20, 0, 0)), pixel_of(xray, (0, 0, 20))
    # The patient's left is at the right of the file, hence at the left of the source's view; the head is up.
    assert left[0] < xray.intrinsics[0, 2]
    assert head[1] < xray.intrinsics[1, 2]
    assert any('"mirrored": false' in line for line in xray.warnings)


def test_reversal_takes_mask_and_principal_point_with_it(tmp_path):
    shutter = dict(ShutterShape="RECTANGULAR", ShutterLeftVerticalEdge=1, ShutterRightVerticalEdge=20)
    shutter.update(ShutterUpperHorizontalEdge=1, ShutterLowerHorizontalEdge=24)
    xray = read(tmp_path, c_arm(**shutter), principal_point_px=[10, 4])
    np.testing.assert_array_equal(xray.mask[:, :12], False)
    assert xray.mask[:, 12:].all()
    np.testing.assert_allclose(xray.intrinsics[:2, 2], (31 - 10, 4))


@pytest.mark.parametrize(
    ("letters", "mirrored", "right", "down"),
    [
        (["L", "F"], True, None, None),
        (["R", "F"], False, (-1, 0, 0), (0, 0, -1)),
        (["F", "L"], False, (0, 0, -1), (1, 0, 0)),
        (["R", "H"], True, None, None),
        (["L", "H"], False, (1, 0, 0), (0, 0, 1)),
        (["LP", "FA"], True, None, None),
    ],
)
def test_patient_orientation_tells_turn_and_mirror(tmp_path, letters, mirrored, right, down):
    xray = read(tmp_path, c_arm(0, 0, PatientOrientation=letters))
    assert xray.mirrored is mirrored
    np.testing.assert_allclose(xray.extrinsic[2, :3], (0, -1, 0), atol=1e-12)
    if right is not None:
        np.testing.assert_allclose(xray.extrinsic[:2, :3], [right, down], atol=1e-12)


def test_meaningless_orientations_are_ignored(tmp_path):
    for letters in (["L", "L"], ["X", "F"], ["A", "F"], "L"):
        xray = read(tmp_path, c_arm(0, 0, PatientOrientation=letters))
        np.testing.assert_allclose(xray.extrinsic, carm_extrinsic(0, 0, 700), atol=1e-12)


def test_the_study_file_may_deny_the_mirror(tmp_path):
    xray = read(tmp_path, c_arm(0, 0), mirrored=False)
    assert not xray.mirrored
    np.testing.assert_allclose(xray.extrinsic[:3, :3], [(-1, 0, 0), (0, 0, -1), (0, -1, 0)], atol=1e-12)


def test_angle_increments_turn_the_frames_of_a_run(tmp_path):
    frames = np.stack([random_pixels(seed) for seed in range(3)])
    ds = dataset(
        frames,
        PositionerPrimaryAngle=10,
        PositionerSecondaryAngle=0,
        PositionerMotion="DYNAMIC",
        PositionerPrimaryAngleIncrement=["0", "15", "30"],
        PositionerSecondaryAngleIncrement=["0", "1", "2"],
        DistanceSourceToPatient=700,
    )
    path = save(ds, tmp_path / "x.dcm")
    for index, (primary, secondary) in enumerate(((10, 0), (25, 1), (40, 2))):
        xray = read_xray(path, frame=index)
        np.testing.assert_allclose(xray.extrinsic, carm_extrinsic(primary, secondary, 700), atol=1e-9)


def test_isocentre_angles_are_turned_by_the_patient_position(tmp_path):
    ds = dataset(
        PositionerIsocenterPrimaryAngle=20.0,
        PositionerIsocenterSecondaryAngle=5.0,
        PatientPosition="FFP",
        DistanceSourceToIsocenter=650.0,
    )
    xray = read(tmp_path, ds)
    np.testing.assert_allclose(xray.extrinsic, carm_extrinsic(20, 5, 650, patient_position="FFP"), atol=1e-6)


def test_angles_of_the_study_file_win(tmp_path):
    xray = read(
        tmp_path,
        c_arm(),
        primary_angle_deg=-45,
        secondary_angle_deg=12,
        source_to_isocenter_mm=620,
        patient_position="HFP",
        isocenter_mm=[5, 6, 7],
    )
    np.testing.assert_allclose(
        xray.extrinsic, carm_extrinsic(-45, 12, 620, (5, 6, 7), patient_position="HFP"), atol=1e-9
    )
    assert any("RAO 45, CRA 12 from study.json" in line for line in xray.provenance)


def test_an_assumed_distance_widens_the_radius(tmp_path):
    sure = read(tmp_path, c_arm())
    ds = c_arm()
    del ds.DistanceSourceToPatient
    assumed = read(tmp_path, ds)
    assert assumed.initial_radius[1] > sure.initial_radius[1]
    assert any("assumed" in line for line in assumed.provenance)


def test_an_isocentre_behind_the_detector_is_refused(tmp_path):
    with pytest.raises(InputError, match="source_to_isocenter_mm"):
        read(tmp_path, c_arm(), source_to_isocenter_mm=1500)


@pytest.mark.parametrize(
    ("view", "beam", "mirrored"),
    [("AP", (0, 1, 0), False), ("PA", (0, -1, 0), True), ("LL", (1, 0, 0), True), ("RL", (-1, 0, 0), True)],
)
def test_a_radiographs_view_position_gives_a_coarse_initial_camera(tmp_path, view, beam, mirrored):
    xray = read(tmp_path, dataset(modality="DX", ViewPosition=view))
    np.testing.assert_allclose(xray.extrinsic[2, :3], beam, atol=1e-12)
    assert xray.mirrored is mirrored
    assert xray.initial_radius[0] >= 20
    head = pixel_of(xray, (0, 0, 20))
    assert head[1] < xray.intrinsics[1, 2]


def test_nothing_known_means_no_camera(tmp_path):
    for ds in (dataset(), dataset(modality="CR"), dataset(modality="MG", ViewPosition="CC")):
        xray = read(tmp_path, ds)
        assert (xray.camera, xray.extrinsic, xray.initial_radius) == ("absent", None, None)
    assert read(tmp_path, c_arm(), camera="absent").camera == "absent"


def test_a_portal_image_is_the_beams_eye_view(tmp_path):
    ds = dataset(
        modality="RTIMAGE",
        GantryAngle=35,
        PatientSupportAngle=10,
        XRayImageReceptorAngle=5,
        RadiationMachineSAD=1000,
        IsocenterPosition=[10, 20, 30],
        PatientPosition="FFS",
        RTImagePlane="NORMAL",
    )
    xray = read(tmp_path, ds)
    axes = (equipment_to_patient("FFS") @ axis for axis in iec_axes(35, couch_deg=10, receptor_deg=5))
    truth, _ = view_from_axes(*axes, 1000, (10, 20, 30))
    np.testing.assert_allclose(xray.extrinsic, truth, atol=1e-9)
    assert not xray.mirrored
    ds.RTImageOrientation = [-1, 0, 0, 0, -1, 0]
    flipped = read(tmp_path, ds)
    assert flipped.mirrored
    np.testing.assert_allclose(flipped.extrinsic, truth, atol=1e-9)


def test_a_given_extrinsic_is_kept_and_its_state_told(tmp_path):
    extrinsic = carm_extrinsic(12, 3, 640, (1, 2, 3))
    for state, camera in (("known", "known"), ("initial", "initial"), (None, "initial")):
        xray = read(tmp_path, dataset(), extrinsic=extrinsic.tolist(), camera=state)
        np.testing.assert_allclose(xray.extrinsic, extrinsic, atol=1e-12)
        assert (xray.camera, xray.initial_radius, xray.isocenter) == (camera, None, None)
    known_but_absent = read(tmp_path, dataset(), camera="known")
    assert known_but_absent.camera == "absent"
    assert any('"known"' in line for line in known_but_absent.warnings)


def test_patient_orientation_reverses_an_image_that_contradicts_the_given_extrinsic(tmp_path):
    extrinsic = carm_extrinsic(0, 0, 700).tolist()
    assert read(tmp_path, c_arm(0, 0, PatientOrientation=["L", "F"]), extrinsic=extrinsic).mirrored
    assert not read(tmp_path, c_arm(0, 0, PatientOrientation=["R", "F"]), extrinsic=extrinsic).mirrored
    assert not read(tmp_path, c_arm(0, 0), extrinsic=extrinsic).mirrored
    denied = read(tmp_path, c_arm(0, 0, PatientOrientation=["L", "F"]), extrinsic=extrinsic, mirrored=False)
    assert not denied.mirrored


def table_image(longitudinal, vertical, lateral, position="HFS"):
    ds = c_arm(0, 0, PatientPosition=position)
    table = Dataset()
    table.TableTopLongitudinalPosition = longitudinal
    table.TableTopVerticalPosition = vertical
    table.TableTopLateralPosition = lateral
    group = Dataset()
    group.TablePositionSequence = [table]
    ds.SharedFunctionalGroupsSequence = [group]
    return ds


@pytest.mark.parametrize("position", ["HFS", "FFP"])
def test_a_table_that_moves_the_patient_moves_the_isocentre_the_other_way(tmp_path, position):
    first = read(tmp_path, table_image(5, 10, 20, position))
    second = read(tmp_path, table_image(5 + 30, 10, 20 + 40, position))
    without = read(tmp_path, c_arm(0, 0))
    given = read(tmp_path, dataset(), extrinsic=np.eye(4).tolist())
    placed = place_isocenter((first, second, without, given), (100, 0, -50))
    moved = equipment_to_patient(position) @ (30, 0, 40)
    np.testing.assert_allclose(placed[0].isocenter, (100, 0, -50))
    np.testing.assert_allclose(placed[1].isocenter, np.array([100, 0, -50]) - moved)
    np.testing.assert_allclose(placed[2].isocenter, (100, 0, -50))
    assert placed[3] is given
    for xray in placed[:3]:
        np.testing.assert_allclose(pixel_of(xray, xray.isocenter), xray.intrinsics[:2, 2])


def test_table_increments_within_a_run(tmp_path):
    frames = np.stack([random_pixels(seed) for seed in range(2)])
    ds = dataset(
        frames,
        PositionerPrimaryAngle=0,
        PositionerSecondaryAngle=0,
        TableMotion="DYNAMIC",
        TableLongitudinalIncrement=["0", "3"],
        TableLateralIncrement=["0", "4"],
        TableVerticalIncrement=["0", "5"],
    )
    path = save(ds, tmp_path / "x.dcm")
    assert read_xray(path, frame=0).table_mm == (0, 0, 0)
    assert read_xray(path, frame=1).table_mm == (3, 5, 4)
