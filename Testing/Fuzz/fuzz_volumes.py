"""Targets: volumes and label maps."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from fuzz_subject import Subject, whole_file
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import DeflatedExplicitVRLittleEndian, RLELossless
from segment_files import saved, seg_dataset, structure_set
from xray_samples import dataset, save

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume


def _volume(kind: type = np.int16) -> Volume:
    voxels = np.random.default_rng(0).integers(-1000, 1500, (4, 5, 6)).astype(kind)
    affine = np.diag([-2.0, 2.0, 3.0, 1.0])
    affine[:3, 3] = 10, -20, 30
    return Volume(voxels, affine)


def _volumes(folder: Path, endings: tuple[str, ...]) -> list[Subject]:
    subjects = []
    for ending in endings:
        for kind in (np.int16, np.float32):
            path = folder / f"{np.dtype(kind).name}{ending}"
            write_volume(_volume(kind), path)
            subjects.append(whole_file(path, read_ct))
            sitk.WriteImage(_volume(kind).to_sitk(), str(path), False)
            subjects.append(whole_file(path, read_volume))
    return subjects


def nrrd(folder: Path) -> list[Subject]:
    image = sitk.GetImageFromArray(np.random.default_rng(0).integers(0, 3, (4, 5, 6)).astype(np.uint8))
    for number, name in enumerate(("pelvis", "femur")):
        values = {"ID": name, "Name": name, "LabelValue": str(number + 1), "Layer": "0"}
        for field, value in values.items():
            image.SetMetaData(f"Segment{number}_{field}", value)
    path = folder / "labels.seg.nrrd"
    sitk.WriteImage(image, str(path), False)
    header = folder / "ct.nhdr"
    write_volume(_volume(), header)
    return [
        *_volumes(folder, (".nrrd",)),
        whole_file(path, read_segmentation),
        whole_file(path, lambda each: read_segmentation(each).segments),
        whole_file(header, read_volume),
    ]


def metaimage(folder: Path) -> list[Subject]:
    header = folder / "ct.mhd"
    write_volume(_volume(), header)
    parts = folder / "parts.mhd"
    for number in range(3):
        (folder / f"part{number}.raw").write_bytes(bytes(range(60)))
    fields = "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 2 2 2\nDimSize = 5 6 3\n"
    fields += "ElementType = MET_SHORT\nElementDataFile = "
    parts.write_text(fields + "part%d.raw 0 2 1\n")
    listed = folder / "listed.mhd"
    listed.write_text(fields + "LIST\npart0.raw\npart1.raw\npart2.raw\n")
    return [
        *_volumes(folder, (".mha",)),
        *(whole_file(path, read_volume) for path in (header, parts, listed)),
    ]


def nifti(folder: Path) -> list[Subject]:
    subjects = _volumes(folder, (".nii", ".hdr"))
    packed = folder / "ct.nii.gz"
    write_volume(_volume(), packed)
    subjects.append(whole_file(packed, read_ct))
    subjects.append(
        Subject(packed, gzip.decompress(packed.read_bytes()), lambda: read_ct(packed), gzip.compress)
    )
    return subjects


def _slice(number: int, compressed: str = "") -> Dataset:
    pixels = np.random.default_rng(number).integers(0, 2000, (16, 18)).astype(np.int16)
    ds = dataset(pixels, "CT", bits=16, known=False)
    ds.SeriesInstanceUID, ds.PixelSpacing, ds.RescaleIntercept, ds.RescaleSlope = "1.2.3", [2, 2], -1000, 1
    ds.ImagePositionPatient, ds.ImageOrientationPatient = [0, 0, 3 * number], [1, 0, 0, 0, 1, 0]
    if compressed == "rle":
        ds.compress(RLELossless, generate_instance_uid=False)
    if compressed == "deflated":
        ds.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    return ds


def _enhanced() -> Dataset:
    pixels = np.random.default_rng(0).integers(0, 2000, (3, 8, 9)).astype(np.int16)
    ds = dataset(pixels, "CT", bits=16, known=False)
    ds.SOPClassUID, ds.SeriesInstanceUID = "1.2.840.10008.5.1.4.1.1.2.1", "1.2.3"
    groups = []
    for number in range(3):
        place, turn, pitch, rescale, group = (Dataset() for _ in range(5))
        place.ImagePositionPatient, turn.ImageOrientationPatient = [0, 0, 3 * number], [1, 0, 0, 0, 1, 0]
        pitch.PixelSpacing, rescale.RescaleIntercept, rescale.RescaleSlope = [2, 2], -1000, 1
        group.PlanePositionSequence, group.PlaneOrientationSequence = Sequence([place]), Sequence([turn])
        group.PixelMeasuresSequence = Sequence([pitch])
        group.PixelValueTransformationSequence = Sequence([rescale])
        groups.append(group)
    ds.PerFrameFunctionalGroupsSequence = Sequence(groups)
    return ds


def dicom_ct(folder: Path) -> list[Subject]:
    subjects = []
    for kind in ("plain", "rle", "deflated"):
        ct = folder / kind
        ct.mkdir()
        for number in range(3):
            save(_slice(number, kind), ct / f"{number}.dcm")
        whole = (ct / "1.dcm").read_bytes()
        subjects.append(Subject(ct / "1.dcm", whole, lambda ct=ct: read_ct(ct)))
        inner = _inflated(whole) if kind == "deflated" else None
        if inner:
            subjects.append(
                Subject(
                    ct / "1.dcm",
                    inner[1],
                    lambda ct=ct: read_ct(ct),
                    lambda body, head=inner[0]: head + _deflate(body),
                )
            )
    return [*subjects, whole_file(save(_enhanced(), folder / "enhanced.dcm"), read_ct)]


def _inflated(whole: bytes) -> tuple[bytes, bytes]:
    """The part before a deflated dataset, and the dataset."""
    import zlib

    start = 144 + int.from_bytes(whole[140:144], "little")
    return whole[:start], zlib.decompress(whole[start:], -zlib.MAX_WBITS)


def _deflate(body: bytes) -> bytes:
    import zlib

    deflate = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    return deflate.compress(body) + deflate.flush()


def dicom_segments(folder: Path) -> list[Subject]:
    labels = np.random.default_rng(0).integers(0, 3, (4, 5, 6))
    masks = {"pelvis": labels == 1, "femur": labels == 2}
    affine = np.diag([1.0, 2.0, 3.0, 1.0])
    kinds = ("BINARY", "FRACTIONAL", "LABELMAP")
    paths = [saved(seg_dataset(masks, affine, kind), folder / f"{kind}.dcm") for kind in kinds]
    square = np.array([[0.5, 0.5, 0], [4.5, 0.5, 0], [4.5, 6.5, 0], [0.5, 6.5, 0]])
    contours = {"pelvis": [np.add(square, [0, 0, 3 * k]) for k in range(3)], "femur": [square / 2]}
    drawn = saved(structure_set(contours), folder / "rs.dcm")
    ct = Volume(np.zeros((4, 5, 6), np.int16), affine)
    return [
        *(whole_file(path, read_segmentation) for path in (*paths, drawn)),
        whole_file(drawn, lambda path: read_segmentation(path, ct)),
    ]
