"""Pictures: gray with alpha is read, the stated orientation is followed, pages of a stack are told apart."""

import numpy as np
import pytest
import SimpleITK as sitk
from picture_files import exif, png, stored_for, tiff

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.orientation import orientation_of, orientations
from PolyPoseLib.io.xray.plain import read_plain
from PolyPoseLib.io.xray.read import read_xray

SHAPE = (20, 30)
GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": 0.4, "intensity": "attenuation"}

# Which displayed row and column the stored first row and column are (TIFF 6.0, page 36).
CORNERS = {
    1: (0, 0), 2: (0, -1), 3: (-1, -1), 4: (-1, 0),
    5: (0, 0), 6: (0, -1), 7: (-1, -1), 8: (-1, 0),
}  # fmt: skip


def gray(depth=np.uint8, seed=0):
    return np.random.default_rng(seed).integers(0, np.iinfo(depth).max, SHAPE, endpoint=True).astype(depth)


def jpeg(path, pixels, orientation):
    """A JPEG file of the toolkit's with an EXIF block put in front."""
    sitk.WriteImage(sitk.GetImageFromArray(pixels), path, False, 100)
    block = b"Exif\0\0" + exif(orientation, ">")
    content = path.read_bytes()
    path.write_bytes(content[:2] + b"\xff\xe1" + (len(block) + 2).to_bytes(2, "big") + block + content[2:])
    return path


@pytest.mark.parametrize("filters", [False, True])
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_gray_with_alpha_is_read_in_full_depth(tmp_path, depth, filters):
    pixels, alpha = gray(depth), gray(depth, 1)
    path = png(tmp_path / "x.png", np.stack([pixels, alpha], axis=-1), filters=filters)
    values, whole = read_plain(path, "x.png")
    np.testing.assert_array_equal(values, pixels)
    assert whole
    xray = read_xray(path, fields=GEOMETRY)
    assert np.corrcoef(xray.image.ravel(), pixels.ravel())[0, 1] > 0.999


def test_a_damaged_picture_with_alpha_ends_in_one_sentence(tmp_path):
    path = png(tmp_path / "x.png", np.stack([gray(), gray()], axis=-1))
    whole = path.read_bytes()
    for size in range(20, len(whole) - 12, 37):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match="damaged"):
            read_plain(path, "x.png")


@pytest.mark.parametrize("orientation", CORNERS)
@pytest.mark.parametrize("kind", ["png", "jpg", "tif", "tif big-endian", "tif 16"])
def test_pictures_are_turned_as_they_say(tmp_path, kind, orientation):
    shown = gray(np.uint16 if kind == "tif 16" else np.uint8)
    if kind == "jpg":  # smooth, so that its compression costs little
        shown = (np.add.outer(np.arange(20.0) ** 2 / 4, np.arange(30.0) * 5)).astype(np.uint8)
    row, column = CORNERS[orientation]
    stored = stored_for(shown, orientation)
    first = stored[:, 0] if orientation >= 5 else stored[0]
    np.testing.assert_array_equal(np.sort(first), np.sort(shown[row]))
    assert stored[0, 0] == shown[row, column]
    path = tmp_path / f"x.{kind.split()[0]}"
    if kind == "png":
        png(path, stored, (b"eXIf", exif(orientation)))
    elif kind == "jpg":
        jpeg(path, stored, orientation)
    else:
        tiff(path, [stored], orientation, ">" if "big" in kind else "<")
    assert orientation_of(path) == orientation
    values, _ = read_plain(path, path.name)
    np.testing.assert_allclose(values, shown, atol=3 if kind == "jpg" else 0)


def test_the_turn_is_said_and_a_wrong_one_is_none(tmp_path):
    lines = read_xray(tiff(tmp_path / "x.tif", [gray()], 6), fields=GEOMETRY).provenance
    assert any("orientation 6" in line for line in lines)
    for wrong in (0, 9, 60000):
        path = tiff(tmp_path / "w.tif", [gray()], wrong)
        assert orientations(path) == [None]


def test_a_stacks_pages_are_chosen_by_their_number(tmp_path):
    pages = [gray(seed=seed) for seed in range(3)]
    for orientation in (None, 3):
        stored = [stored_for(page, orientation or 1) for page in pages]
        path = tiff(tmp_path / "x.tif", stored, orientation)
        for number, page in enumerate(pages):
            np.testing.assert_array_equal(read_plain(path, "x", number)[0], page)
        with pytest.raises(InputError, match='"frame"'):
            read_plain(path, "x")
        with pytest.raises(InputError, match="from 0 to 2"):
            read_plain(path, "x", 3)


def test_directories_that_lead_in_a_circle_end(tmp_path):
    path = tiff(tmp_path / "x.tif", [gray(), gray()], 3)
    content = bytearray(path.read_bytes())
    content[-4:] = content[4:8]
    path.write_bytes(content)
    assert len(orientations(path)) == 2
