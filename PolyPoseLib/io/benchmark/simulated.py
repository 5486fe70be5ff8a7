"""Cases that ``polypose simulate`` wrote, of which everything is known."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.evaluation.benchmark.table_rows import OWN
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.benchmark import view_sets as sets
from PolyPoseLib.io.benchmark.places import (
    entries,
    files_below,
    folders,
    inside,
    named_subject,
    require_root,
    subject_name,
)
from PolyPoseLib.io.benchmark.two_scans import Scene, TwoScans
from PolyPoseLib.io.benchmark.view_sets import ViewSet, view_sets
from PolyPoseLib.io.cases import STUDY_FILE, TRUTH_FOLDER
from PolyPoseLib.io.cohort.rows import RESULT
from PolyPoseLib.io.studies import load_study
from PolyPoseLib.io.truths import TRUTH_FILE, load_truth

DATASET = "simulated"
WHERE = (
    f"a folder that polypose simulate wrote ({STUDY_FILE}, and {TRUTH_FOLDER}/{TRUTH_FILE}), or a folder of such "
    "folders"
)
_WORDS = "case|seed|simulated|sim|pelvis|chest|thorax|head|neck|knee|breathing"
_KNOWN = rf"(?:{_WORDS})(?:[-_]?(?:{_WORDS}|[0-9]{{1,6}})|[-_][a-z](?![a-z])){{0,4}}"
"""Any other word may be a name: "case-doe"."""


def subjects(root: Path) -> list[str]:
    """Names of the cases' folders, or hashes of them; raises InputError for a folder without any."""
    return list(_cases(require_root(root, WHERE)))


def cases(root: Path, subject: str, views: Sequence[str]) -> Iterator[BenchmarkCase]:
    """A case of the folder's own X-rays ("own"), or of new ones of its true CT ("2x30"); raises InputError."""
    wanted = [(name, None if name == OWN else view_sets([name], DATASET)[0]) for name in views or (OWN,)]
    root = require_root(root, WHERE)
    folder = named_subject(_cases(root), subject, str(root))
    inside(folder, root)
    study = load_study(inside(folder / STUDY_FILE, root))
    truth = load_truth(inside(folder / TRUTH_FOLDER, root))
    if set(truth.names) != set(study.structures.names) or truth.anchor != study.anchor:
        raise InputError(
            f"{folder}: its truth is of other structures than its study: simulate the case again."
        )
    try:
        simulation = _Simulation.of(study, truth, subject)
        for _, each in wanted:
            yield simulation.own_case() if each is None else simulation.rendered(each)
    except InputError as error:
        raise InputError(f"{folder}: {error}") from error


def files(root: Path, subject: str) -> list[Path]:
    """Those in a case's folder but for results of registrations, which are kept there, too; raises InputError."""
    root = require_root(root, WHERE)
    folder = named_subject(_cases(root), subject, str(root))
    found = list(files_below(folder, root))
    results = {path.parent for path in found if path.name == RESULT} - {folder}
    return [path for path in found if results.isdisjoint(path.parents)]


def view_name(name: str) -> str:
    """The one spelling of a set of views, "own" included; raises InputError."""
    return OWN if name == OWN else sets.view_name(name, DATASET)


def _cases(root: Path) -> dict[str, Path]:
    """{name: folder} of the cases in a folder, or of the one that it is, sorted; raises InputError without any."""
    places = [root] if STUDY_FILE in entries(root) else folders(root)
    found = [each for each in places if (each / STUDY_FILE).is_file()]
    if not found:
        raise InputError(f"{root}: there is no {STUDY_FILE} in it or in its folders: give {WHERE}.")
    for each in found:
        if not (each / TRUTH_FOLDER / TRUTH_FILE).is_file():
            raise InputError(
                f"{each}: there is no {TRUTH_FOLDER}/{TRUTH_FILE} beside {STUDY_FILE}, so nothing could be scored: "
                f"give {WHERE}."
            )
    return dict(sorted((subject_name(each, _KNOWN), each) for each in found))


@dataclass(frozen=True, eq=False)
class _Labels:
    """Structures and organs of both postures, numbered alike: structures from 1, organs after them."""

    moving: Volume
    fixed: Volume
    structures: dict[str, tuple[int, ...]]
    organs: dict[str, tuple[int, ...]]

    @classmethod
    def of(cls, study: Study, truth: Truth) -> _Labels:
        """The truth's label maps put together; raises InputError for one of another CT."""
        structures = {name: (number,) for number, name in enumerate(truth.names, start=1)}
        organs: dict[str, tuple[int, ...]] = {}
        numbers = {}
        for number, name in sorted(truth.organ_names.items()):
            if truth.moving_organs is not None and name not in structures and name not in organs:
                numbers[number] = len(structures) + len(organs) + 1
                organs[name] = (numbers[number],)
        moving = resample_labels_onto(_joined(truth.moving_labels, truth.moving_organs, numbers), study.ct)
        fixed = _joined(truth.fixed_labels, truth.fixed_organs, numbers)
        for number, name in enumerate(truth.names, start=1):
            own = study.structures.mask(name)
            if np.count_nonzero(own & (moving.voxels == number)) < 0.9 * np.count_nonzero(own):
                raise InputError(
                    f'"{name}" lies elsewhere in its truth than in its study: simulate the case again.'
                )
        there = set(np.unique(moving.voxels).tolist())
        return cls(
            moving, fixed, structures, {name: n for name, n in organs.items() if there.intersection(n)}
        )


def _joined(structures: Volume, organs: Volume | None, numbers: dict[int, int]) -> Volume:
    """One label map of structures and, where they leave room, organs with new numbers."""
    voxels = np.asarray(structures.voxels, dtype=np.int32)
    if organs is not None and numbers:
        table = np.zeros(max(int(organs.voxels.max()), *numbers) + 1, dtype=np.int32)
        for old, new in numbers.items():
            table[old] = new
        voxels = np.where(voxels > 0, voxels, table[np.asarray(organs.voxels, dtype=np.int64)])
    return structures.with_voxels(voxels)


@dataclass(frozen=True, eq=False)
class _Simulation:
    """A simulated case that was read."""

    study: Study
    truth: Truth
    scene: Scene

    @classmethod
    def of(cls, study: Study, truth: Truth, subject: str) -> _Simulation:
        """Its CT and the true one of the X-rays' posture, which are in one world already; raises InputError."""
        labels = _Labels.of(study, truth)
        scans = TwoScans(
            dataset=DATASET,
            subject=subject,
            moving=study.ct,
            fixed=truth.fixed_ct,
            moving_labels=labels.moving,
            fixed_labels=labels.fixed,
            structures=labels.structures,
            organs=labels.organs,
            anchor=study.anchor,
            aligned=True,
        )
        return cls(study, truth, Scene.of(scans))

    def own_case(self) -> BenchmarkCase:
        """The case of the X-rays that were simulated, with their true cameras; raises InputError."""
        cameras, xrays = self.truth.cameras, self.study.xrays
        if len(cameras) != len(xrays):
            raise InputError(
                f"the study has {len(xrays)} X-rays, the truth {len(cameras)} cameras: simulate the case again."
            )
        given = [
            (_with_true_camera(xray, camera), camera) for xray, camera in zip(xrays, cameras, strict=True)
        ]
        views = ViewSet(f"{OWN}-{len(xrays)}x{_arc_deg(cameras):.0f}", tuple(map(_angle_deg, cameras)))
        return self._with_truth(self.scene.case(views, given))

    def rendered(self, views: ViewSet) -> BenchmarkCase:
        """The case of X-rays rendered anew from the true CT."""
        return self._with_truth(self.scene.case(views))

    def _with_truth(self, case: BenchmarkCase) -> BenchmarkCase:
        """A case with the field and the poses, too."""
        truth = dataclasses.replace(
            case.truth, field=self.truth.field, poses=dict(self.truth.fixed_to_moving)
        )
        return dataclasses.replace(case, truth=truth)


def _with_true_camera(xray: Xray, camera: Camera) -> Xray:
    """A simulated X-ray with its true camera; raises InputError when it is of another."""
    if xray.image.shape != (camera.height, camera.width) or xray.mirrored:
        raise InputError(f'"{xray.name}" does not fit its true camera: simulate the case again.')
    return dataclasses.replace(
        xray,
        intrinsics=camera.intrinsics,
        extrinsic=camera.extrinsic,
        camera="known",
        initial_radius=None,
        isocenter=None,
        rig=None,
        landmarks=None,
    )


def _angle_deg(camera: Camera) -> float:
    """Where the source stands: 0 in front of the patient, positive to the left."""
    return float(np.degrees(np.arctan2(-camera.axis[0], camera.axis[1])))


def _arc_deg(cameras: Sequence[Camera]) -> float:
    """The largest angle between two views."""
    axes = np.array([camera.axis for camera in cameras])
    return float(np.degrees(np.arccos(np.clip((axes @ axes.T).min(), -1, 1))))
