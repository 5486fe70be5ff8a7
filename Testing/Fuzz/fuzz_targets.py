"""What is fuzzed: for every reader the sound files that are changed, and the call that reads them."""

from __future__ import annotations

import gzip
import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from joint_case import random_rigid, sequence_of, track_of
from PIL import Image
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import DeflatedExplicitVRLittleEndian, RLELossless
from result_case import make_result
from segment_files import saved, seg_dataset, structure_set
from track_case import make_track, write_sequence
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.data.cohort.outcome import FileStamp, Outcome
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.io.camera_models import load_model, read_tensors, write_tensors
from PolyPoseLib.io.cohort.entries import read_entries
from PolyPoseLib.io.cohort.outcome_files import read_outcome, write_outcome
from PolyPoseLib.io.json_records import parse_object
from PolyPoseLib.io.results import load_result
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.tracking.checkpoint import opened_checkpoint
from PolyPoseLib.io.tracking.image_run import open_run
from PolyPoseLib.io.tracking.joint_curves import load_joint_curves
from PolyPoseLib.io.tracking.joint_tables import write_joint_tables
from PolyPoseLib.io.tracking.sequences import load_sequence
from PolyPoseLib.io.tracking.tracks import load_track, save_track
from PolyPoseLib.io.transforms import read_transform
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.landmarks import parse_landmarks
from PolyPoseLib.io.xray.read import read_xray
from PolyPoseLib.kinematics.joint_motions import joint_motions

GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4}


@dataclass(frozen=True)
class Subject:
    """One file that is changed.

    path: where the changed bytes go; whole: the bytes that are changed; read: the call that reads what they are in;
    packed: makes the file of the changed bytes, where a checksum or compression would hide the change.
    """

    path: Path
    whole: bytes
    read: Callable[[], Any]
    packed: Callable[[bytes], bytes] = bytes


def _subject(path: Path, read: Callable[[Path], Any]) -> Subject:
    """A file that exists and is read by itself."""
    return Subject(path, path.read_bytes(), lambda: read(path))


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
            subjects.append(_subject(path, read_ct))
            sitk.WriteImage(_volume(kind).to_sitk(), str(path), False)
            subjects.append(_subject(path, read_volume))
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
        _subject(path, read_segmentation),
        _subject(path, lambda each: read_segmentation(each).segments),
        _subject(header, read_volume),
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
        *(_subject(path, read_volume) for path in (header, parts, listed)),
    ]


def nifti(folder: Path) -> list[Subject]:
    subjects = _volumes(folder, (".nii", ".hdr"))
    packed = folder / "ct.nii.gz"
    write_volume(_volume(), packed)
    subjects.append(_subject(packed, read_ct))
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
    return [*subjects, _subject(save(_enhanced(), folder / "enhanced.dcm"), read_ct)]


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
        *(_subject(path, read_segmentation) for path in (*paths, drawn)),
        _subject(drawn, lambda path: read_segmentation(path, ct)),
    ]


def dicom_xray(folder: Path) -> list[Subject]:
    lut = Dataset()
    lut.add_new("LUTDescriptor", "US", [4096, 0, 16])
    lut.add_new("LUTData", "OW", np.arange(4096, dtype="<u2").tobytes())
    shutter = {"ShutterShape": "CIRCULAR", "CenterOfCircularShutter": [12, 16], "RadiusOfCircularShutter": 10}
    angles = {"PositionerPrimaryAngle": 30, "PositionerSecondaryAngle": -10, "PatientOrientation": ["L", "F"]}
    rle = dataset(random_pixels(), "XA", **angles)
    rle.compress(RLELossless, generate_instance_uid=False)
    deflated = dataset(random_pixels(), "XA", **angles)
    deflated.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    kinds = {
        "xa": dataset(random_pixels(), "XA", PixelPaddingValue=0, **shutter, **angles),
        "run": dataset(random_pixels(shape=(3, 24, 32)), "XA"),
        "lut": dataset(random_pixels(), PixelIntensityRelationship="LOG", ModalityLUTSequence=[lut]),
        "dx": dataset(random_pixels(), "DX", PixelSpacing=[0.3, 0.3], FieldOfViewDimensions=[12, 13]),
        "rt": dataset(random_pixels(), "RTIMAGE", GantryAngle=30, RTImagePosition=[-6, 5], RescaleSlope=2),
        "rle": rle,
        "deflated": deflated,
    }
    return [
        _subject(save(ds, folder / f"{name}.dcm"), lambda path: read_xray(path, fields=GEOMETRY))
        for name, ds in kinds.items()
    ]


def picture(folder: Path) -> list[Subject]:
    gray = np.random.default_rng(0).integers(0, 255, (20, 24)).astype(np.uint8)
    deep = gray.astype(np.uint16) * 200
    paths = []
    for ending in (".png", ".tif", ".jpg", ".nii", ".nrrd", ".mha"):
        paths.append(folder / f"x{ending}")
        sitk.WriteImage(sitk.GetImageFromArray(gray), str(paths[-1]))
    for ending in (".png", ".tif"):
        paths.append(folder / f"deep{ending}")
        sitk.WriteImage(sitk.GetImageFromArray(deep), str(paths[-1]))
    for kind in ("tiff_lzw", "packbits", "tiff_deflate", "jpeg", "group4"):
        paths.append(folder / f"{kind}.tif")
        image = Image.fromarray(gray if kind != "group4" else gray > 128)
        image.save(paths[-1], compression=kind)
    return [_subject(path, lambda each: read_xray(each, fields=GEOMETRY)) for path in paths]


def calibration(folder: Path) -> list[Subject]:
    camera = {"projection": [[400, 0, 31, 0], [0, -400, 31, 0], [0, 0, 1, 700]], "rows": "up", "image_size": [64, 64],
              "unit_mm": 10, "distortion": [0.1, 0, 0, 0]}  # fmt: skip
    texts = {
        "camera.csv": "400,0,31,0\n0,400,31,0\n0,0,1,700\n",
        "camera.txt": "image size\n64,64\n\ncamera matrix\n400,0,31\n0,400,31\n0,0,1\n\n"
        "rotation\n1,0,0\n0,1,0\n0,0,1\n\ntranslation\n0\n0\n700\n",
        "camera.json": json.dumps(camera),
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    return [_subject(folder / name, read_calibration) for name in texts]


def landmarks(folder: Path) -> list[Subject]:
    path = folder / "landmarks.json"
    pairs = [{"point": [1.5, 2, 3], "pixel": [4, 5.5], "name": f"p{n}"} for n in range(4)]
    path.write_text(json.dumps({"landmarks": pairs}))

    def read(path: Path) -> Any:
        text = path.read_bytes().decode("utf-8", "replace")
        fields = parse_object(text, str(path))
        return parse_landmarks(fields.get("landmarks"), f'{path}: "landmarks"')

    return [_subject(path, read)]


def study(folder: Path) -> list[Subject]:
    rng = np.random.default_rng(0)
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    labels = np.zeros((10, 11, 12), np.uint8)
    labels[:4], labels[4:6], labels[6:9] = 1, 2, 3
    write_volume(
        Volume(rng.integers(-1000, 1500, labels.shape).astype(np.int16), affine), folder / "ct.nii.gz"
    )
    write_volume(Volume(labels, affine), folder / "labels.nii.gz")
    for name in ("ap", "oblique"):
        image = sitk.GetImageFromArray(rng.random((40, 50)).astype(np.float32))
        sitk.WriteImage(image, str(folder / f"{name}.nii.gz"))
    rigid = [[1, 0, 0, 0], [0, 0, -1, 5], [0, 1, 0, 800], [0, 0, 0, 1]]
    view = {"image": "ap.nii.gz", **GEOMETRY, "extrinsic": rigid}
    fields = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz",
        "structures": {"pelvis": [1, 2], "femur_left": [3]}, "anchor": "pelvis",
        "xrays": [view, {**view, "image": "oblique.nii.gz", "camera": "known"}],
        "options": {"preset": "fast", "device": "cpu"},
    }  # fmt: skip
    path = folder / "study.json"
    path.write_text(json.dumps(fields, indent=1))
    return [_subject(path, Study.load)]


def result(folder: Path) -> list[Subject]:
    saved = make_result().save(folder / "result")
    path = saved / "result.json"
    return [Subject(path, path.read_bytes(), lambda: load_result(saved))]


def transform(folder: Path) -> list[Subject]:
    saved = make_result().save(folder / "result")
    return [_subject(saved / "transform.h5", read_transform)]


def camera_model(folder: Path) -> list[Subject]:
    import torch

    path = folder / "model.pt"
    fields = {"format": "polypose camera model", "version": 1, "digest": "0", "state": {"a": torch.ones(3)}}
    write_tensors(fields, path)
    with zipfile.ZipFile(path) as archive:
        inside = {name: archive.read(name) for name in archive.namelist()}
    pickled = next(name for name in inside if name.endswith("data.pkl"))

    def packed(changed: bytes) -> bytes:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            for name, content in inside.items():
                archive.writestr(name, changed if name == pickled else content)
        return stream.getvalue()

    return [
        _subject(path, load_model),
        Subject(path, inside[pickled], lambda: read_tensors(path, "camera model"), packed),
    ]


def sequence(folder: Path) -> list[Subject]:
    pose = [[1, 0, 0, 3], [0, 0, -1, 5], [0, 1, 0, 8], [0, 0, 0, 1]]
    more = {
        "still": ["tibia"],
        "initial_poses": {"talus": pose},
        "landmarks": {"tibia.medial_plateau": [1, 2, 3]},
        "joints": [{"name": "ankle", "proximal": "tibia", "distal": "talus", "side": "left"}],
    }
    path = write_sequence(folder / "walk", **more, options={"first": 1, "last": 3, "smooth": True})
    return [_subject(path, load_sequence)]


def image_run(folder: Path) -> list[Subject]:
    """Runs of several images, of which all are read."""
    stack = random_pixels(3, (4, 24, 32))
    pages = [Image.fromarray(page) for page in stack]
    paths = []
    for name, settings in (
        ("plain", {}),
        ("big", {"big_tiff": True}),
        ("packed", {"compression": "tiff_lzw"}),
    ):
        paths.append(folder / f"{name}.tif")
        pages[0].save(paths[-1], save_all=True, append_images=pages[1:], **settings)
    ds = dataset(stack, "XA")
    paths.append(save(ds, folder / "run.dcm"))
    ds.compress(RLELossless, generate_instance_uid=False)
    paths.append(save(ds, folder / "rle.dcm"))

    def read(path: Path) -> Any:
        run = open_run(path, path.name)
        return [run.values(number, XrayFields()) for number in range(min(run.count, 8))]

    return [_subject(path, read) for path in paths]


def track(folder: Path) -> list[Subject]:
    saved = save_track(make_track(frames=3), folder / "track")
    path = saved / "track.json"
    checkpoint = folder / "walk.partial"
    with opened_checkpoint(checkpoint, "0" * 64, ("tibia", "talus"), resume=False) as begun:
        for frame in make_track(frames=3).frames:
            begun.keep(frame)

    def resume(path: Path) -> Any:
        with opened_checkpoint(path, "0" * 64, ("tibia", "talus"), resume=True) as begun:
            return begun.done

    return [Subject(path, path.read_bytes(), lambda: load_track(saved)), _subject(checkpoint, resume)]


def joint_curves(folder: Path) -> list[Subject]:
    rng = np.random.default_rng(0)
    poses = [[random_rigid(rng), random_rigid(rng)] for _ in range(3)]
    sequence = sequence_of([Joint("knee", "upper", "lower", "grood_suntay", "left")])
    found = track_of(sequence, poses, np.eye(6) * 1e-4)
    write_joint_tables(found, joint_motions(found, sequence), folder)
    path = folder / "joints.json"
    return [Subject(path, path.read_bytes(), lambda: load_joint_curves(folder))]


def cohort(folder: Path) -> list[Subject]:
    listed = folder / "list.csv"
    listed.write_text('id,site,study\na-1,"Bonn, Rhein",one/study.json\nb.2,,two/study.json\n')
    (folder / "outcomes").mkdir()
    write_outcome(folder, Outcome("a", 3, "why", "0" * 64, "studies/a", stamps={"0f": FileStamp(1, 2, "ab")}))
    data_set = folder / "set"
    (data_set / "sub-01").mkdir(parents=True)
    (data_set / "sub-01/sub-01_study.json").write_text("{}")
    description = data_set / "dataset_description.json"
    description.write_text(json.dumps({"Name": "a", "BIDSVersion": "1.10.0"}))
    outcome = folder / "outcomes/a.json"
    return [
        _subject(listed, lambda path: read_entries(path, False)),
        Subject(outcome, outcome.read_bytes(), lambda: read_outcome(folder, "a")),
        Subject(description, description.read_bytes(), lambda: read_entries(data_set, False)),
    ]


TARGETS: dict[str, Callable[[Path], list[Subject]]] = {
    each.__name__: each
    for each in (
        nrrd, metaimage, nifti, dicom_ct, dicom_segments,
        dicom_xray, picture, calibration, landmarks, study, result, transform,
        camera_model, sequence, image_run, track, joint_curves, cohort,
    )
}  # fmt: skip
"""Every target: makes its sound files in a folder, and says how they are read."""
