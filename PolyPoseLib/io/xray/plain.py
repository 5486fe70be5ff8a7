"""X-rays that are not DICOM: NIfTI, NRRD, MetaImage, PNG, TIFF and JPEG, through SimpleITK, and frames of films."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError, is_out_of_memory, memory_ran_out
from PolyPoseLib.io.detached_data import HEADER_ENDINGS, data_place
from PolyPoseLib.io.dicom import MAX_PIXELS
from PolyPoseLib.io.files import refuse_special_file
from PolyPoseLib.io.native_output import native_output_logged
from PolyPoseLib.io.nifti import check_nifti
from PolyPoseLib.io.readers import reader_for
from PolyPoseLib.io.xray.orientation import orientation_of, turned
from PolyPoseLib.io.xray.toolkit_forms import gray_alpha_depth, gray_of, readable_form
from PolyPoseLib.io.xray.video import VIDEO_ENDINGS, read_video_frame

PLAIN_ENDINGS = (".nii", ".nii.gz", ".nrrd", ".mha", ".png", ".tif", ".tiff", ".jpg", ".jpeg", *VIDEO_ENDINGS)
"""File names that are read without DICOM."""

GRAY_PICTURES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", *VIDEO_ENDINGS)
"""File names whose values are gray levels, never line integrals."""


def ending_of(path: Path) -> str:
    """The ending of the file's name, by which the format is chosen; "" when it is none of PLAIN_ENDINGS."""
    return next((end for end in PLAIN_ENDINGS if path.name.lower().endswith(end)), "")


@native_output_logged()
def read_plain(path: Path, where: str, frame: int | None = None) -> tuple[np.ndarray, bool]:
    """Read one two-dimensional image.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.
    frame
        Image of a stack, counted from 0.

    Returns
    -------
    tuple[np.ndarray, bool]
        ((H, W) float32 values, turned as the picture's orientation says; whether the file holds whole numbers).

    Raises
    ------
    InputError
        No file, cannot be read, not two-dimensional, in colour, too large, NaN or infinite.

    """
    if ending_of(path) in VIDEO_ENDINGS:
        return read_video_frame(path, where, frame).astype(np.float32), True
    refuse_special_file(path, where)
    _refuse_detached(path, where)
    with readable_form(path) as form:
        pixels, channels = _read(form, where, frame)
    if depth := gray_alpha_depth(path):
        pixels = gray_of(pixels, depth)
    elif channels > 1:
        pixels = _gray(pixels, where)
    pixels = _one_image(pixels, where, frame)
    if pixels.dtype.kind == "c":
        raise InputError(f"{where} holds complex numbers; give a gray image.")
    if not np.isfinite(pixels).all():
        raise InputError(_not_finite(where))
    if ending_of(path) in GRAY_PICTURES:
        pixels = turned(pixels, orientation_of(path, frame))
    return pixels.astype(np.float32), pixels.dtype.kind in "ui"


@native_output_logged()
def read_stack(path: Path, where: str) -> np.ndarray:
    """Read all images (N, H, W) of a stack of one type, whole or real numbers; a single image is a stack of one.

    Raises InputError as `read_plain`, and for stacks that are too large.
    """
    refuse_special_file(path, where)
    _refuse_detached(path, where)
    pixels, channels = _read(path, where, 0)
    if channels > 1 or pixels.dtype.kind not in "uif":
        raise InputError(f"{where} holds colours, vectors or complex numbers; give gray images.")
    while pixels.ndim > 3 and 1 in pixels.shape:
        pixels = np.squeeze(pixels, axis=pixels.shape.index(1))
    if pixels.ndim not in (2, 3):
        raise InputError(f"{where} has {pixels.ndim} dimensions; give a stack of images.")
    if pixels.dtype.kind == "f" and not np.isfinite(pixels).all():
        raise InputError(_not_finite(where))
    return pixels.reshape(-1, *pixels.shape[-2:])


def _read(path: Path, where: str, frame: int | None) -> tuple[np.ndarray, int]:
    """All pixels of a file as the toolkit gives them, and the number of their channels."""
    import SimpleITK as sitk

    reader = reader_for(path, where)
    try:
        reader.ReadImageInformation()
        size = reader.GetSize()
    except RuntimeError:
        raise InputError(
            f"{where} cannot be read: it is damaged or not what its name says; give the X-ray as DICOM, "
            "NIfTI, NRRD, PNG or TIFF."
        ) from None
    _check_size(size, where, frame)
    if path.name.lower().endswith((".nii", ".nii.gz")):
        _refuse_hidden_damage(path, where)
    try:
        image = reader.Execute()
    except (RuntimeError, MemoryError) as error:
        if is_out_of_memory(error):
            raise memory_ran_out(where) from error
        raise InputError(
            f"{where} is damaged or cut short: its pixels cannot be read; copy the file again."
        ) from None
    return sitk.GetArrayFromImage(image), image.GetNumberOfComponentsPerPixel()


def _refuse_detached(path: Path, where: str) -> None:
    """Refuse headers that read their pixels from another file, which may lie anywhere."""
    if not path.name.lower().endswith(HEADER_ENDINGS):
        return
    try:
        detached = data_place(path) is not None
    except InputError:
        detached = True
    if detached:
        raise InputError(f"{where} keeps its pixels in another file; save header and pixels as one file.")


def _refuse_hidden_damage(path: Path, where: str) -> None:
    """Refuse NIfTI files with NaN or missing bytes, which the toolkit reads as 0."""
    try:
        check_nifti(path)
    except InputError as error:
        if "NaN" in str(error):
            raise InputError(_not_finite(where)) from None
        raise InputError(
            f"{where} is damaged or cut short: its pixels cannot be read; copy the file again."
        ) from None


def _not_finite(where: str) -> str:
    """Sentence about values that are no numbers."""
    return f"{where} holds NaN or infinity; replace them by 0 and exclude them with a mask."


def _check_size(size: tuple[int, ...], where: str, frame: int | None) -> None:
    """Refuse volumes and sizes that no X-ray has, before anything is allocated."""
    extents = [extent for extent in size if extent > 1]
    text = " x ".join(map(str, size))
    if len(extents) > 2 and frame is None:
        raise InputError(
            f'{where} has {text} pixels, a volume or a stack; give one two-dimensional image, or add "frame" '
            "to choose one of the stack."
        )
    if len(extents) > 3 or np.prod(size, dtype=np.float64) > (
        MAX_PIXELS if len(extents) < 3 else 8 * MAX_PIXELS
    ):
        raise InputError(f"{where} claims {text} pixels, more than an X-ray has; export the image again.")


def _gray(pixels: np.ndarray, where: str) -> np.ndarray:
    """First channel of colours that agree, as a gray image saved in colour has."""
    colours = pixels[..., :3] if pixels.shape[-1] in (3, 4) else pixels[..., :1]
    if np.ptp(colours.astype(np.float64), axis=-1).max() > 2:
        raise InputError(f"{where} is a colour image; save the X-ray itself, in gray.")
    return colours[..., 0]


def _one_image(pixels: np.ndarray, where: str, frame: int | None) -> np.ndarray:
    """Two-dimensional image of an array whose first axis may be a stack."""
    while pixels.ndim > 2 and 1 in pixels.shape:
        pixels = np.squeeze(pixels, axis=pixels.shape.index(1))
    if pixels.ndim == 2:
        if frame not in (None, 0):
            raise InputError(
                f'{where} is a single image, so "frame" {frame} does not exist; leave "frame" out.'
            )
        return pixels
    if frame is None or not 0 <= frame < len(pixels):
        raise InputError(
            f'{where} is a stack of {len(pixels)} images, so "frame" {frame} does not exist; give a number from '
            f"0 to {len(pixels) - 1}."
        )
    return pixels[frame]


def default_intensity(path: Path, values: np.ndarray, whole: bool, notes: Notes) -> str:
    """Meaning of the values when nobody says: stated, with a warning.

    Real numbers from about 0 to 50 in NIfTI, NRRD or MetaImage are line integrals; everything else is a
    gray image with bright bone.
    """
    physical = not whole and ending_of(path) not in GRAY_PICTURES
    meaning = "line_integral" if physical and values.min() >= -5 and values.max() <= 50 else "attenuation"
    notes.say(f"intensity: {meaning} by default, the file does not say")
    assumed = "line integrals" if meaning == "line_integral" else "gray levels that are bright behind bone"
    notes.warn(
        f'the values are taken as {assumed}; if that is wrong, add "intensity": "attenuation" (bone bright), '
        '"transmission" (proportional to the beam, bone dark), "log_transmission" (bone dark) or "line_integral".'
    )
    return meaning
