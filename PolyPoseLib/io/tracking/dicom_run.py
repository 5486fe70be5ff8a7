"""A multi-frame DICOM file, of which one frame's bytes at a time are in memory."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.io.dicom import PixelPlace, open_dicom_header, quiet_pydicom, refuse_short
from PolyPoseLib.io.tracking.image_run import image_of, require_index
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.pixels import stored_pixels
from PolyPoseLib.io.xray.tags import XrayTags
from PolyPoseLib.io.xray.values import PixelValues, refuse_small, rescaled, values_of_dicom

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

PIXEL_DATA = 0x7FE00010


class DicomRun:
    """The frames of one DICOM file.

    Parameters
    ----------
    path
        The file.
    where
        Opening of the sentences of errors.

    Raises
    ------
    InputError
        Not DICOM, not an X-ray, cut short, or without pixels.

    """

    warnings: tuple[str, ...] = ()

    def __init__(self, path: Path, where: str) -> None:
        self.path, self.where = path, where
        header, place = open_dicom_header(path, where)
        with quiet_pydicom():
            try:
                self.count = max(int(header.get("NumberOfFrames") or 1), 1)
                refuse_small((header.Rows, header.Columns), Notes(where))
                self._place: _Frames | None = None
                if place is None:
                    refuse_short(header, where)
                else:
                    self._place = _Frames.of(header, place, path, self.count, where)
                    self._place.require_last(where)
            except InputError:
                raise
            except Exception as error:
                raise InputError(_damaged(where)) from error
        self._header = header

    def tags(self) -> XrayTags:
        """Attributes of the first frame."""
        return XrayTags(self._header, 0)

    def decided(self, index: int, given: XrayFields, notes: Notes) -> PixelValues:
        """Values of one frame with meaning and mask, as of a single X-ray; raises InputError."""
        return self._read(index, lambda tags: values_of_dicom(tags, given, notes))

    def values(self, index: int, given: XrayFields) -> np.ndarray:
        """Values of one frame (H, W) float32; raises InputError."""
        notes = Notes(image_of(self.where, index))
        return self._read(index, lambda tags: rescaled(tags, stored_pixels(tags, notes), given, notes)[0])

    def _read(self, index: int, read: Any) -> Any:
        """What a function makes of one frame; whatever a damaged file breaks becomes one sentence."""
        require_index(index, self.count, self.where)
        where = image_of(self.where, index)
        try:
            with quiet_pydicom():
                tags = XrayTags(self._header, index)
                if self._place is not None:
                    tags.dataset, tags.frame = self._single(index), 0
                return read(tags)
        except InputError:
            raise
        except MemoryError as error:
            raise memory_ran_out(where) from error
        except Exception as error:
            raise InputError(_damaged(where)) from error

    def _single(self, index: int) -> Dataset:
        """The file as if it held this frame alone."""
        assert self._place is not None
        single = copy.copy(self._header)
        single.NumberOfFrames = 1
        single.add_new(PIXEL_DATA, self._place.vr, self._place.read(index))
        for table in ("ExtendedOffsetTable", "ExtendedOffsetTableLengths"):
            single.pop(table, None)
        return single


class _Frames:
    """Where the frames lie in the file."""

    def __init__(
        self, path: Path, start: int, vr: str, size: int | None, encapsulated: tuple[Any, ...]
    ) -> None:
        """Size: bytes of one frame of uncompressed pixels."""
        self.path, self.start, self.vr, self.size, self._encapsulated = path, start, vr, size, encapsulated

    @classmethod
    def of(cls, header: Dataset, place: PixelPlace, path: Path, count: int, where: str) -> _Frames:
        """Of a file with these attributes; raises InputError where pixels are missing."""
        if header.file_meta.TransferSyntaxUID.is_encapsulated:
            offsets = [header.get(name) for name in ("ExtendedOffsetTable", "ExtendedOffsetTableLengths")]
            extended = tuple(offsets) if all(offsets) else None
            return cls(path, place.start, "OB", None, (extended, count))
        bits = int(header.get("SamplesPerPixel") or 1) * int(header.BitsAllocated)
        if header.get("PhotometricInterpretation") == "YBR_FULL_422":
            bits = bits * 2 // 3
        whole = header.Rows * header.Columns * bits
        if bits < 8 or whole % 8:
            raise InputError(
                f"{where} packs pixels of {bits} bits, which is not read frame by frame; export it again."
            )
        held = min(place.length, path.stat().st_size - place.start)
        if held < whole // 8 * count:
            raise InputError(
                f"{where} is cut short: its header promises {count} frames of {whole // 8} bytes and it holds {held} "
                "bytes; copy the file again."
            )
        return cls(path, place.start, place.vr, whole // 8, ())

    def require_last(self, where: str) -> None:
        """Refuse a file that ends before its last frame, before hours are spent on the others; raises InputError."""
        if self.size is not None:
            return
        count = self._encapsulated[1]
        try:
            found = len(self.read(count - 1))
        except Exception:  # pydicom raises nearly every kind for what is not there
            found = 0
        if not found:
            raise InputError(
                f"{where} is cut short: its header promises {count} frames, the last of which is not there; copy the "
                "file again."
            )

    def read(self, index: int) -> bytes:
        """The pixel data of one frame, as a file of this frame alone would hold it."""
        with self.path.open("rb") as stream:
            if self.size is not None:
                stream.seek(self.start + index * self.size)
                content = stream.read(self.size)
                return content + b"\0" * (len(content) % 2)
            from pydicom.encaps import encapsulate, get_frame

            stream.seek(self.start)
            extended, count = self._encapsulated
            frame = get_frame(stream, index, extended_offsets=extended, number_of_frames=count)
            return encapsulate([frame])


def _damaged(where: str) -> str:
    """The sentence about a file whose attributes fit neither each other nor the pixels."""
    return f"{where} is damaged: its DICOM attributes contradict each other; copy the file again."
