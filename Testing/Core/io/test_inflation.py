"""Compressed files grow to no more than an image can be, whatever their headers say, and damaged slices are named."""

import io
import struct
import zipfile
import zlib

import numpy as np
import pydicom
import pytest
from pydicom.encaps import encapsulate
from pydicom.uid import DeflatedExplicitVRLittleEndian, JPEGBaseline8Bit, RLELossless
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.errors import InputError
from PolyPoseLib.io import inflation
from PolyPoseLib.io.camera_models import read_tensors
from PolyPoseLib.io.inflation import codestream_size, inflates_beyond
from PolyPoseLib.io.volumes import read_ct
from PolyPoseLib.io.xray.read import read_xray


def ct_slice(number, syntax=None):
    pixels = np.random.default_rng(number).integers(0, 2000, (16, 18)).astype(np.int16)
    ds = dataset(pixels, "CT", bits=16, known=False)
    ds.SeriesInstanceUID, ds.PixelSpacing, ds.RescaleIntercept, ds.RescaleSlope = "1.2.3", [2, 2], -1000, 1
    ds.ImagePositionPatient, ds.ImageOrientationPatient = [0, 0, 3 * number], [1, 0, 0, 0, 1, 0]
    if syntax == RLELossless:
        ds.compress(RLELossless, generate_instance_uid=False)
    elif syntax:
        ds.file_meta.TransferSyntaxUID = syntax
    return ds


def ct_folder(folder, syntax=None, name="{}.dcm"):
    folder.mkdir()
    for number in range(6):
        save(ct_slice(number, syntax), folder / name.format(number))
    return folder


def refusal(read, *arguments, **options) -> str:
    with pytest.raises(InputError) as error:
        read(*arguments, **options)
    assert str(error.value).isprintable()
    return str(error.value)


def bomb(path, preamble=True, group_length=None):
    """The deflated file with a dataset of 64 MiB of zeros, its frame being kept."""
    content = bytearray(path.read_bytes())
    start = 144 + struct.unpack_from("<I", content, 140)[0]
    if group_length is not None:
        struct.pack_into("<I", content, 140, group_length)
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    body = b"".join(deflate.compress(bytes(1 << 24)) for _ in range(4)) + deflate.flush()
    path.write_bytes(bytes(content[0 if preamble else 132 : start]) + body)


@pytest.fixture
def low_limit(monkeypatch):
    monkeypatch.setattr(inflation, "MAX_INFLATED_BYTES", 1 << 25)


@pytest.mark.parametrize("how", [{}, {"preamble": False}, {"group_length": 0}, {"group_length": 10**6}])
def test_no_deflated_file_grows_without_end(tmp_path, low_limit, how):
    xray = dataset(random_pixels())
    xray.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    path = save(xray, tmp_path / "x.dcm")
    read_xray(path)
    bomb(path, **how)
    assert "grows beyond 32 MiB" in refusal(read_xray, path)
    ct = ct_folder(tmp_path / "ct", DeflatedExplicitVRLittleEndian)
    assert read_ct(ct).shape == (6, 16, 18)
    bomb(ct / "3.dcm", **how)
    text = refusal(read_ct, ct)
    assert "3.dcm" in text and ("grows beyond 32 MiB" in text or how == {"preamble": False})


def test_inflation_stops_at_the_limit():
    content = zlib.compress(bytes(1 << 24), 9, wbits=-15)
    assert inflates_beyond(content, (1 << 24) - 1) and not inflates_beyond(content, 1 << 24)
    assert not inflates_beyond(b"no deflate" * 100, 10)


@pytest.mark.parametrize(
    "syntax", [None, RLELossless, DeflatedExplicitVRLittleEndian], ids=["plain", "rle", "deflated"]
)
def test_every_cut_of_a_slice_is_refused_and_named(tmp_path, syntax):
    ct = ct_folder(tmp_path / "ct", syntax)
    for number in (5, 2):
        whole = (ct / f"{number}.dcm").read_bytes()
        for length in {
            0,
            1,
            100,
            131,
            140,
            200,
            300,
            420,
            len(whole) // 2,
            len(whole) * 3 // 4,
            len(whole) - 40,
        }:
            (ct / f"{number}.dcm").write_bytes(whole[:length])
            assert f"{number}.dcm" in refusal(read_ct, ct), length
        (ct / f"{number}.dcm").write_bytes(whole)


def test_slices_are_known_by_the_form_of_their_names(tmp_path):
    ct = ct_folder(tmp_path / "ct", name="IM{:04}")
    for content in (b"", b"\0" * 5000):
        (ct / "IM0003").write_bytes(content)
        assert "IM0003" in refusal(read_ct, ct)


def test_what_is_no_slice_may_lie_beside_them(tmp_path):
    ct = ct_folder(tmp_path / "ct")
    (ct / "README").write_text("about the series")
    (ct / "empty").write_bytes(b"")
    (ct / "preview.jpg").write_bytes(b"\xff\xd8\xff\xe0")
    for number, kind in enumerate(
        ("1.2.840.10008.5.1.4.1.1.481.3", "1.2.840.10008.1.3.10", "1.2.840.10008.5.1.4.1.1.88.11")
    ):
        other = ct_slice(0)
        other.file_meta.MediaStorageSOPClassUID = other.SOPClassUID = kind
        for field in ("Rows", "Columns", "PixelData"):
            delattr(other, field)
        save(other, ct / ("DICOMDIR", "structures.dcm", "report.dcm")[number])
    assert read_ct(ct).shape == (6, 16, 18)


def jpeg(rows, columns) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (rows, columns)).astype(np.uint8)).save(
        stream, "JPEG"
    )
    return stream.getvalue()


def test_a_compressed_frame_is_as_large_as_its_header_says(tmp_path):
    assert codestream_size(jpeg(40, 30)) == (40, 30)
    ds = dataset(np.zeros((24, 32), np.uint8), bits=8)
    ds.file_meta.TransferSyntaxUID = JPEGBaseline8Bit
    ds.PixelData = encapsulate([jpeg(240, 320)])
    assert "240 x 320" in refusal(read_xray, save(ds, tmp_path / "x.dcm"))
    ct = ct_folder(tmp_path / "ct", RLELossless)
    ds = pydicom.dcmread(ct / "3.dcm")
    ds.file_meta.TransferSyntaxUID = JPEGBaseline8Bit
    ds.PixelData = encapsulate([jpeg(240, 320)])
    save(ds, ct / "3.dcm")
    text = refusal(read_ct, ct)
    assert "3.dcm" in text and "240 x 320" in text


def test_run_lengths_of_more_than_the_image_are_refused(tmp_path):
    ds = dataset(random_pixels())
    ds.compress(RLELossless, generate_instance_uid=False)
    ds.PixelData = encapsulate([struct.pack("<16I", 2, 64, 100_000, *[0] * 13) + b"\x81\0" * (1 << 19)])
    assert "compressed bytes" in refusal(read_xray, save(ds, tmp_path / "x.dcm"))


def test_a_model_that_is_a_zip_bomb_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "model.pt"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("model/data.pkl", bytes(1 << 22))
    monkeypatch.setattr("PolyPoseLib.io.camera_models.MAX_BYTES", 1 << 20)
    assert "grows beyond" in refusal(read_tensors, path, "camera model")
