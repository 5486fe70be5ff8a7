"""DICOM stacks of a few voxels on disk."""

import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, EnhancedCTImageStorage, ExplicitVRLittleEndian, generate_uid

SHAPE = (8, 5, 6)


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


def write_stack(
    folder, voxels, axes=(1, 0, 0, 0, 1, 0), step=2.5, positions=None, uid=None, number=4, **tags
):
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
        file = header(uid, CTImageStorage, *voxels[n].shape)
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


def enhanced(voxels, order):
    """One file with a frame for each slice, the frames in this order."""
    file = header(generate_uid(), EnhancedCTImageStorage, *voxels.shape[1:])
    file.NumberOfFrames = len(voxels)
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
    return file
