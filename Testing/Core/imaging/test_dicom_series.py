"""DICOM stacks: order, geometry, and what makes a stack unfit."""

import numpy as np
import pydicom
import pytest
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, EnhancedCTImageStorage, ExplicitVRLittleEndian, generate_uid

from PolyPoseLib.errors import InputError
from PolyPoseLib.imaging.volume import read_ct, read_volume

SHAPE = (8, 5, 6)
AXES = ([1, 0, 0, 0, 1, 0], [0.8, 0.6, 0, -0.6, 0.8, 0], [1, 0, 0, 0, 0, -1], [-1, 0, 0, 0, 1, 0])


def header(uid, sop, rows=SHAPE[1], columns=SHAPE[2]) -> Dataset:
    """What every image file needs."""
    file = Dataset()
    file.file_meta = FileMetaDataset()
    file.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    file.file_meta.MediaStorageSOPClassUID = file.SOPClassUID = sop
    file.file_meta.MediaStorageSOPInstanceUID = file.SOPInstanceUID = generate_uid()
    file.SeriesInstanceUID, file.StudyInstanceUID = uid, generate_uid()
    file.FrameOfReferenceUID = generate_uid()
    file.PatientName, file.PatientID = "Nobody^Nowhere", "0"
    file.Modality = "CT"
    file.Rows, file.Columns = rows, columns
    file.SamplesPerPixel, file.PhotometricInterpretation = 1, "MONOCHROME2"
    file.BitsAllocated, file.BitsStored, file.HighBit, file.PixelRepresentation = 16, 16, 15, 0
    return file


def write_stack(folder, voxels, axes=AXES[0], step=2.5, positions=None, uid=None, number=4, **tags):
    """One file a slice, named so that alphabetical order is wrong; returns the slices' normal."""
    folder.mkdir(exist_ok=True)
    uid = uid or generate_uid()
    normal = np.cross(axes[:3], axes[3:])
    positions = (
        positions
        if positions is not None
        else [np.array([10, -20, 30]) + n * step * normal for n in range(len(voxels))]
    )
    order = np.random.default_rng(0).permutation(len(voxels))
    for name, n in enumerate(order):
        file = header(uid, CTImageStorage)
        file.SeriesNumber, file.SeriesDescription, file.InstanceNumber = number, "thin", int(n) + 1
        file.ImagePositionPatient = [float(value) for value in positions[n]]
        file.ImageOrientationPatient, file.PixelSpacing = list(axes), [0.7, 0.9]
        file.RescaleSlope, file.RescaleIntercept = 1, -1024
        file.PixelData = (voxels[n] + 1024).astype("<u2").tobytes()
        for tag, value in tags.items():
            setattr(file, tag, value)
        file.save_as(folder / f"{number}_{name:03d}.dcm", enforce_file_format=True)
    return normal


def stack(seed=0):
    """Voxels like a CT's."""
    voxels = np.random.default_rng(seed).integers(-1000, 1500, SHAPE)
    voxels.flat[:2] = -1000, 1500
    return voxels


@pytest.mark.parametrize("axes", AXES)
def test_slices_are_sorted_by_position(tmp_path, axes):
    voxels = stack()
    normal = write_stack(tmp_path / "ct", voxels, axes)
    ct = read_ct(tmp_path / "ct")
    assert np.array_equal(ct.voxels, voxels)
    assert np.allclose(ct.affine[:3, 2], 2.5 * normal, atol=1e-6)
    assert np.allclose(ct.affine[:3, 0], 0.9 * np.array(axes[:3]), atol=1e-6)
    assert np.allclose(ct.affine[:3, 1], 0.7 * np.array(axes[3:]), atol=1e-6)
    assert np.allclose(ct.affine[:3, 3], [10, -20, 30])


def test_gantry_tilt_is_refused_but_a_filled_in_angle_is_not(tmp_path):
    tilted = [np.array([0, 0.2 * n, 2.5 * n]) for n in range(SHAPE[0])]
    write_stack(tmp_path / "tilted", stack(), positions=tilted)
    with pytest.raises(InputError, match=r"4\.6 degrees \(gantry tilt\)"):
        read_volume(tmp_path / "tilted")
    write_stack(tmp_path / "straight", stack(), GantryDetectorTilt=15)
    assert read_volume(tmp_path / "straight").shape == SHAPE


def test_missing_uneven_and_repeated_slices_are_refused(tmp_path):
    even = [np.array([0, 0, 2.5 * n]) for n in range(SHAPE[0])]
    missing = [*even[:5], *(np.array([0, 0, 2.5 * n + 5]) for n in range(5, SHAPE[0]))]
    write_stack(tmp_path / "missing", stack(), positions=missing)
    with pytest.raises(InputError, match=r"2 slice\(s\) are missing between 10\.00 and 17\.50 mm"):
        read_volume(tmp_path / "missing")
    write_stack(
        tmp_path / "uneven", stack(), positions=[*even[:5], *(np.add(p, [0, 0, 0.9]) for p in even[5:])]
    )
    with pytest.raises(InputError, match="unevenly spaced"):
        read_volume(tmp_path / "uneven")
    write_stack(tmp_path / "twice", stack(), positions=[even[0], *even[:-1]])
    with pytest.raises(InputError, match="same place"):
        read_volume(tmp_path / "twice")


def test_rounded_positions_are_not_uneven(tmp_path):
    rounded = [np.array([0, 0, round(0.625 * n, 1)]) for n in range(SHAPE[0])]
    write_stack(tmp_path / "ct", stack(), positions=rounded)
    assert read_volume(tmp_path / "ct").shape == SHAPE


def test_several_series_are_listed_and_chosen(tmp_path):
    first, second = stack(1), stack(2)
    uid = generate_uid()
    write_stack(tmp_path / "ct", first, number=3)
    write_stack(tmp_path / "ct", second, number=7, uid=uid)
    with pytest.raises(InputError, match=r'2 CT series: set "ct_series" to one of 3 \(8 slices, thin\); 7'):
        read_volume(tmp_path / "ct")
    assert np.array_equal(read_volume(tmp_path / "ct", 3).voxels, first)
    assert np.array_equal(read_volume(tmp_path / "ct", "7").voxels, second)
    assert np.array_equal(read_volume(tmp_path / "ct", str(uid)).voxels, second)
    with pytest.raises(InputError, match="no series has"):
        read_volume(tmp_path / "ct", 9)


def test_localizers_and_other_files_are_left_aside(tmp_path):
    voxels = stack()
    write_stack(tmp_path / "ct", voxels)
    write_stack(tmp_path / "ct", voxels[:1], number=1, ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"])
    (tmp_path / "ct" / "README.txt").write_text("hello")
    assert np.array_equal(read_volume(tmp_path / "ct").voxels, voxels)


def test_folders_without_a_ct_are_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no DICOM image"):
        read_volume(tmp_path / "empty")
    write_stack(tmp_path / "mr", stack(), Modality="MR")
    with pytest.raises(InputError, match=r"no CT series here \(found: MR\)"):
        read_volume(tmp_path / "mr")
    write_stack(tmp_path / "one", stack()[:1])
    with pytest.raises(InputError, match="one slice only"):
        read_volume(tmp_path / "one")
    write_stack(tmp_path / "mixed", stack())
    write_stack(tmp_path / "nowhere", stack(), ImagePositionPatient=None)
    with pytest.raises(InputError, match="ImagePositionPatient"):
        read_volume(tmp_path / "nowhere")


def test_enhanced_ct_is_read_by_its_functional_groups(tmp_path):
    voxels = stack()
    file = header(generate_uid(), EnhancedCTImageStorage)
    file.NumberOfFrames = SHAPE[0]
    order = np.random.default_rng(1).permutation(SHAPE[0])
    frames = []
    for n in order:
        plane, frame = Dataset(), Dataset()
        plane.ImagePositionPatient = [0, 0, 1.5 * float(n)]
        frame.PlanePositionSequence = [plane]
        frames.append(frame)
    shared, orientation, measures, rescale = (Dataset() for _ in range(4))
    orientation.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    measures.PixelSpacing = [0.7, 0.9]
    rescale.RescaleIntercept, rescale.RescaleSlope = -1024, 1
    shared.PlaneOrientationSequence, shared.PixelMeasuresSequence = [orientation], [measures]
    shared.PixelValueTransformationSequence = [rescale]
    file.SharedFunctionalGroupsSequence, file.PerFrameFunctionalGroupsSequence = [shared], frames
    file.PixelData = (voxels[order] + 1024).astype("<u2").tobytes()
    pydicom.dcmwrite(tmp_path / "ct.dcm", file, enforce_file_format=True)
    ct = read_ct(tmp_path / "ct.dcm")
    assert np.array_equal(ct.voxels, voxels)
    assert np.allclose(ct.spacing, [0.9, 0.7, 1.5])
