"""A folder of one mask per structure, TotalSegmentator's default output, as one label map with names."""

from __future__ import annotations

import os
from itertools import islice
from pathlib import Path

from PolyPoseLib.data.segmentation import Segmentation
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.images import read_scalar_image
from PolyPoseLib.io.label_merge import LabelMerge

MAX_MASKS = 500
"""More are refused: TotalSegmentator writes 117, and a study may have a thousand structures of several labels."""

MAX_ENTRIES = 20_000
"""A folder with more entries is not searched for masks."""

_ENDINGS = (".nii.gz", ".nii", ".nrrd", ".mha")
"""Of masks; other files in the folder, such as statistics and pictures, are passed over."""


def is_mask_folder(path: Path) -> bool:
    """Whether a folder holds images, as no DICOM folder does; raises InputError for a huge one."""
    return path.is_dir() and bool(_masks(path))


def read_mask_folder(path: Path) -> Segmentation:
    """Read a folder of masks; their files' names, without endings, name the segments.

    Numbers are those of TotalSegmentator where all names are its, else they count the names in alphabetical order.  A
    voxel of several masks goes to the smallest of them, with a warning.

    Parameters
    ----------
    path
        The folder; every image in it is a mask on one grid: 0 outside, and one other value inside.

    Raises
    ------
    InputError
        Too many files, grids that differ, images that are no masks, or one that cannot be read; the sentence names the
        file and the fix.

    """
    files = _masks(path)
    if len(files) > MAX_MASKS:
        raise InputError(
            f"{path}: it holds {len(files)} images: give a folder with at most {MAX_MASKS} masks."
        )
    names = sorted(files)
    merge: LabelMerge | None = None
    grid: Volume | None = None
    for which, name in enumerate(names):
        mask = _read_mask(files[name])
        if grid is None or merge is None:
            merge, grid = LabelMerge(names, mask.shape), mask
        elif not mask.same_grid(grid):
            raise InputError(
                f"{files[name]}: it is on another grid than {files[names[0]].name}: give masks of one scan, "
                "all resampled to one grid."
            )
        merge.add(which, mask.voxels > 0)
    assert grid is not None and merge is not None
    return merge.segmentation(grid.affine, str(path))


def _masks(path: Path) -> dict[str, Path]:
    """{name: file} of the folder's images; raises InputError for too many entries, and names given twice."""
    files: dict[str, Path] = {}
    with os.scandir(path) as entries:
        found = [each.name for each in islice(entries, MAX_ENTRIES + 1)]
    if len(found) > MAX_ENTRIES:
        raise InputError(
            f"{path}: it holds more than {MAX_ENTRIES} files: give a folder with one scan alone."
        )
    for file in sorted(found):
        ending = next((each for each in _ENDINGS if file.lower().endswith(each)), None)
        name = "" if ending is None else file[: -len(ending)].strip()
        if not name or file.startswith(".") or (path / file).is_dir():
            continue
        if name in files:
            raise InputError(f"{path}: {files[name].name} and {file} have one name: remove one of them.")
        files[name] = path / file
    return files


def _read_mask(path: Path) -> Volume:
    """A volume that is 0 outside; raises InputError for any that has several other values."""
    image = read_scalar_image(path)
    try:
        volume = Volume.from_sitk(image)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    low, high = volume.voxels.min(), volume.voxels.max()
    if not (low == 0 <= high or low == high == 1) or ((volume.voxels != 0) & (volume.voxels != high)).any():
        raise InputError(
            f"{path}: it is no mask: in a folder of masks every image is 0 outside of its structure and 1 inside; "
            "give a label map by its own name, and remove other images from the folder."
        )
    return volume
