"""Poses and X-rays over time as Slicer's own sequences, all played by one Sequence Browser.

Slicer keeps sequences in step by index value. X-rays of the scene are sequences already, often with a browser of their
own (XA that Slicer loaded), but their index is a time, and their cameras may have begun earlier. They could follow in
three ways: their own browser, moved by an observer, which also moves what a person may be looking at elsewhere; these
very sequences in our browser, with index values rewritten to the camera's offset; or sequences of our own, numbered in
frames, whose nodes share the pixels of the originals. The last is done here: it leaves the originals alone, copies no
pixel, and is played by Slicer itself. Such a sequence is not saved, as that would write every pixel twice; it is made
again from the original.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import slicer
import vtk
from slicer.i18n import tr as _
from vtkmodules.util.numpy_support import numpy_to_vtk

from PolyPoseLib.errors import InputError

from .frames import to_vtk
from .names import free_name

INDEX = "frame"
"""Name of the sequences' index; it has no unit."""

MOST_FPS = 30.0
"""Faster sequences are played in slow motion, as in the overlay video."""


def pose_sequence(name: str, numbers: Sequence[int], matrices: np.ndarray) -> slicer.vtkMRMLSequenceNode:
    """A sequence of linear transforms, matrices (F, 4, 4) RAS to parent at frames `numbers`."""
    sequence = _new_sequence(name)
    transform = slicer.vtkMRMLLinearTransformNode()
    transform.SetName(name)
    was = sequence.StartModify()
    for number, matrix in zip(numbers, matrices, strict=True):
        transform.SetMatrixTransformToParent(to_vtk(matrix))
        sequence.SetDataNodeAtValue(transform, str(int(number)))
    sequence.EndModify(was)
    return sequence


def label_as_frames(sequence: slicer.vtkMRMLSequenceNode) -> None:
    """Call the index frames: Slicer's file of transform sequences keeps neither its name nor its unit."""
    sequence.SetIndexName(INDEX)
    sequence.SetIndexUnit("")


def image_sequence(
    name: str, source: slicer.vtkMRMLNode, first: int, numbers: Sequence[int], plane: np.ndarray
) -> slicer.vtkMRMLSequenceNode:
    """The X-rays of one camera at frames `numbers`, which share the source's pixels and lie on the camera's detector.

    Parameters
    ----------
    name : str
        Of the sequence.
    source : vtkMRMLSequenceNode or vtkMRMLVolumeNode
        Of images, or of slices that are images.
    first : int
        Image of frame 0.
    numbers : sequence of int
        Frames; those of which there is no image show none, rather than that of another frame.
    plane : (4, 4) ndarray
        From an image's (i, j, 0, 1) to RAS mm.

    """
    sequence = _new_sequence(name)
    sequence.SetSaveWithScene(False)
    images = _Images(source)
    empty = images.kind()
    empty.SetName(name)
    was = sequence.StartModify()
    for number in numbers:
        node = sequence.SetDataNodeAtValue(empty, str(int(number)))
        node.SetIJKToRASMatrix(to_vtk(plane))
        # SetDataNodeAtValue would have copied the pixels.
        node.SetAndObserveImageData(images.at(first + int(number)))
    sequence.EndModify(was)
    return sequence


def has_images(source: slicer.vtkMRMLNode) -> bool:
    """Whether a node holds an image: one whose file was not found when a scene was opened does not."""
    return next(iter(_Images(source)), None) is not None


def image_size(source: slicer.vtkMRMLNode) -> tuple[int, int]:
    """Columns and rows of the images of a sequence or volume node; raises InputError where it holds none."""
    image = next(iter(_Images(source)), None)
    if image is None:
        raise InputError(
            _("'{name}' holds no images: choose a sequence of X-rays, or a volume.").format(
                name=source.GetName()
            )
        )
    columns, rows, _slices = image.GetDimensions()
    return columns, rows


def new_browser(name: str, frames_per_second: float) -> slicer.vtkMRMLSequenceBrowserNode:
    """A browser without sequences yet."""
    browser = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceBrowserNode", free_name(name))
    browser.SetPlaybackRateFps(min(frames_per_second, MOST_FPS))
    browser.SetIndexDisplayFormat("%.0f")
    return browser


def play(
    browser: slicer.vtkMRMLSequenceBrowserNode,
    sequence: slicer.vtkMRMLSequenceNode,
    proxy: slicer.vtkMRMLNode,
    shared: bool = False,
) -> None:
    """Let a browser show a sequence in a proxy node.

    shared: whether the proxy shares what the sequence holds, as images do. Slicer calls that saving changes. Poses are
    copied instead, so that moving a bone by hand changes what is seen, and not what was tracked.
    """
    was = browser.StartModify()  # else Slicer makes a proxy of its own in between
    browser.AddSynchronizedSequenceNode(sequence)
    browser.AddProxyNode(proxy, sequence, False)
    browser.SetSaveChanges(sequence, shared)
    browser.SetOverwriteProxyName(sequence, False)
    if shared:
        # What is recorded besides has no X-ray; else Slicer would put a copy of one into the sequence.
        browser.SetMissingItemMode(sequence, browser.MissingItemIgnore)
    browser.EndModify(was)


def frame_numbers(sequence: slicer.vtkMRMLSequenceNode) -> list[int]:
    """The frames of a sequence."""
    count = sequence.GetNumberOfDataNodes()
    return [round(float(sequence.GetNthIndexValue(number))) for number in range(count)]


def _new_sequence(name: str) -> slicer.vtkMRMLSequenceNode:
    sequence = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSequenceNode", free_name(name))
    sequence.SetIndexType(sequence.NumericIndex)
    label_as_frames(sequence)
    return sequence


class _Images:
    """The images that a node holds, none of them copied."""

    def __init__(self, source: slicer.vtkMRMLNode) -> None:
        self._source = source
        self._stack = not source.IsA("vtkMRMLSequenceNode")
        if self._stack and not source.IsA("vtkMRMLVolumeNode"):
            raise InputError(
                _("'{name}' is not an image: choose a volume or a sequence of volumes.").format(
                    name=source.GetName()
                )
            )

    def __iter__(self) -> Iterator[vtk.vtkImageData]:
        count = 1 if self._stack else self._source.GetNumberOfDataNodes()
        return (image for number in range(count) if (image := self.at(number)) is not None)

    def kind(self) -> slicer.vtkMRMLVolumeNode:
        """An empty node of the images' class."""
        node = self._source if self._stack else self._source.GetNthDataNode(0)
        empty = node.CreateNodeInstance()
        empty.UnRegister(None)
        return empty

    def at(self, number: int) -> vtk.vtkImageData | None:
        """One image, or None where there is none."""
        if self._stack:
            return _slice_of(self._source, number)
        if not 0 <= number < self._source.GetNumberOfDataNodes():
            return None
        node = self._source.GetNthDataNode(number)
        return node.GetImageData() if node is not None and node.IsA("vtkMRMLVolumeNode") else None


def _slice_of(volume: slicer.vtkMRMLVolumeNode, number: int) -> vtk.vtkImageData | None:
    """One slice of a stack, on the stack's own memory."""
    whole = volume.GetImageData()
    if whole is None or not 0 <= number < whole.GetDimensions()[2]:
        return None
    columns, rows, slices = whole.GetDimensions()
    if slices == 1:
        return whole
    values = slicer.util.arrayFromVolume(volume)[number]
    scalars = numpy_to_vtk(values.reshape(columns * rows, -1).squeeze(), deep=False)
    scalars.SetName("ImageScalars")
    image = vtk.vtkImageData()
    image.SetDimensions(columns, rows, 1)
    image.GetPointData().SetScalars(scalars)
    return image
