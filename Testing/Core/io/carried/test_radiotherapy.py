"""RT Dose and RT structure sets carried from file to file."""

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from carried_case import carried_result
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, ImplicitVRLittleEndian, generate_uid
from segment_files import item, saved, structure_set

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.carried.files import carry_file

DOSE = "1.2.840.10008.5.1.4.1.1.481.2"


def dose_file(folder, bits=32, syntax=ExplicitVRLittleEndian, **changes):
    """An RT Dose of a smooth blob, and its values as an image."""
    k, j, i = np.meshgrid(np.arange(25), np.arange(30), np.arange(35), indexing="ij")
    values = 30000 * np.exp(-((i - 17) ** 2 + (j - 15) ** 2 + (k - 12) ** 2) / 60.0)
    stored = np.rint(values).astype(f"<u{bits // 8}")
    dose = Dataset()
    dose.file_meta = FileMetaDataset()
    dose.file_meta.TransferSyntaxUID = syntax
    dose.SOPClassUID, dose.SOPInstanceUID, dose.Modality = DOSE, generate_uid(), "RTDOSE"
    dose.file_meta.MediaStorageSOPClassUID = dose.SOPClassUID
    dose.file_meta.MediaStorageSOPInstanceUID = dose.SOPInstanceUID
    dose.PatientName, dose.StudyInstanceUID = "Nobody^Nowhere", generate_uid()
    dose.SeriesInstanceUID, dose.FrameOfReferenceUID = generate_uid(), "1.2.3.4"
    dose.Rows, dose.Columns, dose.NumberOfFrames = 30, 35, 25
    dose.SamplesPerPixel, dose.PhotometricInterpretation, dose.PixelRepresentation = 1, "MONOCHROME2", 0
    dose.BitsAllocated = dose.BitsStored = bits
    dose.HighBit, dose.DoseUnits, dose.DoseType = bits - 1, "GY", "PHYSICAL"
    dose.DoseSummationType, dose.DoseGridScaling = "PLAN", "0.001"
    dose.PixelSpacing, dose.ImageOrientationPatient = [3, 2.5], [1, 0, 0, 0, 1, 0]
    dose.ImagePositionPatient = [-40, -50, -35]
    dose.GridFrameOffsetVector = [3.0 * n for n in range(25)]
    dose.FrameIncrementPointer = 0x3004000C
    dose.DVHSequence = [item(DVHType="CUMULATIVE")]
    dose.PixelData = stored.tobytes()
    for name, value in changes.items():
        setattr(dose, name, value) if value is not None else delattr(dose, name)
    dose.save_as(folder / "dose.dcm", enforce_file_format=True)
    image = sitk.GetImageFromArray(stored.astype(np.float64))
    image.SetSpacing((2.5, 3, 3))
    image.SetOrigin((-40, -50, -35))
    return folder / "dose.dcm", image


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("syntax", [ExplicitVRLittleEndian, ImplicitVRLittleEndian])
def test_a_dose_is_resampled_and_becomes_a_new_instance(tmp_path, bits, syntax):
    result = carried_result()
    source, image = dose_file(tmp_path, bits, syntax)
    carry_file(result, source, tmp_path / "out.dcm", "xray")
    before, after = pydicom.dcmread(source), pydicom.dcmread(tmp_path / "out.dcm")
    expected = sitk.GetArrayFromImage(
        sitk.Resample(image, image, result.transform.to_sitk_transform(), sitk.sitkLinear, 0.0)
    )
    inner = (slice(4, -4),) * 3
    np.testing.assert_allclose(after.pixel_array[inner], expected[inner], atol=1.5)
    assert after.SOPInstanceUID == after.file_meta.MediaStorageSOPInstanceUID != before.SOPInstanceUID
    assert after.SeriesInstanceUID != before.SeriesInstanceUID
    for same in ("StudyInstanceUID", "DoseGridScaling", "PatientName", "DoseUnits"):
        assert after[same].value == before[same].value
    assert "DVHSequence" not in after and "PolyPose" in after.DoseComment
    toolkit = sitk.ReadImage(str(tmp_path / "out.dcm"))
    assert toolkit.GetSize() == (35, 30, 25)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"PixelData": b"12"}, "cut short"),
        ({"GridFrameOffsetVector": [0.0, 3, 4, *range(5, 27)]}, "evenly spaced"),
        ({"GridFrameOffsetVector": [0.0, 3]}, "contradict"),
        ({"ImageOrientationPatient": [1, 0, 0, 1, 0, 0]}, "contradict"),
        ({"PixelSpacing": None}, "where its grid is"),
        ({"Modality": "CT"}, "neither an RT Dose"),
    ],
)
def test_a_damaged_dose_is_refused_in_a_sentence(tmp_path, changes, words):
    source, _ = dose_file(tmp_path, **changes)
    with pytest.raises(InputError, match=words) as caught:
        carry_file(carried_result(), source, tmp_path / "out.dcm", "xray")
    assert "Nobody" not in str(caught.value) and not (tmp_path / "out.dcm").exists()


def circle(centre, radius, z, count=60) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x, y = centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
    return np.column_stack([x, y, np.full(count, z)])


def ball_set(result, folder):
    """A structure set of one ball in the soft tissue, in the planes of the CT."""
    labels = result.structure_labels
    planes = labels.affine[2, 3] + labels.affine[2, 2] * np.arange(labels.shape[0])
    centre, radius = np.array([20.0, 20, 10]), 14.0
    inside = [z for z in planes if abs(z - centre[2]) < radius - 1]
    drawn = [circle(centre, np.sqrt(radius**2 - (z - centre[2]) ** 2), z) for z in inside]
    whole = structure_set({"ball": drawn})
    return saved(whole, folder / "rs.dcm"), centre, radius


def points_of(path, name=0):
    roi = pydicom.dcmread(path).ROIContourSequence[name]
    return [np.array(each.ContourData, float).reshape(-1, 3) for each in roi.ContourSequence]


def volume_of(contours, step) -> float:
    """ml, by the shoelace formula."""
    total = 0.0
    for each in contours:
        x, y = each[:, 0], each[:, 1]
        total += 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    return total * step / 1000


def test_contours_move_with_the_field_and_stay_flat(tmp_path):
    result = carried_result()
    shift = np.array([5.0, -3.0, 4.0])
    vectors = np.broadcast_to(-shift, result.transform.vectors.shape).astype(np.float32)
    result.transform = DisplacementField(vectors, result.transform.affine)
    source, centre, radius = ball_set(result, tmp_path)
    carry_file(result, source, tmp_path / "out.dcm", "xray")
    found = points_of(tmp_path / "out.dcm")
    assert len(found) > 5 and all(np.ptp(each[:, 2]) < 1e-3 for each in found)
    together = np.concatenate(found)
    distance = np.linalg.norm(together - (centre + shift), axis=1)
    assert abs(distance.mean() - radius) < 1.2 and np.abs(distance - radius).max() < 4
    assert volume_of(found, 2.5) == pytest.approx(volume_of(points_of(source), 2.5), rel=0.12)
    after = pydicom.dcmread(tmp_path / "out.dcm")
    assert after.Modality == "RTSTRUCT" and after.SOPInstanceUID != pydicom.dcmread(source).SOPInstanceUID


def test_points_of_a_structure_set_are_carried_as_points(tmp_path):
    result = carried_result()
    source, *_ = ball_set(result, tmp_path)
    whole = pydicom.dcmread(source)
    femur = result.structures["femur"].centroid
    point = item(
        ContourGeometricType="POINT", NumberOfContourPoints=1, ContourData=[f"{each:.4f}" for each in femur]
    )
    whole.ROIContourSequence[0].ContourSequence.append(point)
    whole.save_as(source)
    carry_file(result, source, tmp_path / "out.dcm", "xray")
    last = pydicom.dcmread(tmp_path / "out.dcm").ROIContourSequence[0].ContourSequence[-1]
    assert last.ContourGeometricType == "POINT"
    expected = result.transform_points(femur[None]).points[0]
    np.testing.assert_allclose(np.array(last.ContourData, float), expected, atol=1e-3)


def test_a_structure_set_without_contours_is_refused(tmp_path):
    result = carried_result()
    source, *_ = ball_set(result, tmp_path)
    whole = pydicom.dcmread(source)
    whole.ROIContourSequence[0].ContourSequence = []
    whole.save_as(source)
    with pytest.raises(InputError, match="no contour"):
        carry_file(result, source, tmp_path / "out.dcm", "xray")


@pytest.mark.parametrize("distrust", [(), ("nothing fits",)])
def test_objects_of_a_result_that_is_not_trusted_say_so(tmp_path, distrust):
    result = carried_result()
    result.distrust = distrust
    for source, names in (
        (dose_file(tmp_path)[0], ("SeriesDescription", "DoseComment")),
        (ball_set(result, tmp_path)[0], ("SeriesDescription", "StructureSetDescription")),
    ):
        carry_file(result, source, tmp_path / "out.dcm", "xray")
        found = pydicom.dcmread(tmp_path / "out.dcm")
        for name in names:
            assert ("NOT TO BE TRUSTED" in found[name].value) == bool(distrust), name
        assert len(found.SeriesDescription) <= 64


def frames_of(dataset) -> list[str]:
    """Every frame of reference that a dataset names, at any depth."""
    found = []
    for each in dataset.iterall():
        if each.VR == "UI" and "FrameOfReference" in each.keyword:
            found.append(each.value)
    return found


@pytest.mark.parametrize("to", ["xray", "ct"])
@pytest.mark.parametrize("number", [None, 4, 2**31 - 1])
def test_carried_objects_have_a_frame_of_reference_and_a_series_number_of_their_own(tmp_path, to, number):
    result = carried_result()
    for source in (dose_file(tmp_path)[0], ball_set(result, tmp_path)[0]):
        given = pydicom.dcmread(source)
        given.SeriesNumber = number
        if given.Modality == "RTSTRUCT":
            frames = [item(FrameOfReferenceUID="1.2.3"), item(FrameOfReferenceUID="1.2.4")]
            given.ReferencedFrameOfReferenceSequence = frames
            given.StructureSetROISequence[0].ReferencedFrameOfReferenceUID = "1.2.3"
            given.FrameOfReferenceRelationshipSequence = [item(RelatedFrameOfReferenceUID="1.2.5")]
        given.save_as(source)
        carry_file(result, source, tmp_path / "out.dcm", to)
        found = pydicom.dcmread(tmp_path / "out.dcm")
        frames = frames_of(found)
        assert len(frames) >= (1 if given.Modality == "RTDOSE" else 2) and len(set(frames)) == 1
        assert frames[0] not in frames_of(given)
        assert found.SeriesNumber not in (None, number) and 0 < found.SeriesNumber < 2**31
