"""Small cases with an independent truth and true cameras, for the tests of other systems."""

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np
import simulation_phantom
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.study import Study
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.simulation.case_study import case_to_study
from PolyPoseLib.simulation.simulate import SimulatedCase, SimulationOptions, simulate_case

DETECTOR_MM = 220.0
"""The body fills the X-rays: a dense field pulls tissue into air that it sees, since flat patches count as unlike."""


@dataclass(frozen=True, eq=False)
class MovedBones:
    """A study with known cameras; the patient as a whole moved by ``shift`` (4, 4), beside what the case did."""

    case: SimulatedCase
    study: Study
    shift: np.ndarray

    def errors(self, motion=None):
        """Mean error in mm over the voxels of structures that moved, and their mean Dice; None does nothing."""
        labels = self.case.fixed_labels
        index = np.stack(np.meshgrid(*map(np.arange, labels.voxels.shape), indexing="ij"), -1).reshape(-1, 3)
        before = labels.to_world(index[:, ::-1])
        true = before + self.case.field.sample(before)
        points = before @ self.shift[:3, :3].T + self.shift[:3, 3]
        found = points + (0 if motion is None else motion.field.sample(points))
        distance = np.linalg.norm(found - true, axis=1)
        place = np.rint(self.case.ct.to_index(found)).astype(int)[:, ::-1]
        inside = ((place >= 0) & (place < self.case.ct.shape)).all(axis=1)
        pulled = np.zeros(len(points), int)
        pulled[inside] = self.case.structures.labels[tuple(place[inside].T)]
        errors, overlaps = [], []
        for number in range(1, 1 + len(self.case.structures.names)):
            mask = labels.voxels.ravel() == number
            if np.linalg.norm(points - true, axis=1)[mask].mean() > 0.1:
                errors.append(distance[mask].mean())
                both = mask & (pulled == number)
                overlaps.append(2 * both.sum() / (mask.sum() + (pulled == number).sum()))
        return np.mean(errors), np.mean(overlaps)


@functools.lru_cache(maxsize=4)
def moved_bones(seed, shift_deg=0.0, shift_mm=0.0, motion_scale=1.0, pixels=64, spacing=5.0, views=2):
    """Bones turned about their joints and the patient shifted; line integrals from directions over 180 degrees."""
    rng = np.random.default_rng([seed, 11])
    ct, structures, source = simulation_phantom.phantom((spacing, spacing, spacing))
    cameras = []
    for angle in np.linspace(0, np.pi, views, endpoint=False):
        place = 700 * np.array([np.sin(angle), -np.cos(angle), 0.0])
        intrinsics = intrinsics_matrix(1000, DETECTOR_MM / pixels, pixels, pixels)
        cameras.append(Camera(intrinsics, look_at(place, np.zeros(3)), pixels, pixels))
    case = simulate_case(
        ct,
        structures,
        cameras=cameras,
        seed=seed,
        options=SimulationOptions(node_mm=6.0, projector="sum", motion_scale=motion_scale),
        source_labels=source,
        organ_names={5: "organ"},
    )
    axis, direction = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    shift = np.eye(4)
    shift[:3, :3] = Rotation.from_rotvec(np.radians(shift_deg) * axis).as_matrix()
    shift[:3, 3] = shift_mm * direction
    study = case_to_study(case, camera="known")
    xrays = tuple(
        dataclasses.replace(
            xray, image=image.astype(np.float32), extrinsic=camera.extrinsic @ np.linalg.inv(shift)
        )
        for xray, camera, image in zip(study.xrays, cameras, case.clean_images, strict=True)
    )
    return MovedBones(case, dataclasses.replace(study, xrays=xrays), shift)
