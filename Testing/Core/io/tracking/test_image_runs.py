"""Whatever holds a camera's images, the one that is asked for is the one that was saved; odd ones end in a sentence."""

import os
import struct
import sys
import time

import numpy as np
import pytest
import SimpleITK as sitk
from json_values import assert_one_sentence
from PIL import Image
from pydicom.dataset import Dataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian, RLELossless
from track_case import picture, write_pictures
from xray_samples import SECRET, dataset, save

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.tracking import film_run, tiff_pages
from PolyPoseLib.io.tracking.folder_run import natural
from PolyPoseLib.io.tracking.image_run import open_run
from PolyPoseLib.io.xray.fields import XrayFields

COUNT, SHAPE = 12, (24, 32)
GIVEN = XrayFields(intensity="attenuation")


def pictures(count=COUNT, shape=SHAPE):
    return np.stack([picture(0, frame, shape) % 4000 for frame in range(count)])


def assert_holds(run, expected, tolerance=0.0):
    """Every image, in an order that jumps, and read twice."""
    assert run.count == len(expected)
    order = [*range(run.count), *range(run.count)[::-3], 0]
    for index in order:
        found = run.values(index, GIVEN)
        assert found.dtype == np.float32
        off = np.abs(found - expected[index])
        assert (np.percentile(off, 98) if tolerance else off.max()) <= tolerance
        notes = Notes("x")
        assert np.array_equal(run.decided(index, GIVEN, notes).values, found)


def refused(path, match):
    with pytest.raises(InputError, match=match) as error:
        run = open_run(path, path.name)
        for index in range(run.count):
            run.values(index, GIVEN)
    assert_one_sentence(error)
    assert SECRET not in str(error.value)


@pytest.mark.parametrize(
    "kind", ["plain", "rle", "rle without offsets", "deflated", "grouped", "table", "big endian"]
)
def test_a_multi_frame_dicom_file(tmp_path, kind):
    stack = pictures()
    ds = dataset(stack, "XA")
    if kind.startswith("rle"):
        ds.compress(RLELossless, generate_instance_uid=False)
    if kind == "rle without offsets":
        from pydicom.encaps import generate_frames

        frames = list(generate_frames(ds.PixelData, number_of_frames=COUNT))
        ds.PixelData = encapsulate(frames, has_bot=False)
    if kind == "deflated":
        ds.file_meta.TransferSyntaxUID = DeflatedExplicitVRLittleEndian
    if kind == "grouped":  # each frame has a scale of its own
        groups = []
        for number in range(COUNT):
            rescale, group = Dataset(), Dataset()
            rescale.RescaleIntercept, rescale.RescaleSlope = 10 * number, 2
            group.PixelValueTransformationSequence = Sequence([rescale])
            groups.append(group)
        ds.PerFrameFunctionalGroupsSequence = Sequence(groups)
    if kind == "table":  # which is large itself
        table = Dataset()
        table.LUTDescriptor, table.LUTData = [4096, 0, 16], (3 * np.arange(4096, dtype=np.uint16)).tobytes()
        table.ModalityLUTType = "US"
        table["LUTDescriptor"].VR, table["LUTData"].VR = "US", "OW"
        ds.ModalityLUTSequence = Sequence([table])
        ds.add_new(0x00091001, "OB", bytes(5000))
    if kind == "big endian":
        ds.file_meta.TransferSyntaxUID = ExplicitVRBigEndian
        ds.PixelData = stack.astype(">u2").tobytes()
    run = open_run(save(ds, tmp_path / "run.dcm"), "run.dcm")
    expected = stack.astype(float) * (3 if kind == "table" else 1)
    if kind == "grouped":
        expected = 2 * expected + 10 * np.arange(COUNT)[:, None, None]
    assert_holds(run, expected)
    assert run.tags().text("Modality") == "XA"


def test_one_frame_of_a_large_dicom_file_is_in_memory_at_a_time(tmp_path, monkeypatch):
    from PolyPoseLib.io.tracking import dicom_run

    stack = np.random.default_rng(0).integers(0, 4000, (200, 128, 128), dtype=np.uint16)
    path = save(dataset(stack, "XA"), tmp_path / "run.dcm")
    run = dicom_run.DicomRun(path, "run.dcm")
    assert 0x7FE00010 not in run._header
    read = []
    monkeypatch.setattr(
        dicom_run._Frames, "read", lambda self, index: read.append(index) or stack[index].tobytes()
    )
    assert np.array_equal(run.values(150, GIVEN), stack[150]) and read == [150]


def test_damaged_multi_frame_files_are_refused_when_they_are_opened(tmp_path):
    whole = save(dataset(pictures(), "XA"), tmp_path / "run.dcm").read_bytes()
    path = tmp_path / "cut.dcm"
    path.write_bytes(whole[:-100])
    refused(path, "cut short")
    refused(save(dataset(pictures(), "XA", NumberOfFrames=2**31 - 1), tmp_path / "many.dcm"), "cut short")
    ds = dataset(pictures(), "XA")
    ds.compress(RLELossless, generate_instance_uid=False)
    ds.NumberOfFrames = COUNT + 1
    refused(save(ds, tmp_path / "rle.dcm"), "cut short|damaged")
    refused(save(dataset(pictures(), "CT", known=False), tmp_path / "ct.dcm"), "modality CT")
    header = dataset(pictures(), "XA")
    del header.PixelData
    refused(save(header, tmp_path / "header.dcm"), "no pixel data")


@pytest.mark.parametrize("compression", [None, "tiff_lzw", "tiff_adobe_deflate", "packbits"])
@pytest.mark.parametrize("big", [False, True])
def test_a_tiff_of_several_pages(tmp_path, compression, big):
    stack = pictures()
    pages = [Image.fromarray(page) for page in stack]
    path = tmp_path / "run.tif"
    pages[0].save(path, save_all=True, append_images=pages[1:], compression=compression, big_tiff=big)
    assert_holds(open_run(path, "run.tif"), stack)


def test_a_tiff_by_the_toolkit_and_pages_that_are_turned(tmp_path):
    stack = pictures()
    path = tmp_path / "run.tif"
    sitk.WriteImage(sitk.GetImageFromArray(stack), str(path))
    assert_holds(open_run(path, "run.tif"), stack)
    pages = [Image.fromarray(page) for page in stack]
    pages[0].save(path, save_all=True, append_images=pages[1:], tiffinfo={274: 4})
    run = open_run(path, "run.tif")
    assert np.array_equal(run.values(0, GIVEN), stack[0][::-1])


def test_a_page_is_read_without_the_others(tmp_path):
    """The pixels of other pages may be damaged, and a page costs as much in a long file as in a short one."""
    stack = pictures()
    path = tmp_path / "run.tif"
    pages = [Image.fromarray(page) for page in stack]
    pages[0].save(path, save_all=True, append_images=pages[1:])
    pages_of = tiff_pages.Pages.of(path, "x")
    target = tmp_path / "page.tif"
    pages_of.write(7, target, "x")
    assert target.stat().st_size < 2 * stack[7].nbytes
    assert np.array_equal(np.array(Image.open(target)), stack[7])


def test_damaged_tiff_files_are_refused(tmp_path):
    stack = pictures()
    path = tmp_path / "run.tif"
    pages = [Image.fromarray(page) for page in stack]
    pages[0].save(path, save_all=True, append_images=pages[1:])
    whole = path.read_bytes()
    for content in (
        b"",
        b"II*\0",
        b"MM\0*" + bytes(20),
        whole[:200],
        whole[: len(whole) // 2],
        b"PK" + whole,
    ):
        path.write_bytes(content)
        refused(path, "damaged|no page|cut short")
    pages[3] = Image.fromarray(stack[3][:-4])
    pages[0].save(path, save_all=True, append_images=pages[1:])
    refused(path, r"image 3 \(counted from 0\) has 20 rows x 32 columns, but the first image 24 rows")


def test_a_tiff_whose_pages_lead_in_a_circle_ends(tmp_path):
    path = tmp_path / "run.tif"
    Image.fromarray(pictures()[0]).save(path)
    content = bytearray(path.read_bytes())
    (place,) = struct.unpack("<I", content[4:8])
    (count,) = struct.unpack("<H", content[place : place + 2])
    content[place + 2 + 12 * count : place + 6 + 12 * count] = struct.pack("<I", place)
    path.write_bytes(content)
    assert open_run(path, "run.tif").count == 1


def test_a_folder_is_sorted_as_people_sort(tmp_path):
    folder = write_pictures(tmp_path / "cam", 3, frames=8)
    (folder / ".hidden.png").write_bytes(b"")
    (folder / "notes.txt").write_text("frames of camera 3")
    run = open_run(folder, "cam")
    assert_holds(run, np.stack([picture(3, frame) for frame in range(8)]))
    assert run.warnings == ("1 of the folder's files are no images and were left out.",)
    names = ["b2", "B10", "a", "2", "10", "b1.png", "b1a", "b01"]
    assert sorted(names, key=natural)[:2] == ["2", "10"] and sorted(names, key=natural)[-1] == "B10"


@pytest.mark.parametrize("ending", [".tif", ".nii.gz", ".nrrd", ".mha"])
def test_a_folder_of_other_images(tmp_path, ending):
    folder = write_pictures(tmp_path / "cam", 1, frames=4, ending=ending)
    assert_holds(open_run(folder, "cam"), np.stack([picture(1, frame) for frame in range(4)]))


def test_a_folder_of_dicom_files_is_sorted_by_instance_numbers(tmp_path):
    stack = pictures(5)
    folder = tmp_path / "cam"
    folder.mkdir()
    for number, name in enumerate("dbeca"):
        save(dataset(stack[number], "XA", InstanceNumber=number + 1, SeriesInstanceUID="1.2"), folder / name)
    assert_holds(open_run(folder, "cam"), stack)
    save(dataset(stack[0], "XA", InstanceNumber=9, SeriesInstanceUID="1.3"), folder / "f")
    refused(folder, "2 DICOM series")


def test_odd_folders_are_refused(tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    refused(empty, "no image")
    folder = write_pictures(tmp_path / "cam", 0, frames=3)
    sitk.WriteImage(sitk.GetImageFromArray(picture(0, 1)[:-1]), str(folder / "im8.png"))
    refused(folder, "image 1 .* has 39 rows x 50 columns")
    (folder / "im8.png").write_bytes((folder / "im7.png").read_bytes()[:60])
    refused(folder, "image 1 .*(cannot be read|damaged)")
    sitk.WriteImage(sitk.GetImageFromArray(picture(0, 1)), str(folder / "im8.tif"))
    refused(folder, r"several kinds \(\.png, \.tif\)")
    if sys.platform != "win32":
        os.mkfifo(tmp_path / "pipe.png")
        refused(tmp_path / "pipe.png", "named pipe")
    (tmp_path / "text").write_text("no images at all")
    refused(tmp_path / "text", "none of a folder of images")


def film(path, frames, codec="ffv1", pixel_format="gray"):
    av = pytest.importorskip("av")
    height, width = frames[0].shape[:2]
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=25)
        stream.width, stream.height, stream.pix_fmt, stream.bit_rate = width, height, pixel_format, 8_000_000
        for pixels in frames:
            kind = "rgb24" if pixels.ndim == 3 else "gray16le" if pixels.dtype == np.uint16 else "gray"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format=kind)))
        container.mux(stream.encode())
    return path


def ramps(count=30, shape=(48, 64)):
    row, column = np.mgrid[: shape[0], : shape[1]]
    return [(row + column + 4 * number).astype(np.uint8) for number in range(count)]


@pytest.mark.parametrize(
    ("name", "codec", "pixel_format", "tolerance"),
    [("x.avi", "ffv1", "gray", 0), ("x.mp4", "mpeg4", "yuv420p", 20), ("x.mov", "mjpeg", "yuvj420p", 15)],
)
def test_a_film(tmp_path, name, codec, pixel_format, tolerance):
    frames = ramps()
    run = open_run(film(tmp_path / name, frames, codec, pixel_format), name)
    assert_holds(run, np.stack(frames), tolerance)
    assert all(abs(run.values(n, GIVEN).mean() - frames[n].mean()) < 1.5 for n in range(30))
    assert not run.warnings


def test_a_film_of_16_bits_and_a_film_of_one_frame(tmp_path):
    frames = [picture(0, n, (48, 64)) for n in range(4)]
    assert_holds(open_run(film(tmp_path / "x.avi", frames, "ffv1", "gray16le"), "x.avi"), np.stack(frames))
    assert_holds(
        open_run(film(tmp_path / "x.avi", frames[:1], "ffv1", "gray16le"), "x.avi"), np.stack(frames[:1])
    )


def test_nothing_of_a_film_is_left_in_the_temporary_folder(tmp_path, monkeypatch):
    path = film(tmp_path / "x.avi", ramps())
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr(film_run.tempfile, "tempdir", str(place))
    run = open_run(path, "x.avi")
    if os.name == "posix":
        assert not list(place.iterdir())
    assert run.values(29, GIVEN).max() == ramps()[29].max()
    del run
    assert not list(place.iterdir())


def test_a_film_that_is_cut_short_is_read_as_far_as_it_goes_and_says_so(tmp_path):
    path = film(tmp_path / "x.avi", ramps())
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 2 // 3])
    run = open_run(path, "x.avi")
    assert 10 < run.count < 30
    assert run.warnings == (
        f"The film is cut short: it can be decoded up to image {run.count - 1} (counted from 0) alone.",
    )
    assert np.array_equal(run.values(run.count - 1, GIVEN), ramps()[run.count - 1])


def test_films_that_are_none_in_colour_too_long_or_endless_are_refused(tmp_path, monkeypatch):
    path = film(tmp_path / "x.avi", ramps())
    whole = path.read_bytes()
    for damaged in (b"", b"RIFF", whole[:300], bytes(1000)):
        path.write_bytes(damaged)
        refused(path, "damaged|no frame")
    colours = np.random.default_rng(0).integers(0, 255, (48, 64, 3), dtype=np.uint8)
    refused(film(tmp_path / "c.avi", [colours], "ffv1", "bgr0"), "colour film")
    path.write_bytes(whole)
    monkeypatch.setattr(film_run, "MAX_FILM_BYTES", 10 * 48 * 64)
    refused(path, "more frames than are kept")
    monkeypatch.undo()
    monkeypatch.setattr(film_run, "FILM_LIMITS", film_run.Limits(cpu_seconds=60, wall_seconds=0))
    refused(path, "takes too long")
    monkeypatch.undo()
    monkeypatch.setattr(film_run.importlib.util, "find_spec", lambda name: None)
    refused(path, "pip install av")


def test_a_stack_in_one_file_and_a_single_picture(tmp_path):
    stack = pictures()
    for name in ("run.nii.gz", "run.nrrd", "run.mha"):
        sitk.WriteImage(sitk.GetImageFromArray(stack), str(tmp_path / name))
        assert_holds(open_run(tmp_path / name, name), stack)
    sitk.WriteImage(sitk.GetImageFromArray(stack[0]), str(tmp_path / "one.png"))
    assert_holds(open_run(tmp_path / "one.png", "one.png"), stack[:1])
    broken = stack.astype(np.float32)
    broken[3, 2, 1] = np.nan
    sitk.WriteImage(sitk.GetImageFromArray(broken), str(tmp_path / "nan.mha"))
    refused(tmp_path / "nan.mha", "NaN")


def test_numbers_of_images_that_there_are_not_are_refused(tmp_path):
    folder = write_pictures(tmp_path / "cam", 0, frames=3)
    run = open_run(folder, "cam")
    for index in (-1, 3, 10**9):
        with pytest.raises(InputError, match="does not exist") as error:
            run.values(index, GIVEN)
        assert_one_sentence(error)


def test_two_thousand_frames_of_a_film_cost_what_they_last(tmp_path):
    """Reading every frame forward and backward costs little more than reading a tenth of them; memory stays."""
    resource = pytest.importorskip("resource")
    frames = ramps(40, (200, 200)) * 50
    path = film(tmp_path / "x.avi", frames)
    run = open_run(path, "x.avi")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    for index in [*range(2000), *range(1999, -1, -1)]:
        run.values(index, GIVEN)
    assert time.process_time() - start < 10
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 60_000
