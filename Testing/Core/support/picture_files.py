"""PNG and TIFF files written byte by byte, with what the toolkit cannot write: alpha, orientation, pages, filters."""

import struct
import zlib

import numpy as np

PNG_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}


def png(path, pixels, *chunks, filters=False):
    """Write pixels (H, W) or (H, W, C), uint8 or uint16; `filters` uses the one named "Up" in every second row."""
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    height, width, channels = pixels.shape
    rows = pixels.astype(pixels.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8)
    body = bytearray()
    for number, row in enumerate(rows):
        up = filters and number % 2 == 1
        body += bytes([2 if up else 0]) + (row - rows[number - 1] if up else row).tobytes()
    head = struct.pack(">IIBBBBB", width, height, 8 * pixels.dtype.itemsize, PNG_TYPES[channels], 0, 0, 0)
    parts = [(b"IHDR", head), *chunks, (b"IDAT", zlib.compress(bytes(body))), (b"IEND", b"")]
    content = b"".join(
        struct.pack(">I", len(each)) + kind + each + struct.pack(">I", zlib.crc32(kind + each))
        for kind, each in parts
    )
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + content)
    return path


def exif(orientation, order="<"):
    """A TIFF structure whose one field is the orientation, as EXIF holds it."""
    mark = b"II*\0" if order == "<" else b"MM\0*"
    field = struct.pack(order + "HHI", 274, 3, 1) + struct.pack(order + "HH", orientation, 0)
    return mark + struct.pack(order + "IH", 8, 1) + field + struct.pack(order + "I", 0)


def tiff(path, pages, orientation=None, order="<"):
    """Write uncompressed gray pages (H, W), each with the orientation where there is one."""
    content = bytearray((b"II*\0" if order == "<" else b"MM\0*") + b"\0\0\0\0")
    link = 4
    for page in pages:
        raw = page.astype(page.dtype.newbyteorder(order)).tobytes()
        at = len(content)
        content += raw + b"\0" * (len(raw) % 2)
        values = {
            256: page.shape[1], 257: page.shape[0], 258: 8 * page.dtype.itemsize, 259: 1, 262: 1,
            273: at, 277: 1, 278: page.shape[0], 279: len(raw),
        }  # fmt: skip
        if orientation:
            values[274] = orientation
        content[link : link + 4] = struct.pack(order + "I", len(content))
        content += struct.pack(order + "H", len(values))
        for tag in sorted(values):
            long = tag in (273, 279)
            value = struct.pack(
                order + ("I" if long else "HH"), *([values[tag]] if long else [values[tag], 0])
            )
            content += struct.pack(order + "HHI", tag, 4 if long else 3, 1) + value
        link = len(content)
        content += b"\0\0\0\0"
    path.write_bytes(bytes(content))
    return path


def stored_for(shown, orientation):
    """How pixels (H, W) are stored so that this orientation shows them, by the places of the first row and column."""
    right, bottom = orientation in (2, 3, 6, 7), orientation in (3, 4, 7, 8)
    # TIFF 6.0: from 5 on, stored rows run along the displayed columns.
    if orientation >= 5:
        view = shown[::-1] if bottom else shown
        view = view[:, ::-1] if right else view
        return np.ascontiguousarray(view.T)
    view = shown[::-1] if bottom else shown
    return np.ascontiguousarray(view[:, ::-1] if right else view)
