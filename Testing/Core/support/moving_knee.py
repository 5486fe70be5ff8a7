"""A knee that bends in front of X-ray cameras: three bones, and soft tissue that follows no model of the product's.

Bones are rigid volumes, each projected by itself under its true pose; the soft tissue is two tapering limbs that are
drawn anew around the bones' axes in every frame. Nothing here uses the product's renderer or its warp.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import find_objects, gaussian_filter
from scipy.spatial.transform import Rotation

from PolyPoseLib.data.structures import Structures
from PolyPoseLib.data.tracking.sequence import Sequence, TrackView
from PolyPoseLib.data.tracking.track_options import TrackOptions
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.geometry.camera import Camera, intrinsics_matrix, look_at
from PolyPoseLib.geometry.grid import grown_box
from PolyPoseLib.geometry.rigid import rigid_inverse
from PolyPoseLib.simulation.independent_projector import project
from PolyPoseLib.simulation.xray_physics import XrayPhysics, measure

NAMES = ("femur", "tibia", "patella")

SMALL = {"pixels": 110, "spacing_mm": 2.0, "soft_mm": 5.0, "frames": 5, "flexion_deg": 5.0, "sway_mm": 1.5}
"""Options of a knee that is made and followed in seconds."""

WATER = 0.02
MUSCLE, FAT, AIR = 50.0, -90.0, -1000.0
FAT_MM = 8.0

KNEE = np.array([0.0, 4.0, 6.0])
"""Where it bends, LPS mm: the axis runs from right to left through it."""


@dataclass(frozen=True)
class KneeOptions:
    """How the knee is made, how it moves, and who looks at it.

    spacing_mm: of the CT; half_mm: of its height; pixels, arc_deg, views, field_mm: of the cameras, field at the knee;
    frames; flexion_deg: largest; detector: None for no noise; texture_hu: of bone; soft_mm: voxels of soft tissue;
    shafts_mm: how much longer the bones are than the CT shows; passing_mm: how far, to the left and back, the patella
    leaves its place in the middle fifth of the frames; jump_mm: by which everything is elsewhere from the middle frame
    on; sway_mm: of the whole leg.
    """

    spacing_mm: float = 1.5
    half_mm: float = 80.0
    pixels: int = 200
    views: int = 2
    arc_deg: float = 70.0
    field_mm: float = 220.0
    frames: int = 10
    flexion_deg: float = 20.0
    detector: XrayPhysics | None = field(default_factory=XrayPhysics)
    texture_hu: float = 120.0
    soft_mm: float = 3.0
    shafts_mm: float = 45.0
    passing_mm: tuple[float, float] = (0.0, 0.0)
    jump_mm: float = 0.0
    sway_mm: float = 4.0


class MovingKnee:
    """The CT with its structures, the true poses, and the images; the seed varies bones, motion and noise."""

    def __init__(self, seed: int = 0, options: KneeOptions | None = None) -> None:
        self.seed, self.options = seed, options or KneeOptions()
        rng = np.random.default_rng([seed, 77])
        self._shape = rng.uniform(0.93, 1.07, 8)
        self._soft_radius = rng.uniform(46, 54)
        half = self.options.half_mm
        self.ct, self.structures, _ = self._volumes(half)
        if self.options.shafts_mm:
            _, _, self._bones = self._volumes(half + self.options.shafts_mm)
        else:
            self._bones = self._volumes(half)[2]
        self.poses = self._motion(rng)
        self.cameras = self._cameras(rng)

    def sequence(self, **options) -> Sequence:
        """The sequence with the true poses of its first frame; options: of TrackOptions."""
        return Sequence(
            self.ct,
            self.structures,
            tuple(
                TrackView(f"camera {n + 1}", camera, KneeImages(self, n))
                for n, camera in enumerate(self.cameras)
            ),
            30.0,
            "femur",
            initial_poses=dict(zip(NAMES, self.poses[0], strict=True)),
            options=TrackOptions(threads=1, **options),
        )

    def image(self, frame: int, view: int) -> np.ndarray:
        """Line integrals (H, W) as the detector reports them."""
        camera = self.cameras[view]
        pose = self.poses[frame]
        line = project(self._soft_tissue(pose), camera)
        for bone, each in zip(self._bones, pose, strict=True):
            line += project(bone, camera.with_extrinsic(camera.extrinsic @ rigid_inverse(each)))
        if self.options.detector is None:
            return line
        rng = np.random.default_rng([self.seed, 99, frame, view])
        return measure(line, self.options.detector, rng)

    def _volumes(self, half: float) -> tuple[Volume, Structures, list[Volume]]:
        """The CT (HU), its structures, and what each bone adds to the soft tissue (1/mm), up to a height."""
        spacing = self.options.spacing_mm
        extent = np.array([66.0, 66.0, half])
        size = (2 * extent / spacing).astype(int) + 1
        affine = np.diag([spacing] * 3 + [1.0])
        affine[:3, 3] = -extent
        kji = np.stack(np.meshgrid(*map(np.arange, size[::-1]), indexing="ij"), -1)
        x = kji[..., ::-1] * spacing - extent
        depths = [self._femur(x), self._tibia(x), self._patella(x)]
        noise = np.random.default_rng([self.seed, 5]).normal(size=x.shape[:3])
        noise = gaussian_filter(noise, 2.0 / spacing)
        texture = self.options.texture_hu * noise / noise.std()
        soft = self._soft_hounsfield(x, np.stack([np.eye(4)] * 3))
        hu, labels, added = soft.copy(), np.zeros(soft.shape, np.int16), []
        for number, depth in enumerate(depths, start=1):
            inside = np.clip(depth / spacing + 0.5, 0, 1) * (labels == 0)
            shell = np.exp(-((np.maximum(depth - 1.5, 0) / 2.5) ** 2))
            bone = 250 + 850 * shell + texture
            hu += inside * (bone - soft)
            labels[(inside > 0.5)] = number
            added.append(_cut_out(WATER * inside * (bone - MUSCLE) / 1000, affine))
        return Volume(hu.astype(np.float32), affine), Structures(NAMES, labels), added

    def _femur(self, x: np.ndarray) -> np.ndarray:
        s = self._shape
        bow = 6 * (x[..., 2] / 80) ** 2
        shaft = np.minimum(13 * s[0] - np.hypot(x[..., 0] - 4, x[..., 1] - 2 + bow), x[..., 2] - 10)
        medial = _ellipsoid(x, (-18, 8, 16), (15 * s[1], 24, 18))
        lateral = _ellipsoid(x, (17, 6, 18), (13, 21 * s[2], 16))
        bridge = _ellipsoid(x, (0, -2, 24), (22, 13, 14))
        return np.max([shaft, medial, lateral, bridge], axis=0)

    def _tibia(self, x: np.ndarray) -> np.ndarray:
        s = self._shape
        shaft = np.minimum(
            11 * s[3] - np.hypot(x[..., 0] + 1, 1.2 * (x[..., 1] - 4) - 0.05 * x[..., 2]), -16 - x[..., 2]
        )
        plateau = _ellipsoid(x, (0, 6, -14), (34 * s[4], 22, 10))
        tuberosity = _ellipsoid(x, (-3, -12, -34), (8, 10, 15 * s[5]))
        fibula = np.minimum(6 - np.hypot(x[..., 0] - 28, x[..., 1] - 18), -24 - x[..., 2])
        return np.max([shaft, plateau, tuberosity, fibula], axis=0)

    def _patella(self, x: np.ndarray) -> np.ndarray:
        """Flat in front, a ridge beside the middle behind, an apex below."""
        s = self._shape
        ridge = -25 - 0.4 * np.abs(x[..., 0] + 3) - x[..., 1]
        body = np.min([_ellipsoid(x, (1, -33, 15), (21 * s[6], 13, 18)), x[..., 1] + 40, ridge], axis=0)
        return np.maximum(body, _ellipsoid(x, (-1, -35, -2), (7, 4.5, 10 * s[7])))

    def _soft_hounsfield(self, x: np.ndarray, poses: np.ndarray) -> np.ndarray:
        """HU (k, j, i) of two limbs around the axes of femur and tibia, and of fat around them."""
        depth = np.full(x.shape[:-1], -np.inf)
        for k, sign in ((0, 1.0), (1, -1.0)):
            back = rigid_inverse(poses[k])
            start, end = (back @ np.r_[2.0, 4.0, z, 1.0] for z in (sign * -5.0, sign * 260.0))
            along = (end - start)[:3]
            length = np.linalg.norm(along)
            along = along / length
            offset = x - start[:3]
            t = np.clip(offset @ along, 0, length)
            radius = self._soft_radius + sign * 0.06 * t
            depth = np.maximum(depth, radius - np.linalg.norm(offset - t[..., None] * along, axis=-1))
        muscle = np.clip((depth - FAT_MM) / 3.0 + 0.5, 0, 1)
        skin = np.clip(depth / 2.0 + 0.5, 0, 1)
        return AIR + skin * (FAT - AIR + muscle * (MUSCLE - FAT))

    def _soft_tissue(self, poses: np.ndarray) -> Volume:
        """1/mm in the rig's world, all that can be in the field."""
        spacing, half = self.options.soft_mm, 150.0
        size = int(2 * half / spacing) + 1
        axis = np.arange(size) * spacing - half
        x = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)[..., ::-1]
        affine = np.diag([spacing] * 3 + [1.0])
        affine[:3, 3] = -half
        hu = self._soft_hounsfield(x, poses)
        return Volume((WATER * (hu - AIR) / 1000).astype(np.float32), affine)

    def _motion(self, rng: np.random.Generator) -> np.ndarray:
        """(F, 3, 4, 4) fixed to moving: the thigh sways, the knee bends and straightens, the patella glides."""
        o, count = self.options, self.options.frames
        phase = np.linspace(0, 1, count) if count > 1 else np.zeros(1)
        bend = o.flexion_deg * np.sin(np.pi * phase) ** 2
        sway = rng.uniform(-1, 1, (6, 2))
        poses = np.zeros((count, 3, 4, 4))
        for f in range(count):
            wave = sway @ [np.sin(2 * np.pi * phase[f]), 1 - np.cos(2 * np.pi * phase[f])]
            thigh = _motion(0.4 * o.flexion_deg * wave[:3] / 4, o.sway_mm * wave[3:], KNEE)
            turn = np.array([-bend[f], 0.04 * bend[f], 0.15 * bend[f]])
            roll = np.array([0.0, 0.08 * bend[f], 0.0])
            tibia = thigh @ _motion(turn, roll, KNEE)
            patella = thigh @ _motion(0.7 * turn, np.array([0.0, -0.15 * bend[f], 0.0]), KNEE)
            aside = np.clip(1 - (abs(phase[f] - 0.5) - 0.1) / 0.08, 0, 1)
            patella = patella @ _motion(np.zeros(3), aside * np.array([*o.passing_mm, 0.0]), KNEE)
            whole = np.array([0.0, 0.0, o.jump_mm]) * (f >= count // 2)
            everything = _motion(0.5 * whole[[2, 0, 1]], whole, KNEE)
            poses[f] = rigid_inverse(everything @ np.stack([thigh, tibia, patella]))
        return poses

    def _cameras(self, rng: np.random.Generator) -> list[Camera]:
        o = self.options
        source, detector = 900.0, 1250.0
        pitch = o.field_mm * detector / source / o.pixels
        intrinsics = intrinsics_matrix(detector, pitch, o.pixels, o.pixels)
        first = rng.uniform(60, 100)
        cameras = []
        for n in range(o.views):
            angle = np.radians(first + (o.arc_deg * n / max(o.views - 1, 1)))
            place = source * np.array([np.sin(angle), -np.cos(angle), 0.05])
            cameras.append(Camera(intrinsics, look_at(place, (0, 0, 0)), o.pixels, o.pixels))
        return cameras


class KneeImages:
    """The images of one view, made when they are read and kept; ``changed`` holds others by number of frame."""

    def __init__(self, knee: MovingKnee, view: int) -> None:
        self.knee, self.view = knee, view
        self.changed: dict[int, np.ndarray] = {}
        self._kept: dict[int, np.ndarray] = {}

    @property
    def count(self) -> int:
        return len(self.knee.poses)

    def read(self, index: int) -> tuple[np.ndarray, np.ndarray]:
        if index in self.changed:
            image = self.changed[index]
        else:
            if index not in self._kept:
                self._kept[index] = self.knee.image(index, self.view)
            image = self._kept[index]
        return image, np.ones(image.shape, bool)


def _cut_out(voxels: np.ndarray, affine: np.ndarray) -> Volume:
    """The box of a volume that is not zero, with a border."""
    (box,) = find_objects((voxels != 0).astype(np.uint8))
    box = grown_box(box, 1, voxels.shape)
    moved = affine.copy()
    moved[:3, 3] += affine[:3, :3] @ [part.start for part in reversed(box)]
    return Volume(voxels[box].astype(np.float32), moved)


def _ellipsoid(x: np.ndarray, centre, radii) -> np.ndarray:
    """Roughly the depth (mm) below the surface of an ellipsoid, negative outside."""
    scaled = np.linalg.norm((x - np.array(centre)) / np.array(radii), axis=-1)
    return (1 - scaled) * min(radii)


def _motion(turn_deg: np.ndarray, shift_mm: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(4, 4) rotation about a centre, then a shift."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(np.radians(turn_deg)).as_matrix()
    motion[:3, 3] = centre - motion[:3, :3] @ centre + shift_mm
    return motion
