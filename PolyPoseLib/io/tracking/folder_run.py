"""A folder of images, one file each, in the natural order of their names or of DICOM's instance numbers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.io.dicom import looks_like_dicom, open_dicom, quiet_pydicom, raw_value, read_dataset
from PolyPoseLib.io.native_output import native_output_logged
from PolyPoseLib.io.readers import reader_for
from PolyPoseLib.io.tracking.image_run import ImageRun, image_of, open_file, require_index
from PolyPoseLib.io.tracking.tiff_run import other_size
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.pixels import stored_pixels
from PolyPoseLib.io.xray.plain import ending_of, read_plain
from PolyPoseLib.io.xray.tags import XrayTags
from PolyPoseLib.io.xray.values import PixelValues, refuse_small, rescaled, values_of_dicom, values_of_plain
from PolyPoseLib.io.xray.video import VIDEO_ENDINGS

MAX_FILES = 200_000
"""More files in a folder are refused."""

_HEADER_TAGS = ("Rows", "Columns", "InstanceNumber", "NumberOfFrames", "SeriesInstanceUID")


def open_folder(path: Path, where: str) -> ImageRun:
    """Open a folder of images; a single file of several images in it is opened by itself.

    Raises
    ------
    InputError
        It holds no image, images of several kinds, sizes or series, or too many.

    """
    files, others = _images_in(path, where)
    kinds = sorted({ending_of(each) or "DICOM" for each in files})
    if len(kinds) > 1:
        raise InputError(
            f"{where} holds images of several kinds ({', '.join(kinds)}); give a folder that holds one camera's images "
            "alone."
        )
    if len(files) == 1:
        return open_file(files[0], f"{where}: {files[0].name}")
    if kinds[0] in VIDEO_ENDINGS:
        raise InputError(f"{where} holds {len(files)} films; name one of them.")
    warnings = ()
    if others:
        warnings = (f"{others} of the folder's files are no images and were left out.",)
    return FolderRun(files, where, warnings)


def _images_in(path: Path, where: str) -> tuple[list[Path], int]:
    """Images of a folder in the natural order of their names, and how many other files it has; raises InputError."""
    names: list[str] = []
    for each in path.iterdir():
        if not each.name.startswith(".") and not each.is_dir():
            names.append(each.name)
        if len(names) > MAX_FILES:
            raise InputError(f"{where} holds more than {MAX_FILES} files; give a folder of one sequence.")
    found = [path / name for name in sorted(names, key=natural)]
    images = [each for each in found if each.is_file() and (ending_of(each) or looks_like_dicom(each))]
    if not images:
        raise InputError(
            f"{where} holds no image; give a folder of PNG, TIFF, JPEG, NIfTI, NRRD or DICOM files, one an image."
        )
    return images, len(found) - len(images)


def natural(name: str) -> tuple[tuple[int, int, str], ...]:
    """A key that sorts names as people do: image9 before image10."""
    parts = re.findall(r"[0-9]+|[^0-9]+", name)
    key = ((0, int(part), "") if part[0] in "0123456789" else (1, 0, part.lower()) for part in parts)
    return (*key, (1, 0, name))


class FolderRun:
    """Files of one image each.

    Parameters
    ----------
    files
        In the natural order of their names, all of one kind.
    where
        Opening of the sentences of errors.
    warnings
        What is odd about the folder.

    Raises
    ------
    InputError
        Images of different sizes or series, or a file that cannot be read.

    """

    def __init__(self, files: list[Path], where: str, warnings: tuple[str, ...] = ()) -> None:
        self.where, self.warnings = where, warnings
        self._dicom = not ending_of(files[0])
        self._files = _in_order(files, where) if self._dicom else files
        self.count = len(files)
        if not self._dicom:
            self._require_one_size()

    def tags(self) -> XrayTags | None:
        """Attributes of the first image, where it is DICOM; raises InputError."""
        return XrayTags(open_dicom(self._files[0], self._name(0)), 0) if self._dicom else None

    def decided(self, index: int, given: XrayFields, notes: Notes) -> PixelValues:
        """Values of one image with meaning and mask, as of a single X-ray; raises InputError."""
        require_index(index, self.count, self.where)
        if not self._dicom:
            return values_of_plain(self._files[index], None, given, notes)
        return self._of_dicom(index, lambda tags: values_of_dicom(tags, given, notes))

    def values(self, index: int, given: XrayFields) -> np.ndarray:
        """Values of one image (H, W) float32; raises InputError."""
        require_index(index, self.count, self.where)
        if not self._dicom:
            return read_plain(self._files[index], self._name(index))[0]
        notes = Notes(self._name(index))
        return self._of_dicom(index, lambda tags: rescaled(tags, stored_pixels(tags, notes), given, notes)[0])

    def _of_dicom(self, index: int, read):
        """What a function makes of one DICOM file; whatever a damaged file breaks becomes one sentence."""
        where = self._name(index)
        dataset = open_dicom(self._files[index], where)
        try:
            with quiet_pydicom():
                refuse_small((dataset.Rows, dataset.Columns), Notes(where))
                return read(XrayTags(dataset, 0))
        except InputError:
            raise
        except MemoryError as error:
            raise memory_ran_out(where) from error
        except Exception as error:
            raise InputError(
                f"{where} is damaged: its DICOM attributes contradict each other; copy the file again."
            ) from error

    def _name(self, index: int) -> str:
        """Opening of sentences about one image."""
        return f"{image_of(self.where, index)}, {self._files[index].name},"

    @native_output_logged()
    def _require_one_size(self) -> None:
        """Refuse images whose headers state different sizes; raises InputError."""
        first: tuple[int, ...] = ()
        for index, path in enumerate(self._files):
            reader = reader_for(path, self._name(index))
            try:
                reader.ReadImageInformation()
            except RuntimeError:
                raise InputError(
                    f"{self._name(index)} cannot be read: it is damaged or not what its name says; export it again."
                ) from None
            size = tuple(side for side in reader.GetSize() if side > 1)[::-1]
            if len(size) != 2:
                raise InputError(
                    f"{self._name(index)} is no single two-dimensional image; give one file an image."
                )
            first = first or size
            if size != first:
                raise other_size(self.where, index, size, first)


def _in_order(files: list[Path], where: str) -> list[Path]:
    """DICOM files by their instance numbers where these are all different, else as they come; raises InputError."""
    numbers: list[int | None] = []
    first: tuple[object, ...] = ()
    series: set[str] = set()
    for index, path in enumerate(files):
        name = f"{image_of(where, index)}, {path.name},"
        with quiet_pydicom():
            try:
                header = read_dataset(
                    path, force=True, stop_before_pixels=True, specific_tags=list(_HEADER_TAGS)
                )
            except InputError as error:
                raise InputError(f"{name} {error}") from None
            except Exception:
                raise InputError(
                    f"{name} is damaged: its DICOM header cannot be read; copy it again."
                ) from None
        found = {tag: raw_value(tag, header) for tag in _HEADER_TAGS}
        if str(found["NumberOfFrames"] or 1).strip() not in ("1", ""):
            raise InputError(f"{name} holds several frames, one of several files; name that file alone.")
        size = (found["Rows"], found["Columns"])
        if not all(isinstance(side, int) for side in size):
            raise InputError(f"{name} does not say how many rows and columns it has; export it again.")
        first = first or size
        if size != first:
            raise other_size(where, index, (int(size[0]), int(size[1])), (int(first[0]), int(first[1])))  # type: ignore[arg-type]
        series.add(str(found["SeriesInstanceUID"]))
        try:
            numbers.append(int(found["InstanceNumber"]))
        except (TypeError, ValueError):
            numbers.append(None)
    if len(series) > 1:
        raise InputError(
            f"{where} holds {len(series)} DICOM series; give a folder of one camera's series alone."
        )
    if None in numbers or len(set(numbers)) < len(numbers):
        return files
    return [path for _, path in sorted(zip(numbers, files, strict=True))]  # type: ignore[type-var]
