"""Shutters, collimators, padding and plain borders are masked out, and nothing else is."""

import numpy as np
import pytest
import SimpleITK as sitk
from xray_samples import dataset, random_pixels, save

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

SHAPE = (60, 80)
ROW, COLUMN = np.meshgrid(np.arange(1, SHAPE[0] + 1), np.arange(1, SHAPE[1] + 1), indexing="ij")


def mask_of(tmp_path, pixels=None, modality="XA", fields=None, **attributes):
    pixels = random_pixels(shape=SHAPE) if pixels is None else pixels
    return read_xray(save(dataset(pixels, modality, **attributes), tmp_path / "x.dcm"), fields=fields)


def rectangle(kind, upper, lower, left, right):
    return {
        f"{kind}Shape": "RECTANGULAR",
        f"{kind}UpperHorizontalEdge": upper,
        f"{kind}LowerHorizontalEdge": lower,
        f"{kind}LeftVerticalEdge": left,
        f"{kind}RightVerticalEdge": right,
    }


@pytest.mark.parametrize("kind", ["Shutter", "Collimator"])
def test_a_rectangle_keeps_what_lies_between_its_edges(tmp_path, kind):
    mask = mask_of(tmp_path, **rectangle(kind, 11, 50, 21, 70)).mask
    np.testing.assert_array_equal(mask, (ROW >= 11) & (ROW <= 50) & (COLUMN >= 21) & (COLUMN <= 70))


@pytest.mark.parametrize("kind", ["Shutter", "Collimator"])
def test_a_circle_counts_its_radius_in_columns(tmp_path, kind):
    shape = {f"{kind}Shape": "CIRCULAR", f"CenterOfCircular{kind}": [30, 40], f"RadiusOfCircular{kind}": 20}
    mask = mask_of(tmp_path, **shape).mask
    inside = ((ROW - 30) * 0.5) ** 2 + ((COLUMN - 40) * 0.4) ** 2 <= (20 * 0.4) ** 2
    np.testing.assert_array_equal(mask, inside)


def test_a_polygon_agrees_with_the_half_planes_of_a_triangle(tmp_path):
    corners = np.array([(10.5, 12.5), (50.5, 20.5), (25.5, 70.5)])
    shape = {"ShutterShape": "POLYGONAL", "VerticesOfThePolygonalShutter": [11, 13, 51, 21, 26, 71]}
    mask = mask_of(tmp_path, **shape).mask
    corners = np.array([(11, 13), (51, 21), (26, 71)])
    sides = []
    for (r0, c0), (r1, c1) in zip(corners, np.roll(corners, -1, 0), strict=True):
        sides.append((r1 - r0) * (COLUMN - c0) - (c1 - c0) * (ROW - r0))
    sides = np.stack(sides)
    strictly_inside, strictly_outside = (sides > 0).all(0), (sides < 0).any(0)
    assert mask[strictly_inside].all()
    assert not mask[strictly_outside].any()
    assert strictly_inside.sum() > 500


def test_shapes_are_superimposed(tmp_path):
    attributes = rectangle("Shutter", 1, 60, 1, 40)
    attributes["ShutterShape"] = ["RECTANGULAR", "CIRCULAR"]
    attributes |= {"CenterOfCircularShutter": [30, 40], "RadiusOfCircularShutter": 20}
    both = mask_of(tmp_path, **attributes, **rectangle("Collimator", 20, 60, 1, 80)).mask
    circle = ((ROW - 30) * 0.5) ** 2 + ((COLUMN - 40) * 0.4) ** 2 <= (20 * 0.4) ** 2
    np.testing.assert_array_equal(both, circle & (COLUMN <= 40) & (ROW >= 20))


def test_a_bitmap_shutter_that_leaves_the_image_is_cut_off(tmp_path):
    ds = dataset(random_pixels(shape=SHAPE), ShutterShape="BITMAP", ShutterOverlayGroup=0x6000)
    bits = np.ones((20, 24), dtype=np.uint8)
    ds.add_new(0x60000010, "US", 20)
    ds.add_new(0x60000011, "US", 24)
    ds.add_new(0x60000040, "CS", "G")
    ds.add_new(0x60000050, "SS", [-9, 70])
    ds.add_new(0x60000100, "US", 1)
    ds.add_new(0x60000102, "US", 0)
    ds.add_new(0x60003000, "OW", np.packbits(bits, bitorder="little").tobytes())
    mask = read_xray(save(ds, tmp_path / "x.dcm")).mask
    np.testing.assert_array_equal(mask, ~((ROW <= 10) & (COLUMN >= 70)))


@pytest.mark.parametrize(
    "attributes",
    [
        rectangle("Shutter", 0, 0, 0, 0),
        rectangle("Shutter", 50, 10, 70, 20),
        {"ShutterShape": "CIRCULAR", "CenterOfCircularShutter": [900, 900], "RadiusOfCircularShutter": 5},
        {"ShutterShape": "POLYGONAL", "VerticesOfThePolygonalShutter": [1, 1, 2, 2]},
        {"ShutterShape": "RECTANGULAR"},
        {"ShutterShape": "OVAL"},
    ],
)
def test_nonsensical_shutters_are_ignored(tmp_path, attributes):
    assert mask_of(tmp_path, **attributes).mask.all()


def test_only_padding_that_touches_the_edge_is_padding(tmp_path):
    pixels = random_pixels(shape=SHAPE)
    pixels[:, :9] = 7
    pixels[30, 40] = 7
    mask = mask_of(tmp_path, pixels, PixelPaddingValue=7).mask
    np.testing.assert_array_equal(mask[:, :9], False)
    assert mask[30, 40]
    assert mask[:, 12:].all()


def test_the_collimator_of_an_untagged_image_is_found(tmp_path):
    pixels = random_pixels(shape=SHAPE) + np.uint16(60)
    beam = ((ROW - 30) / 28) ** 2 + ((COLUMN - 40) / 38) ** 2 <= 1
    pixels[~beam] = 3
    mask = mask_of(tmp_path, pixels).mask
    assert not mask[~beam].any()
    assert mask[beam].mean() > 0.85


def test_the_direct_beam_of_an_unprocessed_image_is_kept(tmp_path):
    pixels = random_pixels(shape=SHAPE)
    pixels[:12] = 4095
    pixels[:, 70:] = 4095
    assert mask_of(tmp_path, pixels).mask.all()


def test_black_margins_of_a_processed_image_are_removed(tmp_path):
    pixels = random_pixels(shape=SHAPE) + np.uint16(60)
    pixels[:12] = 0
    pixels[:, 70:] = 0
    mask = mask_of(tmp_path, pixels, "CR").mask
    np.testing.assert_array_equal(mask, (ROW > 12) & (COLUMN <= 70))


def test_an_image_without_borders_keeps_every_pixel(tmp_path):
    for seed in range(5):
        assert mask_of(tmp_path, random_pixels(seed, SHAPE)).mask.all()
        assert mask_of(tmp_path, random_pixels(seed, SHAPE), "CR").mask.all()


def test_a_mask_from_the_study_is_used_and_must_fit(tmp_path):
    save(dataset(random_pixels(shape=SHAPE)), tmp_path / "x.dcm")
    wanted = (np.random.default_rng(0).random(SHAPE) > 0.5).astype(np.uint8)
    sitk.WriteImage(sitk.GetImageFromArray(wanted * 255), tmp_path / "mask.png")
    xray = read_xray(tmp_path / "x.dcm", fields={"mask": "mask.png"})
    np.testing.assert_array_equal(xray.mask, wanted > 0)
    sitk.WriteImage(sitk.GetImageFromArray(wanted[:, 1:]), tmp_path / "small.png")
    with pytest.raises(InputError, match="give a mask of the image's size"):
        read_xray(tmp_path / "x.dcm", fields={"mask": "small.png"})
    sitk.WriteImage(sitk.GetImageFromArray(wanted * 0), tmp_path / "empty.png")
    with pytest.raises(InputError, match="leaves no pixels"):
        read_xray(tmp_path / "x.dcm", fields={"mask": "empty.png"})


def test_a_mask_starts_at_the_study_and_stays_there(tmp_path):
    (tmp_path / "study" / "images").mkdir(parents=True)
    path = save(dataset(random_pixels(shape=SHAPE)), tmp_path / "study" / "images" / "x.dcm")
    whole = sitk.GetImageFromArray(np.ones(SHAPE, np.uint8))
    sitk.WriteImage(whole, tmp_path / "study" / "mask.png")
    sitk.WriteImage(whole, tmp_path / "outside.png")
    assert read_xray(path, fields={"image": "images/x.dcm", "mask": "mask.png"}).mask.all()
    assert read_xray(path, fields={"mask": "mask.png"}, folder=tmp_path / "study").mask.all()
    with pytest.raises(InputError, match="outside the study's folder"):
        read_xray(path, fields={"image": "images/x.dcm", "mask": "../outside.png"})
    with pytest.raises(InputError, match="outside the study's folder"):
        read_xray(path, fields={"mask": str(tmp_path / "outside.png")})
    assert read_xray(path, fields={"mask": tmp_path / "outside.png"}).mask.all()
    with pytest.raises(InputError, match="correct its path"):
        read_xray(path, fields={"mask": "no.png"})
