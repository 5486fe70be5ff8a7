"""A small sequence on disk, a track of random numbers, and a tracker that stands in where files alone are tested."""

from __future__ import annotations

import json
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from result_case import random_pose

from PolyPoseLib.data.tracking.track import Corrected, Track, TrackedFrame
from PolyPoseLib.data.tracking.track_inputs import TrackInputs
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera, look_at
from PolyPoseLib.io.volumes import write_volume

SHAPE = (40, 50)
FRAMES = 6
AFFINE = np.array([[2.0, 0, 0, -10], [0, 2, 0, 5], [0, 0, 3, 20], [0, 0, 0, 1]])
NAMES = ("tibia", "talus")


def camera(number: int) -> Camera:
    """One of two cameras, 60 degrees apart."""
    angle = np.radians(60 * number)
    extrinsic = look_at(np.array([800 * np.sin(angle), -800 * np.cos(angle), 30]), np.array([0.0, 0, 30]))
    return Camera(np.array([[900.0, 0, 24], [0, 900, 20], [0, 0, 1]]), extrinsic, *SHAPE)


def picture(number: int, frame: int, shape: tuple[int, int] = SHAPE) -> np.ndarray:
    """(H, W) uint16 that differs from camera to camera and from frame to frame."""
    rng = np.random.default_rng([number, frame])
    return rng.integers(1000, 60000, shape).astype(np.uint16)


def write_pictures(folder: Path, number: int, frames: int = FRAMES, ending: str = ".png") -> Path:
    """A folder of images whose names only a natural order sorts."""
    folder.mkdir(parents=True)
    for frame in range(frames):
        sitk.WriteImage(
            sitk.GetImageFromArray(picture(number, frame)), str(folder / f"im{frame + 7}{ending}")
        )
    return folder


def mayacam(found: Camera) -> str:
    """The text of a calibration."""
    rows = [f"{a:.10f},{b:.10f},{c:.10f}" for a, b, c in found.intrinsics]
    turn = [f"{a:.10f},{b:.10f},{c:.10f}" for a, b, c in found.extrinsic[:3, :3]]
    shift = [f"{each:.10f}" for each in found.extrinsic[:3, 3]]
    return "\n".join(
        ["image size", f"{found.width},{found.height}", "", "camera matrix", *rows, "", "rotation", *turn, "",
         "translation", *shift, ""]
    )  # fmt: skip


def write_sequence(folder: Path, cameras: list[dict[str, Any]] | None = None, **fields: Any) -> Path:
    """Write CT, labels, two cameras' images and calibrations, and TRACK.json, whose path is returned."""
    folder.mkdir(parents=True, exist_ok=True)
    labels = np.zeros((10, 11, 12), np.uint8)
    labels[:5, 2:9, 2:9], labels[6:, 3:8, 3:8] = 1, 2
    rng = np.random.default_rng(0)
    voxels = np.where(labels > 0, 900, -20) + rng.integers(-50, 50, labels.shape)
    write_volume(Volume(voxels.astype(np.int16), AFFINE), folder / "ct.nii.gz")
    write_volume(Volume(labels, AFFINE), folder / "labels.nii.gz")
    if cameras is None:
        cameras = []
        for number in range(2):
            write_pictures(folder / f"cam{number}", number)
            (folder / f"cam{number}.txt").write_text(mayacam(camera(number)))
            cameras.append(
                {"images": f"cam{number}", "calibration": f"cam{number}.txt", "intensity": "attenuation"}
            )
    given = {
        "version": 1, "ct": "ct.nii.gz", "segmentation": "labels.nii.gz", "structures": {"tibia": [1], "talus": [2]},
        "reference": "tibia", "frames_per_second": 50, "cameras": cameras, **fields,
    }  # fmt: skip
    path = folder / "TRACK.json"
    path.write_text(json.dumps(given))
    return path


def make_track(seed: int = 0, frames: int = 5, structures: int = 2, first: int = 0) -> Track:
    """A track of random numbers; in its last frame but one the last structure is lost, without a pose."""
    rng = np.random.default_rng(seed)
    made = []
    for number in range(first, first + frames):
        poses = np.stack([random_pose(rng, 60, 80) for _ in range(structures)])
        roots = rng.normal(size=(structures, 6, 6)) * 1e-2
        covariances = roots @ roots.transpose(0, 2, 1)
        residuals = rng.random(structures)
        sources = ["forward", "restart", "backward", "given", "corrected"][number % 5]
        lost = number == first + frames - 2
        if lost:
            poses[-1], covariances[-1], residuals[-1] = np.nan, np.nan, np.nan
        made.append(
            TrackedFrame(
                frame=number,
                poses=poses,
                covariances=covariances,
                residuals=residuals,
                doubts=((),) * (structures - 1) + ((("it was lost",),) if lost else ((),)),
                sources=(sources,) * (structures - 1) + ("none" if lost else sources,),
                cpu_seconds=float(rng.random()),
            )
        )
    names = tuple(NAMES[:structures]) if structures <= 2 else tuple(f"bone {k}" for k in range(structures))
    return Track(
        names=names,
        reference=names[0],
        centroids=rng.normal(size=(structures, 3)) * 30,
        frames=tuple(made),
        frames_per_second=50.0,
        cameras={f"camera {n + 1}": camera(n) for n in range(2)},
        smoothed=bool(rng.integers(2)),
        warnings=("careful",),
        distrust=(),
        device="cpu",
        versions={"polypose": "0"},
        inputs=TrackInputs("1" * 64, "2" * 64, {"camera 1": "3" * 64}, first, None) if seed % 2 else None,
        corrections=(Corrected(first, names[:1], first, first + 1),) * (seed % 3),
    )


def frame_at(number: int, structures: int = 2) -> TrackedFrame:
    """The frame that the stand-in finds: the same whenever it is asked."""
    rng = np.random.default_rng(number)
    return TrackedFrame(
        frame=number,
        poses=np.stack([random_pose(rng) for _ in range(structures)]),
        covariances=np.stack([np.eye(6) * 1e-4] * structures),
        residuals=rng.random(structures),
        doubts=((),) * structures,
        sources=("forward",) * structures,
        cpu_seconds=0.25,
    )


def stand_in(
    before_frame: Callable[[int], None] = lambda number: None, distrust: tuple[str, ...] = ()
) -> types.ModuleType:
    """A module in the place of the tracker: it reads every image, keeps every frame and fits nothing."""
    from PolyPoseLib.data.progress import Progress

    def track(sequence, progress=None, cancel=None, done=(), keep=None, earlier=None):
        frames = {each.frame: each for each in done}
        for number in sequence.frames:
            if number in frames:
                continue
            before_frame(number)
            for view in sequence.views:
                image, mask = view.images.read(view.first + number)
                assert image.dtype == np.float32 and mask.dtype == bool and image.shape == mask.shape
            frames[number] = frame_at(number, len(sequence.structures))
            if keep is not None:
                keep(frames[number])
            if progress is not None:
                progress(Progress("frame", number + 1, sequence.frames.stop, 0.9, 0.1))
        return Track(
            names=sequence.structures.names,
            reference=sequence.reference,
            centroids=sequence.structures.centroids(sequence.ct.affine),
            frames=tuple(frames[number] for number in sorted(frames)),
            frames_per_second=sequence.frames_per_second,
            cameras={view.name: view.camera for view in sequence.views},
            smoothed=sequence.options.smooth,
            warnings=sequence.warnings,
            distrust=distrust,
            device="cpu",
            versions={},
        )

    module = types.ModuleType("PolyPoseLib.tracking.follow")
    module.track = track
    return module


def install_stand_in(**settings: Any) -> None:
    """Let this process use the stand-in."""
    sys.modules["PolyPoseLib.tracking.follow"] = stand_in(**settings)
