"""A tiny CT with two bones and two known cameras, and training pairs of it, for the tests of the trained systems."""

import learned_phantom
import numpy as np

from PolyPoseLib.baselines.trained.simulated_pairs import SimulatedPatient, simulated_pairs
from PolyPoseLib.baselines.trained.training_set import TrainingSet
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.simulation.simulate import SimulationOptions, simulate_case, view_cameras

SIDE = 16
PIXELS = 48


def cameras(angles=(0.0, 90.0)):
    ct, _ = learned_phantom.phantom()
    return view_cameras(ct, angles, PIXELS, isocenter=ct.bounds_center)


def patient(side=SIDE):
    ct, structures = learned_phantom.phantom()
    return SimulatedPatient.of(ct, structures, learned_phantom.ANCHOR, cameras(), side)


def pairs(seed=0):
    return simulated_pairs([patient()], seed, SimulationOptions(projector="sum"))


def training_set(count=6, held_out=2, seed=0):
    return TrainingSet.collected(pairs(seed), (count, held_out), SIDE)


def simulated(seed):
    """A motion at the CT's own resolution."""
    ct, structures = learned_phantom.phantom()
    options = SimulationOptions(projector="sum", node_mm=6.0)
    return simulate_case(
        ct, structures, cameras=cameras(), seed=seed, options=options, anchor=learned_phantom.ANCHOR
    )


def study(images=None, views=None, ct=None):
    """A study with known cameras; images of noise by default."""
    whole, structures = learned_phantom.phantom()
    views = cameras() if views is None else views
    if images is None:
        rng = np.random.default_rng(3)
        images = [rng.random((each.height, each.width), np.float32) for each in views]
    xrays = [
        Xray(image, np.ones(image.shape, bool), view.intrinsics, view.extrinsic, "known", (8.0, 8.0), 1020.0)
        for image, view in zip(images, views, strict=True)
    ]
    return Study(ct or whole, structures, learned_phantom.ANCHOR, tuple(xrays))
