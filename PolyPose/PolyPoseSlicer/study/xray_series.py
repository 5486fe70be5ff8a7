"""The images of one row of X-rays that holds several: how many there are, how fast, and where they can be read."""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import InputError, PolyPoseError

from .writer import UNKNOWN_SPACING
from .xray_source import XraySource

_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3}
"""Units of a sequence's index that are times."""

MOST_STEPS = 1.5
"""Of two images' distance in time and the usual one: above it an image is missing, below it times jitter."""


@dataclass(frozen=True)
class XraySeries:
    """All images of one X-ray as they can be read without the scene: one of the three is filled.

    file: one file that holds them all. files: one DICOM file an image, in their order. images: views of the nodes'
    own pixels, (H, W) or (H, W, channels) each, row by row as stored; they are not copied.
    spacing: (row, column) in mm of the images' nodes.
    """

    count: int
    file: str = ""
    files: tuple[str, ...] = ()
    images: tuple[np.ndarray, ...] = ()
    spacing: tuple[float, float] = UNKNOWN_SPACING

    @property
    def bytes(self) -> int:
        """Of all images that have to be written."""
        return sum(each.nbytes for each in self.images)


def image_count(source: XraySource) -> int:
    """How many images an X-ray's row holds; 1 for what cannot be read."""
    node = source.image
    if source.path:
        return _in_file(source.path, _age(source.path))[0]
    if node is None:
        return 1
    if node.IsA("vtkMRMLSequenceNode"):
        return node.GetNumberOfDataNodes()
    data = node.GetImageData()
    return 1 if data is None else data.GetDimensions()[2]


def stated_rate(source: XraySource) -> float | None:
    """Frames per second as DICOM states it, else as the times of a sequence's images are; None where nothing does."""
    try:
        path = _one_file(source)
    except PolyPoseError:
        return None
    rate = _in_file(path, _age(path))[1] if path else None
    return rate or _rate_of_index(source.image)


def series_of(source: XraySource) -> XraySeries:
    """The images of a row; raises InputError, as one sentence, where one of them is none or differs from the others.

    As for a single image, the files of what came from DICOM are preferred: Slicer loses their geometry.
    """
    path, node = _one_file(source), source.image
    if path:
        count, in_file = image_count(source), _in_file(path, _age(path))[0]
        if count != in_file:
            raise InputError(
                _(
                    "The sequence '{name}' has {count} images, but its file has {in_file}: load it again from its file."
                ).format(name=source.name, count=count, in_file=in_file)
            )
        return XraySeries(count, file=str(Path(path).resolve()))
    if node is None or not node.IsA("vtkMRMLSequenceNode"):
        return _of_volume(source)
    files = _files_of(source)
    if files:
        return XraySeries(len(files), files=files)
    first = source.at(0).pixels_view()
    images = [first[0]]
    for number in range(1, node.GetNumberOfDataNodes()):
        image, spacing = source.at(number).pixels_view()
        if image.shape != images[0].shape or image.dtype != images[0].dtype or spacing != first[1]:
            raise InputError(
                _(
                    "Image {number} of the sequence '{name}' has another size, type or spacing than the first: choose "
                    "a sequence of one camera."
                ).format(number=number + 1, name=node.GetName())
            )
        images.append(image)
    return XraySeries(len(images), images=tuple(images), spacing=first[1])


def _of_volume(source: XraySource) -> XraySeries:
    """The slices of a volume."""
    pairs = [source.at(number).pixels_view() for number in range(image_count(source))]
    return XraySeries(len(pairs), images=tuple(image for image, _spacing in pairs), spacing=pairs[0][1])


def _one_file(source: XraySource) -> str:
    """The file that holds all images of a row, empty where there is none; raises InputError for a node without any."""
    if source.path:
        return source.path
    path, frame = source.at(0).file()
    if not path or frame is None:
        return ""
    last = source.at(image_count(source) - 1).file()[0]
    # One file an image: the first and the last are different ones.
    return path if last == path else ""


def _files_of(source: XraySource) -> tuple[str, ...]:
    """The files of a sequence with one an image; none where one is missing."""
    found = [source.at(number).file()[0] for number in range(image_count(source))]
    return tuple(found) if all(found) and len(set(found)) == len(found) else ()


def gap_after(source: XraySource) -> int | None:
    """Number of the first image after which others are missing, by the times of a sequence; None where none is."""
    steps = np.diff(_times(source.image))
    gaps = np.flatnonzero(steps > MOST_STEPS * np.median(steps)) if len(steps) else steps
    return int(gaps[0]) if len(gaps) else None


def _rate_of_index(node: slicer.vtkMRMLNode | None) -> float | None:
    """Images per second by the times at which a sequence has them: the usual step counts, not a gap."""
    steps = np.diff(_times(node))
    if not len(steps):
        return None
    even = steps[steps <= MOST_STEPS * np.median(steps)]
    # Times as decimal numbers are no more exact than this.
    return float(f"{1 / even.mean():.9g}") if len(even) and even.mean() > 0 else None


def _times(node: slicer.vtkMRMLNode | None) -> np.ndarray:
    """When a sequence has its images, s (N,); none where its index is not a time."""
    if node is None or not node.IsA("vtkMRMLSequenceNode"):
        return np.zeros(0)
    unit = _SECONDS.get((node.GetIndexUnit() or "").strip().lower())
    if unit is None or (node.GetIndexName() or "").strip().lower() != "time":
        return np.zeros(0)
    values = [node.GetNthIndexValue(number) for number in range(node.GetNumberOfDataNodes())]
    try:
        return unit * np.array(values, dtype=np.float64)
    except ValueError:
        return np.zeros(0)


@functools.lru_cache(maxsize=64)
def _in_file(path: str, _age: float) -> tuple[int, float | None]:
    """Number of images in a file, and frames per second that it states; (1, None) for what cannot be read."""
    try:
        return _counted(Path(path))
    except (PolyPoseError, OSError, RuntimeError):
        return 1, None


def _counted(path: Path) -> tuple[int, float | None]:
    from PolyPoseLib.io.tracking.cameras import stated_rate as rate_of_tags
    from PolyPoseLib.io.tracking.image_run import TIFF_ENDINGS, open_file
    from PolyPoseLib.io.xray.plain import ending_of

    ending = ending_of(path)
    if ending and not path.name.lower().endswith(TIFF_ENDINGS):
        import SimpleITK as sitk

        reader = sitk.ImageFileReader()
        reader.SetFileName(str(path))
        reader.ReadImageInformation()
        return (reader.GetSize()[2] if reader.GetDimension() == 3 else 1), None
    run = open_file(path, path.name)
    return run.count, rate_of_tags(run.tags())


def _age(path: str) -> float:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:
        return 0.0
