"""The benchmark's cases: public CTs, the structures that move in them, and where a case is kept on disk."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.structures import structures_from_labels
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.cases import write_case
from PolyPoseLib.io.samples import CT_FILE, LABELS_FILE, fetch_sample, sample_named
from PolyPoseLib.io.volumes import read_ct, read_volume
from PolyPoseLib.simulation.simulate import (
    SimulationOptions,
    arc_angles,
    simulate_case,
    structures_centre,
    view_cameras,
)

STRUCTURES: dict[str, dict[str, list[int]]] = {
    "pelvis": {
        "pelvis": [25, 26, 77, 78],
        "femur_left": [75],
        "femur_right": [76],
        "vertebrae_L5": [27],
        "vertebrae_L4": [28],
        "vertebrae_L3": [29],
        "vertebrae_L2": [30],
        "vertebrae_L1": [31],
    },
    "chest": {
        "thoracic_spine": [*range(32, 44)],
        "ribs_left": [*range(92, 104)],
        "ribs_right": [*range(104, 116)],
        "sternum": [116],
        "clavicle_left": [73],
        "clavicle_right": [74],
        "scapula_left": [71],
        "scapula_right": [72],
        "humerus_left": [69],
        "humerus_right": [70],
        "lumbar_spine": [*range(29, 32)],
    },
}
"""TotalSegmentator v2 labels of every structure; the first one is the anchor."""

DISTANCES_MM = {"pelvis": (1020.0, 780.0), "chest": (1200.0, 1000.0)}
"""Source to detector and source to isocenter; with these a detector of 430 mm shows all structures from the front."""

VIEWS = {"2x30": (2, 30.0), "3x120": (3, 120.0)}
"""Number of views and the arc over which they are spread, in degrees."""


def parse_views(text: str) -> tuple[int, float]:
    """Views and arc of a name such as 3x120; raises ValueError for any other."""
    count, arc = text.split("x")
    return int(count), float(arc)


def load_anatomy(name: str, groups: Mapping[str, list[int]] | None = None):
    """CT, structures, the full label map and its organs' names; groups: labels of other structures than STRUCTURES."""
    folder = fetch_sample(name)
    ct = read_ct(folder / CT_FILE)
    labels = read_volume(folder / LABELS_FILE)
    labels = Volume(labels.voxels.astype(np.int16), ct.affine)
    structures = structures_from_labels(labels, groups or STRUCTURES[name], ct)
    return ct, structures, labels, label_table(sample_named(name).label_table)


def case_folder(
    anatomy: str,
    views: str,
    seed: int,
    pixels: int,
    work: Path,
    options: SimulationOptions | None = None,
    name: str = "",
    groups: Mapping[str, list[int]] | None = None,
) -> Path:
    """The folder of one case, simulated unless it is there already.

    name: of options that are not the usual ones; groups: labels of other structures than STRUCTURES, anchor first.
    """
    options = options or SimulationOptions()
    folder = work / "-".join(part for part in (anatomy, views, f"{pixels}px", f"seed{seed}", name) if part)
    groups = {structure: list(numbers) for structure, numbers in (groups or STRUCTURES[anatomy]).items()}
    settings = json.dumps({"options": repr(options), "groups": groups})
    stamp = folder / "settings.json"
    if stamp.is_file() and stamp.read_text() == settings:
        return folder
    if folder.exists():
        raise SystemExit(f"{folder} holds a case of other settings or an unfinished one: remove it.")
    ct, structures, labels, organ_names = load_anatomy(anatomy, groups)
    count, arc = parse_views(views)
    isocenter = structures_centre(structures, ct.affine)
    to_detector, to_isocenter = DISTANCES_MM[anatomy]
    cameras = view_cameras(
        ct,
        arc_angles(count, arc),
        pixels,
        source_to_detector_mm=to_detector,
        source_to_isocenter_mm=to_isocenter,
        isocenter=isocenter,
    )
    case = simulate_case(
        ct,
        structures,
        cameras=cameras,
        seed=seed,
        options=options,
        source_labels=labels,
        organ_names=organ_names,
    )
    write_case(case, folder, groups, organ_names, source_to_detector_mm=to_detector)
    stamp.write_text(settings)
    return folder


def fused_study(folder: Path) -> dict[str, str]:
    """Write study_rigid.json, in which all moving structures are one body; returns {structure: its body}."""
    fields = json.loads((folder / "study.json").read_text())
    moving = [name for name in fields["structures"] if name != fields["anchor"]]
    fields["structures"], stands_for = fuse(fields["structures"], {"body": moving})
    (folder / "study_rigid.json").write_text(json.dumps(fields, indent=1))
    return stands_for


def study_of_true_cameras(folder: Path, cameras: Sequence[Camera]) -> Path:
    """Write study_true_cameras.json, in which every camera is known and true; returns its path."""
    fields = json.loads((folder / "study.json").read_text())
    give_true_cameras(fields, cameras)
    path = folder / "study_true_cameras.json"
    path.write_text(json.dumps(fields, indent=1))
    return path


def give_true_cameras(fields: dict, cameras: Sequence[Camera]) -> None:
    """Make every camera in a study's fields known and true."""
    for xray, camera in zip(fields["xrays"], cameras, strict=True):
        xray |= {"camera": "known", "extrinsic": camera.extrinsic.tolist()}


def fuse(
    structures: Mapping[str, list[int]], groups: Mapping[str, list[str]]
) -> tuple[dict[str, list[int]], dict[str, str]]:
    """Structures {name: labels} with those of each group {body: names} as one, and {structure: its body}."""
    body_of = {name: body for body, names in groups.items() for name in names}
    stands_for = {name: body_of.get(name, name) for name in structures}
    fused: dict[str, list[int]] = {}
    for name, labels in structures.items():
        fused.setdefault(stands_for[name], []).extend(labels)
    return fused, stands_for
