"""Targets: data sets of benchmarks, each read as a benchmark reads a case of it."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from dicom_postures import write_dicom
from fuzz_subject import Subject, in_archive, whole_file
from simulation_phantom import NAMES, phantom
from two_postures import C5, SHAPE, SKULL, TRACHEA, grids, scan, write_image

from PolyPoseLib.io.benchmark.readers import READERS
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

PIXELS = 24
"""Of X-rays that are rendered: every change renders them again."""

COARSER = 2.5
"""Than the scans of the readers' own tests."""

SIDE_PX, PITCH_MM = 240, 1.2
"""Of the small DeepFluoro: about the real detector's 300 mm."""


def deepfluoro_file(folder: Path) -> list[Subject]:
    """The HDF5 file."""
    with _small_detector() as replica:
        path = replica.write_hdf5(folder / "fluoro.h5", frames=(3, 9, 10))
    return [whole_file(path, lambda each: _read("deepfluoro", each, ""))]


def deepfluoro_folder(folder: Path) -> list[Subject]:
    """The folder of NIfTI, DICOM and poses."""
    with _small_detector() as replica:
        place = replica.write_folder(folder / "data", frames=(9, 10))

    def read() -> Any:
        return _read("deepfluoro", folder / "data", "")

    pose = place / "xrays/010.pt"
    pickled, packed = in_archive(pose, "data.pkl")
    return [
        *(_unpacked(place / name, read) for name in ("volume.nii.gz", "mask.nii.gz")),
        *(_inside(place / name, read) for name in ("xrays/010.dcm", "xrays/010.pt")),
        Subject(pose, pickled, read, packed),
    ]


def headneck(folder: Path) -> list[Subject]:
    """Two CTs of a patient with label maps, and two as DICOM with structure sets."""
    plain, drawn = folder / "plain", folder / "drawn"
    paths = []
    for number, (hu, labels, affine) in enumerate(_scans(), start=1):
        place = plain / "HN_P001"
        write_image(hu, affine, place / f"ct_{number}.nii.gz")
        write_image(labels, affine, place / f"labels_{number}.nii.gz")
        paths += [place / f"ct_{number}.nii.gz", place / f"labels_{number}.nii.gz"]
    names = {"Skull": SKULL, "C5": C5, "Trachea": TRACHEA}
    files = [
        write_dicom(drawn / "HN_P002", is_second, date, names, COARSER)
        for is_second, date in ((False, "20091022"), (True, "20100301"))
    ]

    def read_plain() -> Any:
        return _read("headneck", plain, "2x30")

    def read_drawn() -> Any:
        return _read("headneck", drawn, "2x30")

    return [
        *(_unpacked(path, read_plain) for path in paths),
        *(_inside(path, read_drawn, "HN_P002") for pair in files for path in pair),
    ]


def thoraxcbct(folder: Path) -> list[Subject]:
    """The JSON of pairs, the images and their labels."""
    renumbered = np.zeros(256, np.uint8)
    renumbered[[SKULL, C5, TRACHEA]] = 36, 95, 5
    paths = []
    for which, (hu, labels, affine) in enumerate(_scans()):
        name = f"ThoraxCBCT_0003_{which:04d}.nii.gz"
        write_image(hu, affine, folder / "imagesTr" / name)
        write_image(renumbered[labels], affine, folder / "labelsTr" / name)
        paths += [folder / "imagesTr" / name, folder / "labelsTr" / name]
    pair = {
        "fixed": "./imagesTr/ThoraxCBCT_0003_0001.nii.gz",
        "moving": "./imagesTr/ThoraxCBCT_0003_0000.nii.gz",
    }
    listed = folder / "ThoraxCBCT_dataset.json"
    listed.write_text(
        json.dumps({"name": "ThoraxCBCT", "training_paired_images": [pair], "registration_val": []})
    )

    def read() -> Any:
        return _read("thoraxcbct", folder, "2x30")

    return [_inside(listed, read), *(_unpacked(path, read, "0003-1") for path in paths)]


def simulated(folder: Path) -> list[Subject]:
    """A case that ``polypose simulate`` wrote."""
    ct, structures, source = phantom(spacing=(9.0, 9.0, 9.0))
    options = SimulationOptions(projector="sum", node_mm=9.0, pad_mm=10.0)
    cameras = view_cameras(ct, (0.0, 40.0), pixels=40, detector_mm=350)
    made = simulate_case(ct, structures, None, cameras, 3, options, "pelvis", source)
    numbers = {name: [10 * number] for number, name in enumerate(NAMES, start=1)}
    case = folder / "data/case_01"
    case.parent.mkdir()
    write_case(made, case, numbers, {5: "liver"}, image_format="nifti")

    def read() -> Any:
        return [_read("simulated", case.parent, "own"), _read("simulated", case.parent, "2x30")]

    paths = [path for path in sorted(case.rglob("*")) if path.is_file()]
    return [(_unpacked if path.name.endswith(".gz") else _inside)(path, read) for path in paths]


def _read(dataset: str, root: Path, views: str) -> Any:
    """Every case of every subject, by the plain ray sum."""
    reader = READERS[dataset]
    with (
        patch("PolyPoseLib.simulation.independent_projector.rtk_available", lambda: False),
        patch("PolyPoseLib.io.benchmark.two_scans.PIXELS", PIXELS),
    ):
        return [list(reader.cases(root, name, [views] if views else [])) for name in reader.subjects(root)]


def _inside(path: Path, read: Callable[[], Any], part_of: str = "") -> Subject:
    """A file that is read with others."""
    return Subject(path, path.read_bytes(), read, part_of=part_of)


def _unpacked(path: Path, read: Callable[[], Any], part_of: str = "") -> Subject:
    """What a gzip file holds: a change of the packed bytes is nearly always only a wrong checksum."""
    whole = gzip.decompress(path.read_bytes())
    return Subject(path, whole, read, lambda each: gzip.compress(each, 1), part_of)


@contextmanager
def _small_detector() -> Iterator[Any]:
    """The replica of DeepFluoro with a smaller detector."""
    pytest.importorskip("h5py")
    import fluoro_replica

    length, middle = -fluoro_replica.DISTANCE / PITCH_MM, (SIDE_PX - 1) / 2
    intrinsics = np.array([[length, 0, middle], [0, length, middle], [0, 0, 1.0]])
    with patch.multiple(fluoro_replica, SIZE=SIDE_PX, PITCH=PITCH_MM, K=intrinsics):
        yield fluoro_replica


def _scans() -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(HU, labels, affine) of both postures on coarse grids."""
    found = []
    for is_second, affine in zip((False, True), grids(), strict=True):
        coarse = affine.copy()
        coarse[:3, :3] *= COARSER
        shape = tuple(int(np.ceil(size / COARSER)) for size in SHAPE)
        hu, labels = scan(is_second, coarse, shape)
        found.append((hu, labels, coarse))
    return found
