"""Damaged files end in a valid value or in one sentence that names the file, whatever byte of them changed."""

import json
import warnings

import numpy as np
import pytest
import SimpleITK as sitk
from damaged_files import FEW, damaged
from hypothesis import given
from hypothesis import strategies as st
from json_values import assert_one_sentence
from pydicom.dataset import Dataset
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume
from PolyPoseLib.io.xray.calibration import read_calibration
from PolyPoseLib.io.xray.read import read_xray

RNG = np.random.default_rng(0)
GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4}

ENDINGS = [".nii", ".nii.gz", ".nrrd", ".mha", ".hdr"]


def outcome(read, path):
    """What reading gives, or None where the file is refused in one sentence that names it.

    Toolkits' warnings, which repeat values of the file, reach nobody.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            return read(path)
    except InputError as error:
        assert_one_sentence(error)
        assert str(error).isprintable() and str(error).encode()
        assert path.name in str(error) or path.stem in str(error)
        return None


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder that the examples of one test write to, one after another."""
    return tmp_path_factory.mktemp("damaged")


def volume(kind) -> Volume:
    """Voxels that could be a CT, on a left-handed grid."""
    voxels = RNG.integers(-1000, 1500, (4, 5, 6)).astype(kind)
    voxels.flat[:2] = -1000, 1500
    affine = np.diag([-2.0, 2.0, 3.0, 1.0])
    affine[:3, 3] = 10, -20, 30
    return Volume(voxels, affine)


@pytest.mark.parametrize("kind", [np.int16, np.float32])
@pytest.mark.parametrize("ending", ENDINGS)
def test_a_damaged_volume_is_a_volume_or_refused(folder, ending, kind):
    path = folder / f"{np.dtype(kind).name}{ending}"
    write_volume(volume(kind), path)
    whole = path.read_bytes()

    @FEW
    @given(damaged(whole))
    def examples(content):
        path.write_bytes(content)
        read = outcome(read_volume, path)
        assert read is None or np.isfinite(read.voxels).all()
        ct = outcome(read_ct, path)
        assert ct is None or (ct.voxels.min() >= -1000 and ct.voxels.dtype == np.float32)

    examples()


@pytest.mark.parametrize("ending", [".seg.nrrd", ".nii"])
def test_a_damaged_segmentation_is_one_or_refused(folder, ending):
    path = folder / f"labels{ending}"
    image = sitk.GetImageFromArray(RNG.integers(0, 3, (4, 5, 6)).astype(np.uint8))
    if ending == ".seg.nrrd":
        for number, name in ((0, "pelvis"), (1, "femur")):
            for field, value in (
                ("ID", name),
                ("Name", name),
                ("LabelValue", str(number + 1)),
                ("Layer", "0"),
            ):
                image.SetMetaData(f"Segment{number}_{field}", value)
    sitk.WriteImage(image, str(path))

    @FEW
    @given(damaged(path.read_bytes()))
    def examples(content):
        path.write_bytes(content)
        read = outcome(read_segmentation, path)
        assert read is None or all(layer.voxels.min() >= 0 for layer in read.layers)

    examples()


def xrays() -> dict[str, Dataset]:
    """One DICOM file of each kind that is read by its own rules."""
    lut = Dataset()
    lut.add_new("LUTDescriptor", "US", [4096, 0, 16])
    lut.add_new("LUTData", "OW", np.arange(4096, dtype="<u2").tobytes())
    shutter = {"ShutterShape": "CIRCULAR", "CenterOfCircularShutter": [12, 16], "RadiusOfCircularShutter": 10}
    angles = {"PositionerPrimaryAngle": 30, "PositionerSecondaryAngle": -10, "PatientOrientation": ["L", "F"]}
    return {
        "XA": dataset(random_pixels(), "XA", PixelPaddingValue=0, **shutter, **angles),
        "XA run": dataset(random_pixels(shape=(3, 24, 32)), "XA"),
        "XA LUT": dataset(random_pixels(), PixelIntensityRelationship="LOG", ModalityLUTSequence=[lut]),
        "DX": dataset(random_pixels(), "DX", PixelSpacing=[0.3, 0.3], FieldOfViewDimensions=[12, 13]),
        "RTIMAGE": dataset(
            random_pixels(), "RTIMAGE", GantryAngle=30, RTImagePosition=[-6, 5], RescaleSlope=2
        ),
    }


@pytest.mark.parametrize("name", xrays())
def test_a_damaged_dicom_xray_is_one_or_refused(folder, name):
    path = save(xrays()[name], folder / "x.dcm")

    @given(
        damaged(path.read_bytes()), st.sampled_from([{}, GEOMETRY, {**GEOMETRY, "intensity": "transmission"}])
    )
    def examples(content, fields):
        path.write_bytes(content)
        xray = outcome(lambda each: read_xray(each, fields=fields), path)
        assert xray is None or np.isfinite(xray.image).all()

    examples()


@pytest.mark.parametrize("ending", [".nii", ".nrrd", ".mha", ".png", ".tif", ".jpg"])
def test_a_damaged_picture_is_one_or_refused(folder, ending):
    path = folder / f"x{ending}"
    sitk.WriteImage(sitk.GetImageFromArray(RNG.integers(0, 255, (20, 24)).astype(np.uint8)), str(path))

    @FEW
    @given(damaged(path.read_bytes()))
    def examples(content):
        path.write_bytes(content)
        xray = outcome(lambda each: read_xray(each, fields=GEOMETRY), path)
        assert xray is None or np.isfinite(xray.image).all()

    examples()


def test_a_damaged_slice_of_a_series_is_read_or_refused(folder):
    ct = folder / "ct"
    ct.mkdir()
    for number in range(3):
        ds = dataset(RNG.integers(0, 2000, (8, 9)).astype(np.int16), "CT", bits=16, known=False)
        ds.SeriesInstanceUID, ds.PixelSpacing, ds.RescaleIntercept, ds.RescaleSlope = (
            "1.2.3",
            [2, 2],
            -1000,
            1,
        )
        ds.ImagePositionPatient, ds.ImageOrientationPatient = [0, 0, 3 * number], [1, 0, 0, 0, 1, 0]
        save(ds, ct / f"{number}.dcm")
    middle = ct / "1.dcm"

    @FEW
    @given(damaged(middle.read_bytes()))
    def examples(content):
        middle.write_bytes(content)
        try:
            read = read_volume(ct)
        except InputError as error:
            assert_one_sentence(error)
            assert str(ct) in str(error)
        else:
            assert np.isfinite(read.voxels).all()

    examples()


CALIBRATIONS = {
    "camera.csv": "400,0,31,0\n0,400,31,0\n0,0,1,700\n",
    "camera.txt": "image size\n64,64\n\ncamera matrix\n400,0,31\n0,400,31\n0,0,1\n\nrotation\n1,0,0\n0,1,0\n0,0,1\n\n"
    "translation\n0\n0\n700\n",
    "camera.json": json.dumps(
        {"projection": [[400, 0, 31, 0], [0, -400, 31, 0], [0, 0, 1, 700]], "rows": "up", "image_size": [64, 64],
         "unit_mm": 10, "distortion": [0.1, 0, 0, 0]}
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CALIBRATIONS)
def test_a_damaged_calibration_is_one_or_refused(folder, name):
    path = folder / name

    @FEW
    @given(damaged(CALIBRATIONS[name].encode()))
    def examples(content):
        path.write_bytes(content)
        found = outcome(read_calibration, path)
        assert found is None or (np.isfinite(found.intrinsics).all() and found.intrinsics[0, 0] > 0)

    examples()
