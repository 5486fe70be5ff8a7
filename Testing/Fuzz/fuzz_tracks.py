"""Targets: sequences and tracks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from fuzz_subject import Subject, whole_file
from joint_case import random_rigid, sequence_of, track_of
from track_case import make_track, write_sequence

from PolyPoseLib.data.tracking.joints import Joint
from PolyPoseLib.io.tracking.checkpoint import opened_checkpoint
from PolyPoseLib.io.tracking.joint_curves import load_joint_curves
from PolyPoseLib.io.tracking.joint_tables import write_joint_tables
from PolyPoseLib.io.tracking.sequences import load_sequence
from PolyPoseLib.io.tracking.tracks import load_track, save_track
from PolyPoseLib.kinematics.joint_motions import joint_motions


def sequence(folder: Path) -> list[Subject]:
    pose = [[1, 0, 0, 3], [0, 0, -1, 5], [0, 1, 0, 8], [0, 0, 0, 1]]
    more = {
        "still": ["tibia"],
        "initial_poses": {"talus": pose},
        "landmarks": {"tibia.medial_plateau": [1, 2, 3]},
        "joints": [{"name": "ankle", "proximal": "tibia", "distal": "talus", "side": "left"}],
    }
    path = write_sequence(folder / "walk", **more, options={"first": 1, "last": 3, "smooth": True})
    return [whole_file(path, load_sequence)]


def track(folder: Path) -> list[Subject]:
    saved = save_track(make_track(frames=3), folder / "track")
    path = saved / "track.json"
    checkpoint = folder / "walk.partial"
    with opened_checkpoint(checkpoint, "0" * 64, ("tibia", "talus"), resume=False) as begun:
        for frame in make_track(frames=3).frames:
            begun.keep(frame)

    def resume(path: Path) -> Any:
        with opened_checkpoint(path, "0" * 64, ("tibia", "talus"), resume=True) as begun:
            return begun.done

    return [Subject(path, path.read_bytes(), lambda: load_track(saved)), whole_file(checkpoint, resume)]


def joint_curves(folder: Path) -> list[Subject]:
    rng = np.random.default_rng(0)
    poses = [[random_rigid(rng), random_rigid(rng)] for _ in range(3)]
    sequence = sequence_of([Joint("knee", "upper", "lower", "grood_suntay", "left")])
    found = track_of(sequence, poses, np.eye(6) * 1e-4)
    write_joint_tables(found, joint_motions(found, sequence), folder)
    path = folder / "joints.json"
    return [Subject(path, path.read_bytes(), lambda: load_joint_curves(folder))]
