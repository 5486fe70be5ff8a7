"""Which files a study reads: whatever a header says, none outside its folder, and none that nobody could check."""

from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from PolyPoseLib.errors import InputError
from PolyPoseLib.io import detached_data
from PolyPoseLib.io.paths import resolve, resolve_output
from PolyPoseLib.io.volumes import read_volume
from PolyPoseLib.io.xray.plain import read_plain

SIZE = 6
META = (
    "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 2 2 2\n"
    f"DimSize = {SIZE} {SIZE} {SIZE}\nElementType = MET_SHORT\n"
)
NRRD = (
    f"NRRD0004\ntype: short\ndimension: 3\nsizes: {SIZE} {SIZE} {SIZE}\nendian: little\nencoding: raw\n"
    "spacings: 2 2 2\n"
)
COMMENTS = ("# " + "x" * 200 + "\n") * 6000


@pytest.fixture
def folder(tmp_path):
    """The study's folder; beside it lie whole.raw and s0.raw, s1.raw..., to which links in the folder lead."""
    voxels = np.random.default_rng(0).integers(-1000, 1500, (SIZE,) * 3).astype("<i2")
    outside, inside = tmp_path / "outside", tmp_path / "inside"
    outside.mkdir()
    inside.mkdir()
    (outside / "whole.raw").write_bytes(voxels.tobytes())
    (inside / "own.raw").write_bytes(voxels.tobytes())
    for k in range(SIZE):
        (outside / f"s{k}.raw").write_bytes(voxels[k].tobytes())
        (inside / f"s{k}.raw").symlink_to(outside / f"s{k}.raw")
    return inside


LEAVING = {
    "equals.mhd": META + "ElementDataFile = ../outside/whole.raw\n",
    "colon.mhd": META + "ElementDataFile : ../outside/whole.raw\n",
    "tight.mha": META + "ElementDataFile:../outside/whole.raw\n",
    "decoy.mhd": META.replace("NDims", "Comment = ElementDataFile = LOCAL\nNDims")
    + "ElementDataFile: ../outside/whole.raw\n",
    "twice.mhd": META + "ElementDataFile = own.raw\nElementDataFile = ../outside/whole.raw\n",
    "pattern.mhd": META + f"ElementDataFile = s%d.raw 0 {SIZE - 1} 1\n",
    "list.mhd": META + "ElementDataFile = LIST\n" + "".join(f"s{k}.raw\n" for k in range(SIZE)),
    "pattern.nhdr": NRRD + f"data file: s%d.raw 0 {SIZE - 1} 1 2\n",
    "list.nhdr": NRRD + "data file: LIST 2\n" + "".join(f"s{k}.raw\n" for k in range(SIZE)),
    "plain.nrrd": NRRD + "DataFile: ../outside/whole.raw\n",
    "long.nrrd": NRRD + COMMENTS + "data file: ../outside/whole.raw\n",
    "longer.nhdr": NRRD + COMMENTS * 4 + "data file: ../outside/whole.raw\n",
    "returns.nrrd": (NRRD + "data file: ../outside/whole.raw\n\n").replace("\n", "\r\n"),
}


@pytest.mark.parametrize("name", LEAVING)
def test_headers_whose_voxels_may_lie_outside_are_refused(folder, name):
    (folder / name).write_bytes(LEAVING[name].encode())
    with pytest.raises(InputError, match='"ct"') as error:
        resolve(name, "ct", folder, allow_outside=False)
    assert name in str(error.value) and "\n" not in str(error.value)
    assert resolve(name, "ct", folder, allow_outside=True) == folder.resolve() / name


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.mhd", META + "ElementDataFile = own.raw\n"),
        ("b.mhd", META + "Comment = 5: not % a list\nElementDataFile: own.raw\n"),
        ("a.nhdr", NRRD + "# data file: ../x\ndata file: ./own.raw\n"),
        ("b.nhdr", NRRD + COMMENTS + "data file: own.raw\n"),
    ],
)
def test_voxels_beside_their_header_are_read(folder, name, text):
    (folder / name).write_text(text)
    voxels = np.frombuffer((folder / "own.raw").read_bytes(), "<i2").reshape((SIZE,) * 3)
    assert np.array_equal(read_volume(resolve(name, "ct", folder, allow_outside=False)).voxels, voxels)


@pytest.mark.parametrize(
    ("name", "text"), [("a.mha", META + "ElementDataFile = Local\n"), ("a.nrrd", NRRD + "\n")]
)
def test_voxels_behind_their_header_are_read_whatever_they_look_like(folder, name, text):
    body = (b"\ndata file: ../outside/whole.raw\n" * 99)[: 2 * SIZE**3]
    (folder / name).write_bytes(text.encode() + body)
    assert read_volume(resolve(name, "ct", folder, allow_outside=False)).voxels.tobytes() == body


def test_a_header_without_an_end_is_refused(folder, monkeypatch):
    monkeypatch.setattr(detached_data, "MAX_HEADER_BYTES", 1 << 16)
    for name, text in (("a.mhd", META), ("a.nhdr", NRRD)):
        (folder / name).write_text(text + COMMENTS)
        with pytest.raises(InputError, match="longer than"):
            resolve(name, "ct", folder, allow_outside=False)


@pytest.mark.parametrize(("named", "other"), [("a.hdr", "a.img"), ("a.img", "a.hdr"), ("a.HDR", "A.img.gz")])
def test_the_other_half_of_a_pair_may_not_lie_outside(folder, named, other):
    (folder / named).write_bytes(bytes(400))
    (folder / other).symlink_to(folder.parent / "outside" / "whole.raw")
    with pytest.raises(InputError, match=f'reads "{other}" outside the study\'s folder'):
        resolve(named, "ct", folder, allow_outside=False)


@pytest.mark.parametrize("separator", [" =", ":", " :"])
def test_an_xray_with_its_pixels_elsewhere_is_refused(folder, separator):
    path = folder / "x.mha"
    path.write_text(META + f"ElementDataFile{separator} own.raw\n")
    with pytest.raises(InputError, match="another file"):
        read_plain(path, "x.mha")
    path = folder / "x.nrrd"
    path.write_text(NRRD + COMMENTS + "data file: own.raw\n")
    with pytest.raises(InputError, match="another file"):
        read_plain(path, "x.nrrd")


@pytest.mark.parametrize(
    "ending", [".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd", ".img", ".png", ".tif"]
)
def test_other_formats_under_an_images_name_are_not_read(tmp_path, ending):
    """HDF5 may keep its voxels in any other file."""
    image = sitk.GetImageFromArray(np.arange(8 * 8, dtype=np.int16).reshape(1, 8, 8))
    sitk.WriteImage(image, str(tmp_path / "a.h5"))
    path = (tmp_path / "a.h5").rename(Path(tmp_path / f"a{ending}"))
    with pytest.raises(InputError):
        read_plain(path, path.name) if ending in (".png", ".tif") else read_volume(path)


def test_links_that_lead_outside_do_not_keep_a_file_from_being_written_beside_them(folder):
    assert any(file.is_symlink() for file in folder.iterdir())
    assert resolve_output("preview.h5", "preview", folder, False) == folder.resolve() / "preview.h5"
    with pytest.raises(InputError, match="link"):
        resolve_output("s0.raw", "preview", folder, False)
