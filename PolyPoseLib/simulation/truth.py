"""From a simulated case to what is scored of it."""

from __future__ import annotations

import numpy as np

from PolyPoseLib.data.label_names import structure_of
from PolyPoseLib.data.truth import Truth
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.fixed_grid import widened
from PolyPoseLib.simulation.simulate import SimulatedCase


def truth_of(case: SimulatedCase, organ_names: dict[int, str] | None = None) -> Truth:
    """The truth of a case; organ_names {label: name} names its source labels, bones are left out."""
    moving, fixed = case.source_labels, case.fixed_source_labels
    bones_at_rest = Volume(case.structures.labels, case.ct.affine)
    organs, names = (None, None), {}
    if moving is not None and fixed is not None:
        soft = (case.structures.labels == 0) & (moving.voxels > 0)
        numbers = [int(n) for n in np.unique(moving.voxels[soft])]
        bones = {int(n) for n in np.unique(moving.voxels[case.structures.labels > 0])}
        names = {n: (organ_names or {}).get(n, f"label {n}") for n in numbers if n not in bones}
        names = {n: name for n, name in names.items() if structure_of(name) is None}
        keep = np.array(list(names), dtype=np.int64)
        organs = tuple(
            volume.with_voxels(np.where(np.isin(volume.voxels, keep), volume.voxels, 0))
            for volume in (widened(moving, case.fixed_ct), fixed)
        )
    return Truth(
        names=case.structures.names,
        anchor=case.anchor,
        fixed_to_moving=case.fixed_to_moving,
        cameras=list(case.cameras),
        moving_labels=widened(bones_at_rest, case.fixed_ct),
        fixed_labels=case.fixed_labels,
        fixed_ct=case.fixed_ct,
        field=case.field,
        moving_organs=organs[0],
        fixed_organs=organs[1],
        organ_names=names,
        statistics=case.statistics,
        seed=case.seed,
    )
