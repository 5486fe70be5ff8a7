"""NIfTI and Analyze images in two files, header and voxels, which the toolkit finds by each other's names."""

from __future__ import annotations

from pathlib import Path

HEADERS = (".hdr", ".hdr.gz")
VOXELS = (".img", ".img.gz")


def pair_of(path: Path) -> list[Path]:
    """Every file that may be the header or the voxels of a pair, whichever half the path names, in any spelling.

    Empty when the name is none of a pair.
    """
    name = path.name.lower()
    ending = next((each for each in (*HEADERS, *VOXELS) if name.endswith(each)), None)
    if ending is None:
        return []
    stem = name.removesuffix(ending)
    names = {stem + each for each in (*HEADERS, *VOXELS)}
    return sorted(file for file in path.parent.iterdir() if file.name.lower() in names)
