"""NIfTI and Analyze images in two files: read whole or refused, as those in one file are."""

import gzip
import itertools
import struct

import numpy as np
import pytest

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.volumes import read_ct, read_volume, write_volume

SHAPE = (6, 7, 8)
NAN = float("nan")


def voxels(kind: str = "<i2") -> np.ndarray:
    values = np.random.default_rng(0).integers(-1000, 1500, SHAPE).astype(kind)
    values.flat[:2] = -1000, 1500
    return values


def write_pair(folder, header=".hdr", data=".img", magic=b"ni1\0", kind="<i2", cut=None, change=None):
    """A right CT in two files, its header changed at one place, its voxels cut; the two paths."""
    write_volume(Volume(voxels(kind), np.diag([2.0, 2, 2, 1])), folder / "right.hdr")
    head = bytearray((folder / "right.hdr").read_bytes())
    head[344:348] = magic
    if change is not None:
        struct.pack_into("<" + change[1], head, change[0], *change[2:])
    for half in ("right.hdr", "right.img"):
        (folder / half).unlink()
    paths = folder / f"ct{header}", folder / f"ct{data}"
    for path, content in zip(paths, (bytes(head), voxels(kind).tobytes()[:cut]), strict=True):
        path.write_bytes(gzip.compress(content) if path.suffix == ".gz" else content)
    return paths


def readable(paths):
    """The names of a pair under which a volume is read."""
    return [path for path in paths if not path.name.endswith(".hdr.gz")]


PAIRS = list(itertools.product([".hdr", ".hdr.gz"], [".img", ".img.gz"]))


@pytest.mark.parametrize("magic", [b"ni1\0", bytes(4)])
@pytest.mark.parametrize(("header", "data"), PAIRS)
def test_a_whole_pair_is_read(tmp_path, header, data, magic):
    for path in readable(write_pair(tmp_path, header, data, magic)):
        assert np.array_equal(read_ct(path).voxels, voxels()) and np.allclose(read_ct(path).spacing, 2)


@pytest.mark.parametrize("magic", [b"ni1\0", bytes(4)])
@pytest.mark.parametrize(("header", "data"), PAIRS)
@pytest.mark.parametrize("cut", [-2, -100, 0])
def test_voxels_that_were_cut_short_are_refused(tmp_path, header, data, magic, cut):
    """The toolkit fills them up with zeros, which are water."""
    for path in readable(write_pair(tmp_path, header, data, magic, cut=cut)):
        with pytest.raises(InputError, match=rf"ct{data}: the file is damaged or cut short") as error:
            read_volume(path)
        assert "\n" not in str(error.value)


def test_compressed_voxels_that_were_cut_short_are_refused(tmp_path):
    header, data = write_pair(tmp_path, data=".img.gz")
    data.write_bytes(data.read_bytes()[:-20])
    with pytest.raises(InputError, match="cut short"):
        read_volume(header)


@pytest.mark.parametrize("magic", [b"ni1\0", bytes(4)])
def test_voxels_that_are_no_numbers_are_refused(tmp_path, magic):
    header, data = write_pair(tmp_path, kind="<f4", magic=magic)
    values = voxels("<f4")
    values.flat[[5, -1]] = NAN
    data.write_bytes(values.tobytes())
    with pytest.raises(InputError, match="2 voxels are NaN"):
        read_volume(header)


@pytest.mark.parametrize("magic", [b"ni1\0", bytes(4)])
@pytest.mark.parametrize("value", [0.0, NAN])
def test_a_spacing_that_is_none_is_refused(tmp_path, magic, value):
    for path in write_pair(tmp_path, magic=magic, change=(84, "f", value)):
        with pytest.raises(InputError, match="pixdim"):
            read_ct(path)


def test_units_are_those_of_nifti_only(tmp_path):
    header, _ = write_pair(tmp_path, change=(123, "B", 1))
    with pytest.raises(InputError, match="metres"):
        read_ct(header)
    header, _ = write_pair(tmp_path, magic=bytes(4), change=(123, "B", 1))
    assert np.allclose(read_ct(header).spacing, 2)


def test_a_pair_has_one_header_and_one_file_of_voxels(tmp_path):
    header, data = write_pair(tmp_path)
    (tmp_path / "ct.img.gz").write_bytes(gzip.compress(data.read_bytes()))
    with pytest.raises(InputError, match=r"ct\.img, ct\.img\.gz: keep one"):
        read_volume(header)
    for path in tmp_path.glob("ct.img*"):
        path.unlink()
    with pytest.raises(InputError) as error:
        read_volume(header)
    assert "ct.hdr" in str(error.value)


def test_a_header_of_a_whole_file_is_no_half(tmp_path):
    header, _ = write_pair(tmp_path, magic=b"n+1\0")
    with pytest.raises(InputError, match="damaged"):
        read_volume(header)
