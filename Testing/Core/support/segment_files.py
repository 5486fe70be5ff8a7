"""DICOM segmentations and structure sets of a few voxels, written attribute by attribute."""

from pathlib import Path

import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian, generate_uid

SEG, LABEL_MAP = "1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7"
STRUCTURE_SET = "1.2.840.10008.5.1.4.1.1.481.3"


def item(**values) -> Dataset:
    found = Dataset()
    for name, value in values.items():
        setattr(found, name, value)
    return found


def text(numbers) -> list[str]:
    """Numbers as DICOM has them, at most 16 characters each."""
    return [f"{float(each):.9f}"[:16].rstrip(".") for each in np.ravel(numbers)]


def _object(kind: str, modality: str, frame: str) -> Dataset:
    whole = item(
        SOPClassUID=kind, SOPInstanceUID=generate_uid(), Modality=modality, PatientName="Nobody^Nowhere"
    )
    whole.file_meta = FileMetaDataset()
    whole.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    whole.file_meta.MediaStorageSOPClassUID, whole.file_meta.MediaStorageSOPInstanceUID = (
        kind,
        whole.SOPInstanceUID,
    )
    whole.FrameOfReferenceUID, whole.StudyInstanceUID, whole.SeriesInstanceUID = (
        frame,
        generate_uid(),
        generate_uid(),
    )
    return whole


def _place(affine, k) -> dict:
    at = affine @ [0, 0, k, 1]
    return {"PlanePositionSequence": Sequence([item(ImagePositionPatient=text(at[:3]))])}


def seg_dataset(masks: dict[str, np.ndarray], affine, kind="BINARY", frame="1.2.3", **tags) -> Dataset:
    """A DICOM SEG; masks {name: (k, j, i) bool}, without their empty planes, in an arbitrary order."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    axes = affine[:3, :3] / spacing
    whole = _object(LABEL_MAP if kind == "LABELMAP" else SEG, "SEG", frame)
    whole.SegmentationType, whole.SamplesPerPixel, whole.PixelRepresentation = kind, 1, 0
    whole.Rows, whole.Columns = next(iter(masks.values())).shape[1:]
    bits = 1 if kind == "BINARY" else 8
    whole.BitsAllocated, whole.BitsStored, whole.HighBit = bits, bits, bits - 1
    whole.PhotometricInterpretation = "MONOCHROME2"
    whole.SegmentSequence = Sequence(
        [item(SegmentNumber=n + 1, SegmentLabel=name) for n, name in enumerate(masks)]
    )
    turn = item(ImageOrientationPatient=text(axes[:, :2].T))
    pitch = item(PixelSpacing=text(spacing[[1, 0]]), SpacingBetweenSlices=text(spacing[2])[0])
    shared = item(PlaneOrientationSequence=Sequence([turn]), PixelMeasuresSequence=Sequence([pitch]))
    whole.SharedFunctionalGroupsSequence = Sequence([shared])
    if kind == "LABELMAP":
        labels = np.zeros(next(iter(masks.values())).shape, np.uint8)
        for n, mask in enumerate(masks.values()):
            labels[mask] = n + 1
        frames = [(0, k, labels[k]) for k in range(len(labels)) if labels[k].any()]
    else:
        frames = [
            (n + 1, k, plane)
            for n, mask in enumerate(masks.values())
            for k, plane in enumerate(mask)
            if plane.any()
        ]
    frames = [frames[n] for n in np.random.default_rng(0).permutation(len(frames))]
    groups = []
    for number, k, _ in frames:
        group = item(**_place(affine, k))
        if number:
            group.SegmentIdentificationSequence = Sequence([item(ReferencedSegmentNumber=number)])
        groups.append(group)
    whole.PerFrameFunctionalGroupsSequence, whole.NumberOfFrames = Sequence(groups), len(frames)
    pixels = np.stack([plane for *_, plane in frames])
    if kind == "BINARY":
        pixels = np.packbits(pixels.ravel(), bitorder="little")
    if kind == "FRACTIONAL":
        whole.MaximumFractionalValue, whole.SegmentationFractionalType = 200, "OCCUPANCY"
        pixels = np.where(pixels, 100, 99)
    content = pixels.astype(np.uint8).tobytes()
    whole.PixelData = content + b"\0" * (len(content) % 2)
    whole["PixelData"].VR = "OB"
    for tag, value in tags.items():
        setattr(whole, tag, value)
    return whole


def structure_set(rois: dict[str, list], frame="1.2.3", kind="CLOSED_PLANAR") -> Dataset:
    """An RT structure set; rois {name: contours (N, 3) LPS mm}."""
    whole = _object(STRUCTURE_SET, "RTSTRUCT", frame)
    del whole.FrameOfReferenceUID
    whole.ReferencedFrameOfReferenceSequence = Sequence([item(FrameOfReferenceUID=frame)])
    listed, drawn = [], []
    for number, (name, contours) in enumerate(rois.items(), start=7):
        listed.append(item(ROINumber=number, ROIName=name, ReferencedFrameOfReferenceUID=frame))
        sequence = [
            item(ContourGeometricType=kind, NumberOfContourPoints=len(each), ContourData=text(each))
            for each in contours
        ]
        drawn.append(item(ReferencedROINumber=number, ContourSequence=Sequence(sequence)))
    whole.StructureSetROISequence, whole.ROIContourSequence = Sequence(listed), Sequence(drawn)
    return whole


def saved(whole: Dataset, path: Path) -> Path:
    whole.save_as(path, enforce_file_format=True)
    return path


def random_affine(rng: np.random.Generator, spacing=(0.9, 1.3, 2.1), oblique=True) -> np.ndarray:
    """A grid of any direction and handedness, or along the axes of the patient in any order."""
    directions = np.linalg.qr(rng.normal(size=(3, 3)))[0] if oblique else np.eye(3)[rng.permutation(3)]
    affine = np.eye(4)
    affine[:3, :3] = directions * rng.choice([-1, 1], 3) * spacing
    affine[:3, 3] = rng.uniform(-200, 200, 3)
    return affine
