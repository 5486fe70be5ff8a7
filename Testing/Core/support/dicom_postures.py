"""The neck in two postures as an archive delivers it: DICOM series with structure sets."""

import numpy as np
from dicom_stack import header
from pydicom.uid import CTImageStorage, generate_uid
from segment_files import item, saved, structure_set
from two_postures import REPOSITIONED, SHAPE, grids, moved, scan


def contours(labels, affine, number):
    """A square around a label in every slice that holds it."""
    contours = []
    for k in np.flatnonzero((labels == number).any(axis=(1, 2))):
        j, i = np.nonzero(labels[k] == number)
        corners = [
            (i.min() - 0.5, j.min() - 0.5),
            (i.max() + 0.5, j.min() - 0.5),
            (i.max() + 0.5, j.max() + 0.5),
            (i.min() - 0.5, j.max() + 0.5),
        ]
        contours.append(moved(affine, np.array([[*corner, k] for corner in corners], float)))
    return contours


def write_dicom(folder, is_second, date, names, coarser=1.0):
    """A CT series and the structure set drawn on it, each in a folder of its own, as the archive delivers them.

    coarser: than the scans otherwise are. Returns the middle slice and the structure set.
    """
    affine = grids()[0].copy()
    affine[:3, :3] *= coarser
    if is_second:
        affine = REPOSITIONED @ affine
    hu, labels = scan(is_second, affine, tuple(int(np.ceil(size / coarser)) for size in SHAPE))
    study, series, frame = (generate_uid() for _ in range(3))
    place = folder / f"{date}-RTHEADNECK" / "2.000000-CT"
    place.mkdir(parents=True)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    axes = affine[:3, :3] / spacing
    for k, voxels in enumerate(hu):
        file = header(series, CTImageStorage, *voxels.shape)
        file.PatientName, file.PatientID = "Miller^Anna", "4711"
        file.StudyInstanceUID, file.FrameOfReferenceUID = study, frame
        file.StudyDate, file.StudyTime, file.SeriesNumber, file.InstanceNumber = date, "120000", 2, k + 1
        file.ImagePositionPatient = [f"{value:.8f}"[:16] for value in moved(affine, np.array([0.0, 0, k]))]
        file.ImageOrientationPatient = [f"{value:.12f}"[:16] for value in axes[:, :2].T.ravel()]
        file.PixelSpacing = [float(spacing[1]), float(spacing[0])]
        file.RescaleSlope, file.RescaleIntercept = 1, -1024
        file.PixelData = (voxels + 1024).astype("<u2").tobytes()
        file.save_as(place / f"1-{k + 1:03d}.dcm", enforce_file_format=True)
    whole = structure_set({name: contours(labels, affine, number) for name, number in names.items()}, frame)
    whole.StudyInstanceUID, whole.StudyDate, whole.PatientName = study, date, "Miller^Anna"
    reference = item(
        RTReferencedStudySequence=[item(RTReferencedSeriesSequence=[item(SeriesInstanceUID=series)])]
    )
    whole.ReferencedFrameOfReferenceSequence[
        0
    ].RTReferencedStudySequence = reference.RTReferencedStudySequence
    drawn = folder / f"{date}-RTHEADNECK" / "1.000000-Structures"
    drawn.mkdir()
    return place / f"1-{len(hu) // 2:03d}.dcm", saved(whole, drawn / "1-1.dcm")
