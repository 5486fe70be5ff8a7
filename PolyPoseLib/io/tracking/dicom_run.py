"""A multi-frame DICOM file, of which one frame's bytes at a time are in memory."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib.data.notes import Notes
from PolyPoseLib.errors import InputError, memory_ran_out
from PolyPoseLib.io.dicom import open_dicom, quiet_pydicom, refuse_short
from PolyPoseLib.io.tracking.image_run import image_of, require_index
from PolyPoseLib.io.xray.fields import XrayFields
from PolyPoseLib.io.xray.pixels import stored_pixels
from PolyPoseLib.io.xray.tags import XrayTags
from PolyPoseLib.io.xray.values import PixelValues, refuse_small, rescaled, values_of_dicom

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

DEFERRED_BYTES = 1 << 20
"""Larger values stay in the file."""

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
        header = open_dicom(path, where, defer_size=DEFERRED_BYTES)
        with quiet_pydicom():
            try:
                if (
                    header.file_meta.TransferSyntaxUID.is_deflated
                ):  # its places are those of the inflated bytes
                    header = open_dicom(path, where)
                self.count = max(int(header.get("NumberOfFrames") or 1), 1)
                refuse_small((header.Rows, header.Columns), Notes(where))
                self._place = _Place.of(header, path, self.count, where)
                if self._place is None:
                    refuse_short(header, where)
                else:
                    self._place.require_last(where)
                    del header[PIXEL_DATA]
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


class _Place:
    """Where the frames lie in the file."""

    def __init__(
        self, path: Path, start: int, vr: str, size: int | None, encapsulated: tuple[Any, ...]
    ) -> None:
        """Size: bytes of one frame of uncompressed pixels."""
        self.path, self.start, self.vr, self.size, self._encapsulated = path, start, vr, size, encapsulated

    @classmethod
    def of(cls, header: Dataset, path: Path, count: int, where: str) -> _Place | None:
        """Of pixels that stayed in the file, None for others; raises InputError where some are missing."""
        if PIXEL_DATA not in header:
            return None
        raw: Any = header.get_item(PIXEL_DATA, keep_deferred=True)
        if raw is None or getattr(raw, "value", None) is not None or not hasattr(raw, "value_tell"):
            return None
        syntax = header.file_meta.TransferSyntaxUID
        vr = str(raw.VR or "OW")
        if syntax.is_encapsulated:
            offsets = [header.get(name) for name in ("ExtendedOffsetTable", "ExtendedOffsetTableLengths")]
            extended = tuple(offsets) if all(offsets) else None
            return cls(path, raw.value_tell, "OB", None, (extended, count))
        bits = int(header.get("SamplesPerPixel") or 1) * int(header.BitsAllocated)
        if header.get("PhotometricInterpretation") == "YBR_FULL_422":
            bits = bits * 2 // 3
        whole = header.Rows * header.Columns * bits
        if bits < 8 or whole % 8:
            raise InputError(
                f"{where} packs pixels of {bits} bits, which is not read frame by frame; export it again."
            )
        held = min(raw.length, path.stat().st_size - raw.value_tell)
        if held < whole // 8 * count:
            raise InputError(
                f"{where} is cut short: its header promises {count} frames of {whole // 8} bytes and it holds {held} "
                "bytes; copy the file again."
            )
        return cls(path, raw.value_tell, vr, whole // 8, ())

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
