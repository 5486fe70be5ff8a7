"""Distance, pixel spacing and principal point: which number wins, where it came from, what is asked for."""

import numpy as np
import pytest
import SimpleITK as sitk
from pydicom.dataset import Dataset
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray


def read(tmp_path, ds, **fields):
    return read_xray(save(ds, tmp_path / "x.dcm"), fields=fields)


def refusal(tmp_path, ds, **fields):
    with pytest.raises(InputError) as error:
        read(tmp_path, ds, **fields)
    return str(error.value)


def test_k_follows_the_pixel_centre_convention(tmp_path):
    xray = read(tmp_path, dataset())
    np.testing.assert_allclose(xray.intrinsics, [[2500, 0, 15.5], [0, 2000, 11.5], [0, 0, 1]])
    assert xray.pixel_spacing_mm == (0.5, 0.4)
    assert xray.source_to_detector_mm == 1000


def test_the_study_file_wins_and_the_other_value_is_told(tmp_path):
    xray = read(tmp_path, dataset(), source_to_detector_mm=1020, pixel_spacing_mm=[0.3, 0.2])
    assert "source_to_detector_mm 1020 from study.json (DICOM (0018,1110) says 1000)" in xray.provenance
    assert "pixel_spacing_mm 0.3 x 0.2 from study.json (DICOM (0018,1164) says 0.5 x 0.4)" in xray.provenance
    assert xray.intrinsics[0, 0] == pytest.approx(1020 / 0.2)
    assert xray.intrinsics[1, 1] == pytest.approx(1020 / 0.3)


def test_one_number_is_a_square_pixel(tmp_path):
    assert read(tmp_path, dataset(), pixel_spacing_mm=0.3).pixel_spacing_mm == (0.3, 0.3)


@pytest.mark.parametrize("zero", [{}, {"DistanceSourceToDetector": 0, "ImagerPixelSpacing": [0, 0]}])
def test_missing_and_zero_geometry_asks_for_the_two_fields(tmp_path, zero):
    ds = dataset(known=False, **zero)
    text = refusal(tmp_path, ds)
    assert '"source_to_detector_mm"' in text
    assert '"pixel_spacing_mm"' in text
    assert "x.dcm" in text
    read(tmp_path, ds, source_to_detector_mm=1000, pixel_spacing_mm=[0.4, 0.4])


def test_one_missing_number_is_asked_for_alone(tmp_path):
    text = refusal(tmp_path, dataset(DistanceSourceToDetector=None))
    assert 'add "source_to_detector_mm"' in text
    assert '"pixel_spacing_mm" is known: 0.5 x 0.4' in text
    text = refusal(tmp_path, dataset(ImagerPixelSpacing=None))
    assert 'add "pixel_spacing_mm"' in text
    assert '"source_to_detector_mm" is known: 1000' in text


def test_a_picture_asks_for_the_two_fields(tmp_path):
    path = tmp_path / "x.png"
    sitk.WriteImage(sitk.GetImageFromArray(random_pixels()), path)
    with pytest.raises(InputError, match=r'"source_to_detector_mm" and "pixel_spacing_mm"'):
        read_xray(path)


def test_uncalibrated_pixel_spacing_alone_is_not_taken(tmp_path):
    text = refusal(tmp_path, dataset(ImagerPixelSpacing=None, PixelSpacing=[0.3, 0.3]))
    assert "0.3 x 0.3 may hold at the detector or in the patient" in text
    assert '"pixel_spacing_mm"' in text


def test_pixel_spacing_at_the_patient_does_not_replace_the_imagers(tmp_path):
    ds = dataset(PixelSpacing=[0.25, 0.2], PixelSpacingCalibrationType="GEOMETRY")
    xray = read(tmp_path, ds)
    assert xray.pixel_spacing_mm == (0.5, 0.4)
    assert any("0.25 x 0.2 (GEOMETRY) is the patient's" in line for line in xray.provenance)


@pytest.mark.parametrize("kind", ["GEOMETRY", "FIDUCIAL"])
def test_a_calibrated_spacing_is_converted_by_its_magnification(tmp_path, kind):
    ds = dataset(ImagerPixelSpacing=None, PixelSpacing=[0.25, 0.2], PixelSpacingCalibrationType=kind)
    ds.EstimatedRadiographicMagnificationFactor = "1.6"
    xray = read(tmp_path, ds)
    np.testing.assert_allclose(xray.pixel_spacing_mm, (0.4, 0.32))
    assert any("calibrated at the patient" in line for line in xray.warnings)


def test_a_geometric_calibration_is_converted_by_the_distances(tmp_path):
    ds = dataset(ImagerPixelSpacing=None, PixelSpacing=[0.25, 0.2], PixelSpacingCalibrationType="GEOMETRY")
    ds.DistanceSourceToPatient = 500
    np.testing.assert_allclose(read(tmp_path, ds).pixel_spacing_mm, (0.5, 0.4))


def test_a_fiducial_at_an_unknown_depth_is_refused(tmp_path):
    ds = dataset(ImagerPixelSpacing=None, PixelSpacing=[0.25, 0.2], PixelSpacingCalibrationType="FIDUCIAL")
    ds.DistanceSourceToPatient = 500
    text = refusal(tmp_path, ds)
    assert "calibrated at the patient (FIDUCIAL)" in text
    assert '"pixel_spacing_mm"' in text


def test_scanned_film_and_image_intensifiers_have_their_own_tags(tmp_path):
    film = dataset(ImagerPixelSpacing=None, NominalScannedPixelSpacing=[0.15, 0.15])
    assert read(tmp_path, film).pixel_spacing_mm == (0.15, 0.15)
    pixels = random_pixels(shape=(32, 32))
    round_field = dataset(pixels, ImagerPixelSpacing=None, FieldOfViewDimensions=16, FieldOfViewShape="ROUND")
    xray = read(tmp_path, round_field)
    assert xray.pixel_spacing_mm == (0.5, 0.5)
    assert any("field of view" in line for line in xray.warnings)


def test_a_field_of_view_that_contradicts_the_spacing_is_told(tmp_path):
    ds = dataset(random_pixels(shape=(100, 100)), "DX", FieldOfViewDimensions=[100, 100])
    assert any("cropped or resampled" in line for line in read(tmp_path, ds).warnings)
    ds.FieldOfViewDimensions = [50, 40]
    assert not any("cropped" in line for line in read(tmp_path, ds).warnings)


def test_rt_images_have_their_own_tags(tmp_path):
    xray = read(tmp_path, dataset(modality="RTIMAGE"))
    assert xray.source_to_detector_mm == 1500
    assert xray.intrinsics[0, 0] == pytest.approx(1500 / 0.4)


def test_the_principal_point_of_the_study_file_wins(tmp_path):
    xray = read(tmp_path, dataset(), principal_point_px=[10.25, 3.5])
    np.testing.assert_allclose(xray.intrinsics[:2, 2], (10.25, 3.5))
    assert any("principal_point_px 10.25, 3.50 from study.json" in line for line in xray.provenance)


def test_given_intrinsics_take_the_place_of_everything(tmp_path):
    k = [[2000, 0, 12], [0, 2100, 13], [0, 0, 1]]
    xray = read(tmp_path, dataset(known=False), intrinsics=k)
    np.testing.assert_allclose(xray.intrinsics, k)
    assert xray.source_to_detector_mm / xray.pixel_spacing_mm[1] == pytest.approx(2000)
    assert xray.source_to_detector_mm / xray.pixel_spacing_mm[0] == pytest.approx(2100)
    xray = read(tmp_path, dataset(known=False), intrinsics=k, pixel_spacing_mm=[0.5, 0.5])
    assert xray.source_to_detector_mm == pytest.approx(1000)


@pytest.mark.parametrize("rotation", [0, 90, 180, 270])
@pytest.mark.parametrize("flip", ["NO", "YES"])
@pytest.mark.parametrize("binning", [1, 2])
def test_the_detectors_centre_is_followed_through_crop_bins_turn_and_flip(tmp_path, rotation, flip, binning):
    # The truth is made by doing to an image of the detector what the tags say was done.
    elements, origin, size = (120, 160), (26, 44), (48, 64)
    center = (elements[0] / 2 - 0.5, elements[1] / 2 - 0.5)
    row, column = np.meshgrid(np.arange(elements[0]), np.arange(elements[1]), indexing="ij")

    def stored(detector):
        cut = detector[origin[0] : origin[0] + size[0], origin[1] : origin[1] + size[1]]
        cut = cut.reshape(size[0] // binning, binning, size[1] // binning, binning).mean((1, 3))
        cut = np.rot90(cut, -rotation // 90)
        return cut[:, ::-1] if flip == "YES" else cut

    down, right = stored(row - center[0]), stored(column - center[1])
    grid = np.stack([*np.indices(down.shape).reshape(2, -1), np.ones(down.size)])
    to_detector = np.stack([np.linalg.lstsq(grid.T, part.ravel(), rcond=None)[0] for part in (down, right)])
    truth = np.linalg.solve(to_detector[:, :2], -to_detector[:, 2])

    spacing = np.array([0.2, 0.3])
    pitch = spacing * binning
    ds = dataset(
        random_pixels(shape=down.shape),
        "DX",
        ImagerPixelSpacing=list(pitch if rotation % 180 == 0 else pitch[::-1]),
        DetectorElementSpacing=list(spacing),
        DetectorActiveDimensions=list(np.array(elements) * spacing),
        DetectorActiveOrigin=[0, 0],
        FieldOfViewOrigin=list(origin),
        FieldOfViewRotation=rotation,
        FieldOfViewHorizontalFlip=flip,
    )
    xray = read(tmp_path, ds)
    np.testing.assert_allclose(xray.intrinsics[:2, 2][::-1], truth, atol=1e-6)
    assert any("active detector" in line for line in xray.provenance)


def test_the_active_areas_own_origin_counts(tmp_path):
    ds = dataset(
        random_pixels(shape=(40, 40)),
        "DX",
        ImagerPixelSpacing=[0.2, 0.2],
        DetectorElementSpacing=[0.2, 0.2],
        DetectorActiveDimensions=[8, 8],
        DetectorActiveOrigin=[5, 7],
        FieldOfViewOrigin=[5, 7],
        FieldOfViewRotation=0,
        FieldOfViewHorizontalFlip="NO",
    )
    np.testing.assert_allclose(read(tmp_path, ds).intrinsics[:2, 2], (19.5, 19.5))


def test_an_implausible_field_of_view_is_ignored(tmp_path):
    ds = dataset(
        random_pixels(shape=(40, 40)),
        "DX",
        DetectorElementSpacing=[0.2, 0.2],
        DetectorActiveDimensions=[400, 400],
        FieldOfViewOrigin=[0, 0],
        FieldOfViewRotation=0,
        FieldOfViewHorizontalFlip="NO",
    )
    xray = read(tmp_path, ds)
    np.testing.assert_allclose(xray.intrinsics[:2, 2], (19.5, 19.5))
    assert any("ignored" in line for line in xray.warnings)


def enhanced(**groups):
    """Enhanced XA with everything in functional groups; two frames."""
    frames = np.stack([random_pixels(seed) for seed in range(2)])
    ds = dataset(frames, known=False, PixelIntensityRelationship=None)
    ds.SOPClassUID = ds.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.5.1.4.1.1.12.1.1"
    shared = Dataset()
    geometry, pixel_data = Dataset(), Dataset()
    geometry.DistanceSourceToDetector, geometry.DistanceSourceToIsocenter = 1200, 800
    pixel_data.ImagerPixelSpacing = [0.3, 0.3]
    pixel_data.PixelIntensityRelationship, pixel_data.PixelIntensityRelationshipSign = "LIN", 1
    shared.XRayGeometrySequence = [geometry]
    shared.FramePixelDataPropertiesSequence = [pixel_data]
    ds.SharedFunctionalGroupsSequence = [shared]
    per_frame = []
    for index in range(2):
        group, positioner = Dataset(), Dataset()
        positioner.PositionerPrimaryAngle, positioner.PositionerSecondaryAngle = 10.0 + 20 * index, -5.0
        group.PositionerPositionSequence = [positioner]
        per_frame.append(group)
    ds.PerFrameFunctionalGroupsSequence = per_frame
    return ds


def test_enhanced_xa_is_read_from_its_functional_groups(tmp_path):
    path = save(enhanced(), tmp_path / "x.dcm")
    for index, angle in enumerate(("LAO 10, CAU 5", "LAO 30, CAU 5")):
        xray = read_xray(path, frame=index)
        assert xray.source_to_detector_mm == 1200
        assert xray.pixel_spacing_mm == (0.3, 0.3)
        assert any(angle in line for line in xray.provenance)
        assert any("source_to_isocenter_mm 800" in line for line in xray.provenance)
        assert any("relationship LIN" in line for line in xray.provenance)


def test_enhanced_xa_knows_where_the_isocentre_projects(tmp_path):
    ds = enhanced()
    ds.DetectorElementSpacing = [0.3, 0.3]
    ds.PositionOfIsocenterProjection = [110.0, 215.0]
    view = Dataset()
    view.FieldOfViewOrigin, view.FieldOfViewRotation, view.FieldOfViewHorizontalFlip = [100, 200], 0, "NO"
    ds.SharedFunctionalGroupsSequence[0].FieldOfViewSequence = [view]
    xray = read_xray(save(ds, tmp_path / "x.dcm"), frame=0, fields={"mirrored": False})
    np.testing.assert_allclose(xray.intrinsics[:2, 2], (15, 10))
    assert any("(0018,9430)" in line for line in xray.provenance)


def test_an_rt_image_is_placed_by_its_position(tmp_path):
    ds = dataset(modality="RTIMAGE", RTImagePosition=[-6.0, 4.0])
    np.testing.assert_allclose(read(tmp_path, ds).intrinsics[:2, 2], (15, 10))
    ds.XRayImageReceptorTranslation = [2.0, -1.2, -500]
    np.testing.assert_allclose(read(tmp_path, ds).intrinsics[:2, 2], (10, 7))
    del ds.RTImagePosition
    np.testing.assert_allclose(read(tmp_path, ds).intrinsics[:2, 2], (15.5 - 5, 11.5 - 3))


def test_an_rt_image_on_a_turned_receptor(tmp_path):
    # Turned by 90 degrees, Xr lies along Yg and Yr along -Xg: the axis at (-2, 1.2) from the receptor is
    # (1.2, 2) on it.
    ds = dataset(modality="RTIMAGE", RTImagePosition=[-6.0, 4.0], XRayImageReceptorAngle=90)
    ds.XRayImageReceptorTranslation = [2.0, -1.2, -500]
    np.testing.assert_allclose(read(tmp_path, ds).intrinsics[:2, 2], ((1.2 + 6) / 0.4, (4 - 2) / 0.4))
