"""The phantom pelvis once more, so small that it is registered in a second: for many runs, and for whole commands."""

import numpy as np
from phantom_study import phantom

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.simulation.simulate import SimulatedCase, SimulationOptions, simulate_case, view_cameras


def tiny_case() -> SimulatedCase:
    """Voxels of 6 mm, two X-rays of 60 x 60 pixels 60 degrees apart."""
    fine, fine_structures = phantom()
    affine = fine.affine.copy()
    affine[:3, :3] *= 2
    ct = Volume(np.ascontiguousarray(fine.voxels[::2, ::2, ::2]), affine)
    structures = Structures(
        fine_structures.names, np.ascontiguousarray(fine_structures.labels[::2, ::2, ::2])
    )
    cameras = view_cameras(ct, (0.0, 60.0), 60, detector_mm=330.0)
    options = SimulationOptions(motion_scale=0.6, rotation_deg=3.0, translation_mm=8.0, projector="sum")
    return simulate_case(ct, structures, cameras=cameras, seed=0, options=options)
