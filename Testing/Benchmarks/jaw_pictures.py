"""Sections through the teeth of a mouth that is open by 25 degrees: CT at rest, truth, and the warped CTs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaw_anatomy import MANDIBLE, SKULL, Head, mouth
from jaw_teeth import ENAMEL_HU, teeth_numbers, true_mouth, warped_mouths
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.named_motions import Anatomy, named_posture
from PolyPoseLib.simulation.posed_ct import pose_ct

DEGREES = 25.0

TITLES = {
    "rest": "CT at rest",
    "truth": "truth",
    "paper": "smooth, published weights",
    "smooth": "smooth, default",
    "composed": "composed",
}

SECTIONS = ("sagittal, premolars", "sagittal, incisors", "coronal")

WINDOW_HU = (-300.0, 2300.0)


def write_picture(head: Head, path: Path, seed: int = 0) -> None:
    """Draw the mouth open by DEGREES with the true poses, so that only the warps differ; the head is completed."""
    structures = head.structures
    anatomy = Anatomy(structures, head.ct.affine, SKULL)
    joints = named_posture("jaw", DEGREES, anatomy, np.random.default_rng(seed)).joints
    poses = {SKULL: np.eye(4), MANDIBLE: np.linalg.inv(joints[MANDIBLE].moving_to_fixed)}
    posed = pose_ct(head.ct, structures, poses)
    truth = true_mouth(head, Volume(posed.hu, posed.grid.affine))
    draw({"rest": mouth(head), "truth": truth, **warped_mouths(head, poses)}, path)


def draw(volumes: dict[str, Volume], path: Path) -> None:
    """One column a volume; two sagittal sections, through premolars and incisors, and a coronal one."""
    rest, truth = volumes["rest"], volumes["truth"]
    figure = Figure(figsize=(3.1 * len(volumes), 7.6), layout="constrained")
    FigureCanvasAgg(figure)
    i, j, k = (rest.spacing[n] for n in range(3))
    cuts = sections(rest, truth)
    heights = [rest.shape[0] * k / (rest.shape[1] * j)] * 2 + [rest.shape[0] * k / (rest.shape[2] * i)]
    axes = figure.subplots(3, len(volumes), gridspec_kw={"height_ratios": heights})
    for column, (name, volume) in enumerate(volumes.items()):
        numbers = teeth_numbers(rest, truth, volume)
        caption = (
            f"\nenamel {numbers['volume_ratio']:.2f} of that at rest"
            if name in ("rest", "truth")
            else f"\nenamel {numbers['volume_ratio']:.2f}, where none is {numbers['extra_ml']:.1f} ml"
        )
        axes[0, column].set_title(TITLES[name] + caption, fontsize=10)
        for row, (axis, place, aspect) in enumerate(
            ((2, cuts[0], k / j), (2, cuts[1], k / j), (1, cuts[2], k / i))
        ):
            axes[row, column].imshow(
                np.take(volume.voxels, place, axis),
                cmap="gray",
                vmin=WINDOW_HU[0],
                vmax=WINDOW_HU[1],
                aspect=aspect,
                origin="lower",
                interpolation="bilinear",
            )
            axes[row, column].set(xticks=[], yticks=[])
            axes[row, column].set_ylabel("" if column else SECTIONS[row])
    figure.savefig(path, dpi=80)


def sections(rest: Volume, truth: Volume) -> tuple[int, int, int]:
    """Columns of two sagittal sections and the row of the coronal one: where the truth has most enamel.

    The first lies in the half of the first columns, the second in the middle third.
    """
    dense = (truth.voxels >= ENAMEL_HU) | (rest.voxels >= ENAMEL_HU)
    columns, third = dense.sum((0, 1)), dense.shape[2] // 3
    rows = (truth.voxels >= ENAMEL_HU).sum((0, 2))
    return (
        int(columns[: dense.shape[2] // 2].argmax()),
        third + int(columns[third:-third].argmax()),
        int(rows.argmax()),
    )
