"""Pictures of one case under one motion: what remains wrong, the whole body, and what moved it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase
from PolyPoseLib.data.benchmark.system import Motion
from PolyPoseLib.data.volume import Volume, resample_labels_onto
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.benchmark.figures.canvas import save
from PolyPoseLib.io.benchmark.figures.deformation import draw_deformation
from PolyPoseLib.io.benchmark.figures.overlays import Scans, draw_errors, draw_projections
from PolyPoseLib.io.benchmark.figures.straight import straight_grid, unmoved

OVERLAY, PROJECTION, DEFORMATION = "overlay", "projection", "deformation"


def draw_case(case: BenchmarkCase, motion: Motion, folder: Path, title: str = "") -> list[str]:
    """Draw a case as a motion leaves it.

    Parameters
    ----------
    case : BenchmarkCase
        Pictures against the truth need the CT of its fixed posture.
    motion : Motion
        Of one system, from fixed to moving points.
    folder : Path
        There; files of the same names are replaced.
    title : str
        Above the pictures, such as the system's name.

    Returns
    -------
    list of str
        Names of the files: "overlay.png", differences of the CT at rest and warped from the true one in three planes;
        "projection.png", coronal maximum intensity projections over the true one's; "deformation.png", how far tissue
        moves and, where poses make the field, which structures' motions it takes. The first two need the true CT.

    Raises
    ------
    InputError
        Matplotlib is missing, or a CT shows no patient.

    """
    from PolyPoseLib.warp.dense import warp_labels, warp_volume

    ct, true = case.study.ct, case.truth.ct
    grid = straight_grid(ct if true is None else true)
    warped = warp_volume(ct, motion.field, grid, outside=np.nan)
    labels = _structures(case)
    fixed = warp_labels(labels, motion.field, grid, method="nearest")
    heading = f"{title}: {case.name}" if title else case.name
    names = []
    if true is not None:
        scans = Scans(
            warp_volume(true, unmoved(), grid, outside=np.nan),
            warp_volume(ct, unmoved(), grid, outside=np.nan),
            warped,
            fixed
            if case.truth.labels is None
            else resample_labels_onto(_numbered(case, case.truth.labels), grid),
        )
        names += save(draw_errors(scans, heading), folder, OVERLAY)
        names += save(draw_projections(scans, heading), folder, PROJECTION)
    names += save(draw_deformation(case, motion, warped, fixed, heading), folder, DEFORMATION)
    return names


def _structures(case: BenchmarkCase) -> Volume:
    """1 in the CT where a structure is that chooses the slices, 0 elsewhere."""
    source = case.study.source_segmentation
    if source is None:
        raise InputError(f"{case.name}: the study has no label map to warp: its reader must give one.")
    return _numbered(case, source)


def _numbered(case: BenchmarkCase, labels: Volume) -> Volume:
    """1 where a scored bone other than the anchor is, or where no bone moves any scored structure, 0 elsewhere."""
    bones = [
        name for name in case.labels if name in case.study.structures.names and name != case.study.anchor
    ]
    numbers = [number for name in bones or case.labels for number in case.labels[name]]
    return labels.with_voxels(np.isin(labels.voxels, numbers).astype(np.uint8))
