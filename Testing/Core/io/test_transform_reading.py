"""Transform files: read as the image toolkit reads them, and never for long, however they are damaged."""

import time
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from hypothesis import given
from hypothesis import strategies as st

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import transform_reading
from PolyPoseLib.io.hdf5 import Hdf5File, UnknownLayout, lookup3
from PolyPoseLib.io.transforms import read_transform, write_transform

AFFINE = np.array([[0, -3, 0, 5], [4, 0, 0, -6], [0, 0, -3.5, 7], [0, 0, 0, 1.0]])


def random_field(shape=(5, 6, 7)) -> DisplacementField:
    return DisplacementField(np.random.default_rng(0).normal(size=(*shape, 3)).astype(np.float32), AFFINE)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("transforms") / "transform.h5"
    write_transform(random_field(), path)
    return path


def as_the_toolkit_reads(path: Path) -> DisplacementField:
    transform = sitk.DisplacementFieldTransform(sitk.ReadTransform(str(path)))
    return DisplacementField.from_sitk_image(transform.GetDisplacementField())


def same(first: DisplacementField, second: DisplacementField) -> bool:
    return np.array_equal(first.vectors, second.vectors) and np.array_equal(first.affine, second.affine)


def test_a_field_comes_back_as_the_toolkit_reads_it(written):
    assert same(read_transform(written), as_the_toolkit_reads(written))
    assert np.array_equal(read_transform(written).vectors, random_field().vectors)


def test_an_unusual_layout_is_read_by_the_toolkit_in_a_process_of_its_own(written, monkeypatch):
    def unknown(file):
        raise UnknownLayout

    monkeypatch.setattr(transform_reading, "_from_itk_layout", unknown)
    assert same(read_transform(written), as_the_toolkit_reads(written))


def test_a_process_that_reads_for_ever_is_ended(tmp_path, written, monkeypatch):
    # One length in the heap of texts, which no checksum guards: HDF5 reads on and on.
    hangs = tmp_path / "hangs.h5"
    content = bytearray(written.read_bytes())
    content[content.index(b"GCOL") + 24] = 255
    hangs.write_bytes(content)
    with pytest.raises(
        InputError, match=r"hangs\.h5: does not hold a displacement field \(one of its texts has no content"
    ):
        read_transform(hangs)

    def unknown(file):
        raise UnknownLayout

    monkeypatch.setattr(transform_reading, "_from_itk_layout", unknown)
    monkeypatch.setattr(transform_reading, "CHILD_SECONDS", 1)
    began = time.monotonic()
    with pytest.raises(InputError, match=r"hangs\.h5: does not hold"):
        read_transform(hangs)
    assert time.monotonic() - began < 30


@pytest.mark.parametrize("kind", ["affine", "composite", "spline", "text", "empty", "folder", "float"])
def test_other_transforms_are_refused_by_name(tmp_path, kind):
    path = tmp_path / "other.h5"
    if kind == "affine":
        sitk.WriteTransform(sitk.AffineTransform(3), str(path))
    elif kind == "composite":
        pair = [random_field().to_sitk_transform(), sitk.AffineTransform(3)]
        sitk.WriteTransform(sitk.CompositeTransform(pair), str(path))
    elif kind == "spline":
        image = sitk.Image(10, 10, 10, sitk.sitkInt16)
        sitk.WriteTransform(sitk.BSplineTransformInitializer(image, (3, 3, 3)), str(path))
    elif kind == "folder":
        path.mkdir()
    else:
        path.write_bytes({"text": b"no HDF5" * 20, "empty": b"", "float": b"\x89HDF\r\n\x1a\n"}[kind])
    with pytest.raises(InputError, match=r"other\.h5: "):
        read_transform(path)


@given(st.data())
def test_damage_is_refused_or_leaves_a_field(written, data):
    content = bytearray(written.read_bytes())
    how = data.draw(st.sampled_from(["bytes", "cut", "longer", "zeros"]))
    if how == "bytes":
        for place in data.draw(st.lists(st.integers(0, 8900), min_size=1, max_size=8)):
            content[place] = data.draw(st.integers(0, 255))
    elif how == "cut":
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    elif how == "longer":
        content += data.draw(st.binary(min_size=1, max_size=50))
    else:
        first = data.draw(st.integers(0, len(content)))
        content[first : first + 64] = bytes(len(content[first : first + 64]))
    path = written.with_name("damaged.h5")
    path.write_bytes(content)
    began = time.monotonic()
    try:
        found = read_transform(path)
    except InputError as error:
        assert str(error).startswith(f"{path}: ") and "\n" not in str(error)
    else:
        assert found.shape == (5, 6, 7)
    assert time.monotonic() - began < 30


def test_every_damaged_byte_of_a_header_is_noticed(written):
    content = written.read_bytes()
    with Hdf5File(written) as file:
        start = file.links(file.links(file.root)["TransformGroup"])["0"]
        place = file.links(start)["TransformParameters"]
    path = written.with_name("header.h5")
    for byte in range(place, place + 24):
        path.write_bytes(content[:byte] + bytes([content[byte] ^ 1]) + content[byte + 1 :])
        with pytest.raises((InputError, UnknownLayout)):
            transform_reading.read_displacement_field(path)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (b"", 0xDEADBEEF),
        (b"Four score and seven years ago", 0x17770551),  # as the hash's own source says
    ],
)
def test_the_checksum_is_lookup3(text, value):
    assert lookup3(text) == value
