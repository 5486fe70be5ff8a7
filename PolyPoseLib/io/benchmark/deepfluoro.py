"""DeepFluoro: fluoroscopy of six cadavers' hips with the true pose of the pelvis and of both femurs in every frame.

Two frames of a cadaver are registered; the others are held out. The femurs do not lie alike in all frames, so a motion
that was found from two of them is not simply true of another. A femur is therefore scored in a held-out frame from
where that frame's camera would stand had the femur stayed as it was: the camera's true pose relative to the femur,
after the femur's true motion in the registered frames. For the pelvis, and wherever nothing moved, that is the frame's
own camera, as in the paper.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase, CaseTruth, HeldOutView
from PolyPoseLib.data.structures import Structures, structures_from_labels
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError, shown
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.geometry.rigid import orthonormalised, rigid_inverse
from PolyPoseLib.io.benchmark import deepfluoro_folder, deepfluoro_hdf5
from PolyPoseLib.io.benchmark.fluoro_frames import (
    ANCHOR,
    BIN,
    BONES,
    FluoroSubject,
    Frame,
    line_integrals,
    reduced_camera,
    shown_share,
)
from PolyPoseLib.io.benchmark.places import entries, files_below, inside, named_subject, require_root
from PolyPoseLib.io.benchmark.shadow_masks import ShadowMasks
from PolyPoseLib.simulation.label_shadows import label_shadows

DATASET = "deepfluoro"
WHERE = (
    "ipcai_2020_full_res_data.h5 of the JHU Data Archive (doi.org/10.7281/T1/IFSXNV), or the folder that holds it, or "
    "the folder of subject01 to subject06 with volume.nii.gz, mask.nii.gz and xrays"
)

PAPER = "paper"
"""Stands for the frames that the paper gave its methods."""

PAPER_FRAMES = {
    "subject01": (10, 9),
    "subject02": (29, 31),
    "subject03": (17, 22),
    "subject04": (0, 33),
    "subject05": (2, 47),
    "subject06": (9, 7),
}
SCORED_FRAMES = range(0, 37)
DOUBTED_FRAMES = {"subject01": (3, 50), "subject04": (2, 4)}
"""Whose published poses are questionable, as xvr has it from reports to the data set's author."""

_LEAST_SHARE = 0.8
_ODD_POSTURE_MM = 1.0
_FRAMES = re.compile(r"[0-9]{1,3}(?:\+[0-9]{1,3})*", re.ASCII)


def subjects(root: Path) -> list[str]:
    """Those of subject01 to subject06 that the copy holds; raises InputError when it is none."""
    return list(_source(Path(root))[1])


def cases(root: Path, subject: str, views: Sequence[str]) -> Iterator[BenchmarkCase]:
    """A case for the paper's two frames, or for each list of frames such as "10+9"; raises InputError."""
    root, places = _source(Path(root))
    place = named_subject(places, subject, str(root))
    wanted = [_frames(each, subject) for each in views or (PAPER,)]
    if root.is_file():
        fluoro = deepfluoro_hdf5.read_subject(root, place.name)
    else:
        fluoro = deepfluoro_folder.read_subject(place, root)
    try:
        structures = structures_from_labels(fluoro.labels, _bones(fluoro), fluoro.ct)
    except InputError as error:
        raise InputError(f"{root}, {subject}: {error}") from error
    for frames in wanted:
        doubted = [number for number in frames if number in DOUBTED_FRAMES.get(subject, ())]
        if doubted:
            raise InputError(
                f"{root}: frame {doubted[0]} of {subject} has a questionable published pose, so that nothing can be "
                f"scored by it: give other frames than {' and '.join(map(str, DOUBTED_FRAMES[subject]))}."
            )
        missing = [number for number in frames if number not in fluoro.frames]
        if missing:
            raise InputError(
                f"{root}: {subject} has no frame {missing[0]} but {len(fluoro.frames)} others: copy the file again, or "
                "give other frames."
            )
        try:
            yield _case(fluoro, subject, frames, structures)
        except InputError as error:
            raise InputError(f"{root}, {subject}: {error}") from error


def files(root: Path, subject: str) -> list[Path]:
    """The HDF5 file, or those in a subject's folder; raises InputError."""
    root, places = _source(Path(root))
    place = named_subject(places, subject, str(root))
    return [root] if root.is_file() else list(files_below(place, root))


def view_name(views: str) -> str:
    """The one spelling of a list of frames, "10+9" of "010+09", or "paper"; raises InputError."""
    return PAPER if views == PAPER else "+".join(map(str, _frames(views, "")))


def row_names(subject: str, views: str) -> tuple[str, str]:
    """The subject, and the frames that "paper" stands for; raises InputError."""
    return subject, "+".join(map(str, _frames(views, subject)))


def _source(root: Path) -> tuple[Path, dict[str, Path]]:
    """The file or folder that is read, and {subject: its place}: a path of which, in a file, only the name counts."""
    root = require_root(root, WHERE, folder=False)
    if root.is_dir():
        found = deepfluoro_folder.subject_folders(root)
        if found:
            return root, found
        files = [root / name for name in entries(root) if name.lower().endswith((".h5", ".hdf5"))]
        if len(files) != 1:
            raise InputError(
                f"{root}: it holds {len(files) or 'no'} HDF5 files and no folder subject01: give {WHERE}."
            )
        root = inside(files[0], root)
    found = {name: root / specimen for name, specimen in deepfluoro_hdf5.subject_numbers(root).items()}
    if not found:
        raise InputError(f"{root}: it holds none of the six specimens (17-1882, ...): copy the file again.")
    return root, found


def _frames(views: str, subject: str) -> tuple[int, ...]:
    """The numbers of frames that views stand for; raises InputError."""
    if views == PAPER:
        return PAPER_FRAMES[subject]
    if not isinstance(views, str) or not _FRAMES.fullmatch(views):
        raise InputError(
            f"{DATASET}: the views {shown(views)} are none: its X-rays are real, so give numbers of frames such as "
            f'"10+9", "{PAPER}" for those of the paper, or none.'
        )
    frames = tuple(int(number) for number in views.split("+"))
    if len(set(frames)) < len(frames):
        raise InputError(f"{DATASET}: the views {views} name a frame twice: give each once.")
    return frames


def _bones(fluoro: FluoroSubject) -> dict[str, tuple[int, ...]]:
    """The bodies whose labels the subject has; the pelvis must be one."""
    present = set(np.unique(fluoro.labels.voxels).tolist())
    bones = {name: tuple(n for n in numbers if n in present) for name, numbers in BONES.items()}
    if not bones[ANCHOR]:
        raise InputError(
            f"the labels hold nothing of the pelvis (labels {BONES[ANCHOR]}): copy the data again."
        )
    return {name: numbers for name, numbers in bones.items() if numbers}


@dataclass(frozen=True, eq=False)
class _Posture:
    """How a bone lies relative to the pelvis in the registered frames.

    pose: (4, 4) fixed to moving, the mean of the frames. spread_mm: farthest that any of the frames carries one of the
    bone's points from where the mean has it.
    """

    pose: np.ndarray
    spread_mm: float


def _case(
    fluoro: FluoroSubject, subject: str, numbers: Sequence[int], structures: Structures
) -> BenchmarkCase:
    """One case; raises InputError."""
    bones = _bones(fluoro)
    frames = [fluoro.read_frame(number) for number in numbers]
    postures = _postures(fluoro, bones, [frame.cameras for frame in frames])
    cameras = tuple(reduced_camera(frame.cameras[ANCHOR]) for frame in frames)
    rows, columns = (pitch * BIN for pitch in fluoro.pixel_spacing_mm)
    xrays = tuple(
        _xray(frame, camera, (rows, columns)) for frame, camera in zip(frames, cameras, strict=True)
    )
    odd = [line for frame in frames for line in _disagreements(fluoro, bones, frame)]
    odd += [
        f"{bone} lies up to {posture.spread_mm:.1f} mm differently in the registered frames; their mean is the truth."
        for bone, posture in postures.items()
        if posture.spread_mm > _ODD_POSTURE_MM
    ]
    views = "+".join(map(str, numbers))
    return BenchmarkCase(
        name=f"{subject}-{views}",
        dataset=DATASET,
        subject=subject,
        views=views,
        study=Study(
            ct=fluoro.ct,
            structures=structures,
            anchor=ANCHOR,
            xrays=xrays,
            warnings=(*fluoro.warnings, *odd),
            source_segmentation=fluoro.labels,
        ),
        labels=bones,
        groups={name: (name,) for name in bones},
        truth=CaseTruth(
            cameras,
            poses={bone: posture.pose for bone, posture in postures.items() if bone != ANCHOR},
            held_out=tuple(_held_out(fluoro, subject, numbers, postures, (rows, columns))),
        ),
    )


def _xray(frame: Frame, camera: Camera, pixel_spacing_mm: tuple[float, float]) -> Xray:
    """A frame as a study's X-ray; raises InputError."""
    try:
        image = line_integrals(frame.intensities)
    except InputError as error:
        raise InputError(f"frame {frame.number}: {error}") from error
    return Xray(
        image=image,
        mask=np.ones(image.shape, dtype=bool),
        intrinsics=camera.intrinsics,
        extrinsic=camera.extrinsic,
        camera="known",
        pixel_spacing_mm=pixel_spacing_mm,
        source_to_detector_mm=float(camera.intrinsics[1, 1] * pixel_spacing_mm[0]),
        name=f"frame {frame.number:03d}",
        provenance=("the data set's own camera; cropped, binned, and as line integrals",),
    )


def _postures(
    fluoro: FluoroSubject, bones: Mapping[str, Sequence[int]], cameras: Sequence[Mapping[str, Camera]]
) -> dict[str, _Posture]:
    """{bone: its posture in these frames}, of bones with a true pose in one of them at least."""
    postures = {ANCHOR: _Posture(np.eye(4), 0.0)}
    for bone, numbers in bones.items():
        poses = [relative_pose(each[ANCHOR], each[bone]) for each in cameras if bone in each]
        if bone == ANCHOR or not poses:
            continue
        voxels = np.argwhere(np.isin(fluoro.labels.voxels, numbers))[:, ::-1]
        points = fluoro.labels.to_world(voxels[:: max(1, len(voxels) // 2000)])
        mean = _mean_pose(poses, points.mean(axis=0))
        at = [_moved(rigid_inverse(pose), points) for pose in poses]
        spread = max(
            float(np.linalg.norm(each - _moved(rigid_inverse(mean), points), axis=1).max()) for each in at
        )
        postures[bone] = _Posture(mean, spread)
    return postures


def relative_pose(anchor: Camera, bone: Camera) -> np.ndarray:
    """(4, 4) fixed to moving of a bone, of one frame's cameras in the anchor's and in the bone's world."""
    return orthonormalised(rigid_inverse(bone.extrinsic) @ anchor.extrinsic)


def _mean_pose(poses: Sequence[np.ndarray], centroid: np.ndarray) -> np.ndarray:
    """The mean of rigid motions fixed to moving: of the rotations, and of where a moving centroid comes from."""
    rotation = orthonormalised(np.mean(poses, axis=0))[:3, :3]
    source = np.mean([_moved(rigid_inverse(pose), centroid) for pose in poses], axis=0)
    mean = np.eye(4)
    mean[:3, :3] = rotation
    mean[:3, 3] = centroid - rotation @ source
    return mean


def _moved(motion: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) under a rigid motion (4, 4)."""
    return points @ motion[:3, :3].T + motion[:3, 3]


def _held_out(
    fluoro: FluoroSubject,
    subject: str,
    given: Sequence[int],
    postures: Mapping[str, _Posture],
    pixel_spacing_mm: tuple[float, float],
) -> Iterator[HeldOutView]:
    """A view for every bone in every frame that is scored."""
    left_out = {*given, *DOUBTED_FRAMES.get(subject, ())}
    for number in fluoro.frames:
        if number not in SCORED_FRAMES or number in left_out:
            continue
        cameras = fluoro.read_cameras(number)
        for bone, posture in postures.items():
            if bone not in cameras:
                continue
            own = reduced_camera(cameras[bone])
            corrected = own.with_extrinsic(orthonormalised(own.extrinsic @ posture.pose))
            masks = ShadowMasks(fluoro.labels, own, {bone: BONES[bone]})
            yield HeldOutView(f"frame {number:03d}, {bone}", corrected, pixel_spacing_mm, masks)


def _disagreements(fluoro: FluoroSubject, bones: Mapping[str, Sequence[int]], frame: Frame) -> list[str]:
    """Warnings about a frame whose own 2D labels do not lie where the labels project."""
    if frame.labels is None:
        return []
    masks = {
        bone: label_shadows(fluoro.labels, reduced_camera(camera), {bone: bones[bone]})[bone]
        for bone, camera in frame.cameras.items()
        if bone in bones
    }
    return [
        f"frame {frame.number:03d}: only {100 * share:.0f} % of the file's 2D labels of {bone} lie where its 3D labels "
        "project: the camera may be read wrongly; check a picture before numbers are believed."
        for bone, share in shown_share(frame.labels, masks).items()
        if share < _LEAST_SHARE
    ]
