"""Targets: X-rays and what is known of their cameras."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from fuzz_subject import Subject, whole_file
from PIL import Image
from pydicom.dataset import Dataset
from pydicom.uid import DeflatedExplicitVRLittleEndian, RLELossless
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.io.json_records import parse_object
from PolyPoseLib.io.tracking.image_run import open_run
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.landmarks import parse_landmarks
from PolyPoseLib.io.xray.read import read_xray

GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4}


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
        whole_file(save(ds, folder / f"{name}.dcm"), lambda path: read_xray(path, fields=GEOMETRY))
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
    return [whole_file(path, lambda each: read_xray(each, fields=GEOMETRY)) for path in paths]


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
    return [whole_file(folder / name, read_calibration) for name in texts]


def landmarks(folder: Path) -> list[Subject]:
    path = folder / "landmarks.json"
    pairs = [{"point": [1.5, 2, 3], "pixel": [4, 5.5], "name": f"p{n}"} for n in range(4)]
    path.write_text(json.dumps({"landmarks": pairs}))

    def read(path: Path) -> Any:
        text = path.read_bytes().decode("utf-8", "replace")
        fields = parse_object(text, str(path))
        return parse_landmarks(fields.get("landmarks"), f'{path}: "landmarks"')

    return [whole_file(path, read)]


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

    return [whole_file(path, read) for path in paths]
