"""Files that are not what they claim: one sentence each, quickly, and never a patient's name."""

import gzip
import struct
import time
import zlib

import numpy as np
import pytest
import SimpleITK as sitk
from pydicom.uid import DeflatedExplicitVRLittleEndian
from xray_samples import SECRET, dataset, random_pixels, save

from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": [0.4, 0.4]}


def refusal(path, **fields):
    start = time.monotonic()
    with pytest.raises(InputError) as error:
        read_xray(path, fields={**GEOMETRY, **fields})
    text = str(error.value)
    assert time.monotonic() - start < 30
    assert "\n" not in text
    assert path.name in text
    assert text.endswith(".")
    assert SECRET not in text
    assert "Doe" not in text
    assert "SECRET42" not in text
    return text


def test_every_cut_of_a_file_is_refused_or_read_whole(tmp_path):
    whole = save(dataset(), tmp_path / "whole.dcm").read_bytes()
    rng = np.random.default_rng(0)
    for length in (0, 1, 100, 131, 132, 140, 200, *rng.integers(150, len(whole) - 2, 40)):
        path = tmp_path / "cut.dcm"
        path.write_bytes(whole[:length])
        refusal(path)


@pytest.mark.parametrize("ending", [".nii.gz", ".nii", ".nrrd", ".png", ".tif", ".mha"])
def test_every_cut_of_a_plain_file_is_refused(tmp_path, ending):
    path = tmp_path / f"x{ending}"
    sitk.WriteImage(sitk.GetImageFromArray(random_pixels(shape=(64, 64))), path, ending != ".tif")
    whole = path.read_bytes()
    for share in (0, 0.001, 0.3, 0.6):
        path.write_bytes(whole[: int(share * len(whole))])
        try:
            read_xray(path, fields=GEOMETRY)
        except InputError as error:
            assert "\n" not in str(error)
        else:
            # Some decoders fill the missing rows of a picture; a volume format must not.
            assert ending in (".tif", ".png")


def test_random_bytes_in_a_header_never_escape_as_other_errors(tmp_path):
    whole = bytearray(save(dataset(), tmp_path / "whole.dcm").read_bytes())
    rng = np.random.default_rng(1)
    for _ in range(60):
        broken = bytearray(whole)
        for place in rng.integers(132, 800, 6):
            broken[place] = rng.integers(0, 256)
        path = tmp_path / "broken.dcm"
        path.write_bytes(broken)
        try:
            read_xray(path, fields=GEOMETRY)
        except InputError as error:
            assert SECRET not in str(error)


@pytest.mark.parametrize("name", ["x.dcm", "x.nii.gz", "x.nii", "x.nrrd", "x.png", "x.tif", "x.mha", "x.img"])
@pytest.mark.parametrize("content", [b"", b"hello, I am a text\n" * 50, bytes(1000)])
def test_other_files_under_an_images_name_are_refused(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    refusal(path)


def test_a_text_that_begins_with_a_tag_is_refused(tmp_path):
    path = tmp_path / "x.dcm"
    path.write_bytes(b"\x08\x00 this is text, not DICOM" * 100)
    refusal(path)


def test_missing_files_and_folders_are_refused(tmp_path):
    assert "not a file" in refusal(tmp_path / "no.dcm")
    assert "not a file" in refusal(tmp_path)


def test_a_header_without_pixels_is_refused(tmp_path):
    ds = dataset()
    del ds.PixelData
    assert "no pixel data" in refusal(save(ds, tmp_path / "x.dcm"))


def test_other_modalities_are_refused(tmp_path):
    assert "modality CT" in refusal(save(dataset(modality="CT"), tmp_path / "x.dcm"))


@pytest.mark.parametrize("change", [{"Rows": 65535, "Columns": 65535}, {"Rows": 0}, {"Columns": None}])
def test_impossible_sizes_are_refused_before_allocation(tmp_path, change):
    refusal(save(dataset(**change), tmp_path / "x.dcm"))


def test_claims_beyond_the_pixels_are_refused(tmp_path):
    assert "cut short" in refusal(save(dataset(Rows=4000, Columns=4000), tmp_path / "x.dcm"))
    assert "cut short" in refusal(save(dataset(NumberOfFrames=1000), tmp_path / "y.dcm"), frame=3)


def test_a_single_pixel_is_refused(tmp_path):
    assert "1 x 1" in refusal(save(dataset(np.ones((1, 1), np.uint16)), tmp_path / "x.dcm"))
    for ending in (".png", ".nii.gz"):
        sitk.WriteImage(sitk.GetImageFromArray(np.ones((1, 1), np.uint8)), tmp_path / f"x{ending}")
        assert "1 x 1" in refusal(tmp_path / f"x{ending}")


def test_a_constant_image_is_refused(tmp_path):
    for value in (0, 7, 4095):
        assert "constant" in refusal(save(dataset(np.full((20, 20), value, np.uint16)), tmp_path / "x.dcm"))
    sitk.WriteImage(sitk.GetImageFromArray(np.zeros((20, 20), np.float32)), tmp_path / "x.nii.gz")
    assert "constant" in refusal(tmp_path / "x.nii.gz")


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_nan_is_refused(tmp_path, bad):
    pixels = np.ones((20, 20), np.float32)
    pixels[3, 4] = bad
    sitk.WriteImage(sitk.GetImageFromArray(pixels), tmp_path / "x.nii.gz")
    assert "NaN" in refusal(tmp_path / "x.nii.gz")


def test_volumes_and_colours_are_refused(tmp_path):
    sitk.WriteImage(sitk.GetImageFromArray(np.zeros((20, 20, 20), np.float32)), tmp_path / "x.nii.gz")
    assert "two-dimensional" in refusal(tmp_path / "x.nii.gz")
    colour = np.random.default_rng(0).integers(0, 255, (20, 20, 3), dtype=np.uint8)
    sitk.WriteImage(sitk.GetImageFromArray(colour, isVector=True), tmp_path / "x.png")
    assert "colour" in refusal(tmp_path / "x.png")


def test_a_stack_needs_a_frame_that_exists(tmp_path):
    stack = np.random.default_rng(0).random((5, 20, 24)).astype(np.float32)
    path = tmp_path / "x.nii.gz"
    sitk.WriteImage(sitk.GetImageFromArray(stack), path)
    assert '"frame"' in refusal(path)
    assert "0 to 4" in refusal(path, frame=5)
    np.testing.assert_array_equal(read_xray(path, fields={**GEOMETRY, "frame": 3}).image, stack[3])


def nifti_header(shape):
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, len(shape), *shape, *([1] * (7 - len(shape))))
    struct.pack_into("<hh", header, 70, 16, 32)
    struct.pack_into("<8f", header, 76, *([1.0] * 8))
    struct.pack_into("<f", header, 108, 352.0)
    header[344:348] = b"n+1\0"
    return bytes(header)


def test_a_small_file_that_claims_gigabytes_is_refused(tmp_path):
    path = tmp_path / "x.nii.gz"
    path.write_bytes(gzip.compress(nifti_header((32767, 32767)) + bytes(1 << 20)))
    assert "more than an X-ray has" in refusal(path)


def test_a_small_header_before_endless_zeros_costs_nothing(tmp_path):
    path = tmp_path / "x.nii.gz"
    lines = np.random.default_rng(0).random((32, 32)).astype("<f4")
    path.write_bytes(gzip.compress(nifti_header((32, 32)) + lines.tobytes() + bytes(1 << 26), 1))
    start = time.monotonic()
    np.testing.assert_array_equal(read_xray(path, fields=GEOMETRY).image, lines)
    assert time.monotonic() - start < 30


def test_a_deflated_file_that_grows_without_end_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("PolyPoseLib.io.inflation.MAX_INFLATED_BYTES", 1 << 24)
    ds = dataset()
    ds.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    path = save(ds, tmp_path / "x.dcm")
    read_xray(path)
    data = path.read_bytes()
    start = 144 + struct.unpack_from("<I", data, 140)[0]
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    body = b"".join(deflate.compress(bytes(1 << 24)) for _ in range(3)) + deflate.flush()
    path.write_bytes(data[:start] + body)
    assert "grows beyond" in refusal(path)


def test_headers_that_point_to_other_files_are_refused(tmp_path):
    (tmp_path / "secret.raw").write_bytes(bytes(1600))
    mha = "ObjectType = Image\nNDims = 2\nDimSize = 20 20\nElementType = MET_FLOAT\nElementDataFile = secret.raw\n"
    (tmp_path / "x.mha").write_text(mha)
    assert "another file" in refusal(tmp_path / "x.mha")
    nrrd = "NRRD0004\ntype: float\ndimension: 2\nsizes: 20 20\nencoding: raw\nendian: little\ndata file: secret.raw\n\n"
    (tmp_path / "x.nrrd").write_text(nrrd)
    assert "another file" in refusal(tmp_path / "x.nrrd")


def test_nothing_that_is_kept_names_the_patient(tmp_path):
    ds = dataset(PositionerPrimaryAngle=3, PositionerSecondaryAngle=4, BitsStored=12, HighBit=40)
    xray = read_xray(save(ds, tmp_path / "x.dcm"))
    text = " ".join((xray.name, *xray.provenance, *xray.warnings))
    assert "Doe" not in text
    assert "SECRET42" not in text


BIG = 10**400
"""More than float64 holds."""

BROKEN_FIELDS = {
    "source_to_detector_mm": (0, -5, 1.02, "1000", True, float("nan"), [1000]),
    "pixel_spacing_mm": ([0.4], [0.4, 0], [0.4, -1], "0.4", [0.4, float("inf")], [1, 2, 3], {"row": 1}, 400),
    "principal_point_px": ([1], [1, "2"], 5, [1, float("nan")]),
    "extrinsic": (
        [[1, 0], [0, 1]],
        "identity",
        np.diag([1, 1, -1, 1]).tolist(),
        (np.eye(4) * 1.001).tolist(),
        7,
    ),
    "camera": ("sure", 1, True),
    "frame": (-1, 1.5, "0", True),
    "mask": ("", 5),
    "intensity": ("dark", 1),
    "unattenuated": (0, -1, "max"),
    "mirrored": ("yes", 1),
    "isocenter_mm": ([1, 2], [1, 2, None]),
    "source_to_isocenter_mm": (0, "x"),
    "primary_angle_deg": (200, "LAO"),
    "secondary_angle_deg": (100, None, []),
    "patient_position": ("supine", 3),
    "intrinsics": ("K", [[1, 0, 0]], np.zeros((3, 3)).tolist()),
    "name": (5,),
}


NUMBERS = {
    "source_to_detector_mm": lambda n: n,
    "source_to_isocenter_mm": lambda n: n,
    "unattenuated": lambda n: n,
    "primary_angle_deg": lambda n: n,
    "pixel_spacing_mm": lambda n: [0.4, n],
    "principal_point_px": lambda n: [n, 10],
    "isocenter_mm": lambda n: [1, n, 1],
    "extrinsic": lambda n: [[1, 0, 0, n], [0, 1, 0, 0], [0, 0, 1, 700], [0, 0, 0, 1]],
    "intrinsics": lambda n: [[400, 0, n], [0, 400, 31], [0, 0, 1]],
    "landmarks": lambda n: [{"point": [1, 2, n], "pixel": [3, 4]}],
}


@pytest.mark.parametrize("field", NUMBERS)
@pytest.mark.parametrize(
    "value",
    [BIG, -BIG, 10**5000, True, "3", float("nan"), [1]],
    ids=["big", "-big", "bigger", "true", "text", "nan", "list"],
)
def test_what_is_no_number_is_named_wherever_it_stands(tmp_path, field, value):
    message = refusal(save(dataset(), tmp_path / "x.dcm"), **{field: NUMBERS[field](value)})
    assert f'"{field}"' in message and len(message) < 400


@pytest.mark.parametrize("field", BROKEN_FIELDS)
def test_a_field_that_breaks_its_rule_is_named(tmp_path, field):
    path = save(dataset(), tmp_path / "x.dcm")
    for value in BROKEN_FIELDS[field]:
        if value is None:
            continue
        assert f'"{field}"' in refusal(path, **{field: value})


def test_a_nearly_rigid_extrinsic_is_mended(tmp_path):
    extrinsic = np.eye(4)
    extrinsic[0, 0] = 1.00004
    xray = read_xray(save(dataset(), tmp_path / "x.dcm"), fields={"extrinsic": extrinsic.tolist()})
    rotation = xray.extrinsic[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


def test_an_xray_that_exists_is_valid():
    good = dict(
        image=np.zeros((20, 20)),
        mask=np.ones((20, 20), bool),
        intrinsics=np.diag([1000.0, 1000, 1]),
        extrinsic=None,
        camera="absent",
        pixel_spacing_mm=(0.4, 0.4),
        source_to_detector_mm=1000,
    )
    Xray(**good)
    for bad in (
        {"image": np.zeros((20, 20, 1))},
        {"image": np.full((20, 20), np.nan)},
        {"mask": np.zeros((20, 20), bool)},
        {"mask": np.ones((20, 21), bool)},
        {"camera": "known"},
        {"camera": "lost"},
        {"extrinsic": np.eye(4)},
        {"intrinsics": np.zeros((3, 3))},
    ):
        with pytest.raises(InputError):
            Xray(**{**good, **bad})


def test_pydicoms_own_warnings_about_a_patient_stay_silent(tmp_path, caplog, recwarn):
    path = save(dataset(), tmp_path / "x.dcm")
    data = path.read_bytes().replace(b"SECRET42", b"SECRET\x07\x07")
    path.write_bytes(data.replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.1.2,1\0"))
    with caplog.at_level("DEBUG"), pytest.raises(InputError):
        read_xray(path)
    path.write_bytes(data)
    with caplog.at_level("DEBUG"):
        read_xray(path)
    assert "SECRET" not in caplog.text
    assert not [warning for warning in recwarn if "pydicom" in str(warning.filename)]
