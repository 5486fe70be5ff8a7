"""Headers that end the process inside the toolkit, or hold it for hours, are refused in a sentence before it reads."""

import gzip
import struct
import time

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.errors import InputError
from PolyPoseLib.io import guarded
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_volume
from PolyPoseLib.io.xray.read import read_xray

NRRD = {
    "type": "short", "dimension": "3", "space": "left-posterior-superior", "sizes": "4 4 4",
    "space directions": "(1,0,0) (0,1,0) (0,0,1)", "kinds": "domain domain domain", "endian": "little",
    "encoding": "raw", "space origin": "(0,0,0)",
}  # fmt: skip
META = {
    "ObjectType": "Image", "NDims": "3", "BinaryData": "True", "ElementSpacing": "2 2 2", "DimSize": "4 4 4",
    "ElementType": "MET_SHORT", "ElementDataFile": "LOCAL",
}  # fmt: skip
VOXELS = np.arange(64, dtype="<i2").tobytes()


def nrrd(path, more=(), **fields):
    lines = [f"{name}: {value}" for name, value in {**NRRD, **fields}.items()]
    path.write_bytes("\n".join(["NRRD0005", *lines, *more, "", ""]).encode() + VOXELS)
    return path


def metaimage(path, **fields):
    lines = [f"{name} = {value}" for name, value in {**META, **fields}.items()]
    path.write_bytes("\n".join([*lines, ""]).encode() + VOXELS)
    return path


def refusal(read, path) -> str:
    start = time.monotonic()
    with pytest.raises(InputError) as error:
        read(path)
    text = str(error.value)
    assert path.name in text and text.isprintable() and len(text) < 700
    assert time.monotonic() - start < 60
    return text


@pytest.mark.parametrize(
    "field", [*NRRD, "spacings", "labels", "line skip", "data file", "nonsense", "Space Units"]
)
def test_a_field_of_nrrd_without_an_end_is_refused(tmp_path, field):
    for name, read in (("a.nrrd", read_volume), ("a.seg.nrrd", read_segmentation), ("a.nhdr", read_volume)):
        path = nrrd(tmp_path / name, **{field: "A" * 1200})
        text = refusal(read, path)
        assert "bytes" in text or "dimension" in text
    xray = nrrd(tmp_path / "x.nrrd", **{field: "A" * 1200})
    refusal(
        lambda path: read_xray(path, fields={"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4}), xray
    )


@pytest.mark.parametrize(
    "line", ["A" * 1200, "key: value:=" + "A" * 1200, "# comment\r" + "A" * 1200, " #" + "A" * 1200]
)
def test_what_only_resembles_free_text_is_no_way_around(tmp_path, line):
    refusal(read_volume, nrrd(tmp_path / "a.nrrd", [line]))


@pytest.mark.parametrize(
    "line", ["# " + "A" * 5000, "key:=" + "A" * 5000, "key:=value: " + "A" * 5000, "content: " + "A" * 5000]
)
def test_free_text_of_nrrd_may_be_long(tmp_path, line):
    assert read_volume(nrrd(tmp_path / "a.nrrd", [line])).shape == (4, 4, 4)


@pytest.mark.parametrize("axes", ["0", "-1", "11", "12", "16", "99999999999", "nan", "", "3 3"])
def test_axes_without_number_are_refused(tmp_path, axes):
    refusal(read_volume, nrrd(tmp_path / "a.nrrd", dimension=axes))
    refusal(read_volume, metaimage(tmp_path / "a.mha", NDims=axes))


def test_fields_without_number_are_refused(tmp_path):
    assert "fields" in refusal(read_volume, nrrd(tmp_path / "a.nrrd", [f"k{n}:=v" for n in range(60_000)]))


@pytest.mark.parametrize(
    "place", ["x%s", "%s%s%n 1 3 1", "%05d 1 3 0", "LIST " + "A" * 100, "A" * 100 + "%d 1 3 1"]
)
def test_names_of_files_that_are_formats_are_refused(tmp_path, place):
    refusal(read_volume, metaimage(tmp_path / "a.mhd", ElementDataFile=place))


def test_an_image_in_several_files_is_read(tmp_path):
    for number in range(4):
        (tmp_path / f"part{number}.raw").write_bytes(VOXELS[32 * number : 32 * (number + 1)])
    whole = read_volume(metaimage(tmp_path / "whole.mha"))
    for place in ("part%d.raw 0 3 1", "LIST\npart0.raw\npart1.raw\npart2.raw\npart3.raw"):
        path = tmp_path / "parts.mhd"
        path.write_text(
            "\n".join(f"{name} = {value}" for name, value in {**META, "ElementDataFile": place}.items())
            + "\n"
        )
        parts = read_volume(path)
        assert np.array_equal(parts.voxels, whole.voxels) and np.array_equal(parts.affine, whole.affine)


def test_a_child_that_dies_or_takes_too_long_is_one_sentence(tmp_path, monkeypatch):
    path = tmp_path / "parts.mhd"
    path.write_text(
        "\n".join(f"{n} = {v}" for n, v in {**META, "ElementDataFile": "LIST\npart"}.items()) + "\n"
    )
    for program, words in (
        ("import os; os.abort()", "survive"),
        ("import time; time.sleep(60)", "not ended"),
    ):
        monkeypatch.setattr(guarded, "_CHILD", program)
        with pytest.raises(InputError, match=words):
            guarded.read_in_child(path, "MetaImageIO", guarded.Limits(cpu_seconds=1, wall_seconds=1))


def test_compressed_bytes_before_the_voxels_are_bounded(tmp_path):
    path = tmp_path / "a.nii.gz"
    sitk.WriteImage(sitk.GetImageFromArray(np.zeros((4, 4, 4), np.int16)), str(path))
    content = bytearray(gzip.decompress(path.read_bytes()))
    for offset in (1e12, float("inf"), float("nan"), 3e8):
        struct.pack_into("<f", content, 108, offset)
        path.write_bytes(gzip.compress(content))
        refusal(read_volume, path)
    assert "MiB" in refusal(
        read_volume, nrrd(tmp_path / "a.nrrd", ["byte skip: 99999999999"], encoding="gzip")
    )
