"""All files about joints, as the folder of a track gets them."""

import dataclasses

import numpy as np
from overlay_case import overlay_case

from PolyPoseLib.io.tracking.joint_files import write_plots_of, write_tables_of, write_video_of


def test_a_folder_gets_tables_plots_and_the_video(tmp_path):
    sequence, track = overlay_case(3, covariances=np.diag([1e-5] * 3 + [0.01] * 3))
    for write in (write_tables_of, write_plots_of, write_video_of):
        write(track, sequence, tmp_path)
    names = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    plots = {
        f"plots/joint_{n}_{name}.{kind}"
        for n, name in ((1, "femur_left"), (2, "vertebra_L5"))
        for kind in ("png", "svg")
    }
    assert names == {"joints.csv", "joints.json", "overlay.mp4", *plots}


def test_a_single_structure_has_no_joint(tmp_path):
    sequence, track = overlay_case(2)
    labels = np.minimum(sequence.structures.labels, 1)
    structures = dataclasses.replace(sequence.structures, names=("pelvis",), labels=labels)
    frames = tuple(
        dataclasses.replace(
            each, poses=each.poses[:1], covariances=each.covariances[:1], doubts=((),), sources=("forward",)
        )
        for each in track.frames
    )
    track = dataclasses.replace(track, names=("pelvis",), centroids=track.centroids[:1], frames=frames)
    sequence = dataclasses.replace(sequence, structures=structures)
    write_tables_of(track, sequence, tmp_path)
    write_plots_of(track, sequence, tmp_path)
    assert not list(tmp_path.iterdir())
    write_video_of(track, sequence, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["overlay.mp4"]
