"""What a registration found."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from PolyPoseLib import __version__
from PolyPoseLib.geometry.camera import Camera

if TYPE_CHECKING:
    from PolyPoseLib.carrying.points import PointCarrier
    from PolyPoseLib.data.carried import CarriedMesh, CarriedPoints
    from PolyPoseLib.data.displacement_field import DisplacementField
    from PolyPoseLib.data.volume import Volume

_PACKAGES = ("numpy", "scipy", "torch", "SimpleITK", "pydicom", "numba")


INTERVALS: dict[str, tuple[int, ...]] = {
    "level": (),
    "along_mm": (),
    "across_mm": (2,),
    "rotation_about_view_deg": (),
    "rotation_across_deg": (2,),
}
"""Shapes of the 95 % intervals that a structure's uncertainty may state."""


@dataclass(frozen=True)
class StructureResult:
    """The rigid motion of one structure.

    Parameters
    ----------
    fixed_to_moving : (4, 4) array
        A point of the patient at the time of the X-rays to the CT, LPS mm.
    rotation_deg : float
        Angle of the motion from the CT's posture to the X-rays', degrees.
    translation_mm : (3,) array
        Displacement of the structure's centroid from the CT's posture to the X-rays'.
    axis : (3,) array
        Unit axis of that rotation.
    uncertainty : mapping or None
        95 % intervals in mm and degrees (see INTERVALS), or None when they were not computed.
    centroid : (3,) array or None
        Of the structure in the CT, LPS mm, or None when it is not known.
    doubts : tuple of str
        Why not to rely on the pose, one clause each; empty where nothing speaks against it.

    """

    fixed_to_moving: np.ndarray
    rotation_deg: float
    translation_mm: np.ndarray
    axis: np.ndarray
    uncertainty: Mapping[str, Any] | None = None
    centroid: np.ndarray | None = None
    doubts: tuple[str, ...] = ()

    @classmethod
    def from_pose(
        cls,
        fixed_to_moving: np.ndarray,
        centroid: np.ndarray,
        uncertainty: Mapping[str, Any] | None = None,
        doubts: tuple[str, ...] = (),
    ) -> StructureResult:
        """From the pose (4, 4) and the structure's centroid (3,) in the CT, LPS mm."""
        pose = np.asarray(fixed_to_moving, dtype=np.float64)
        motion = np.linalg.inv(pose)
        centroid = np.asarray(centroid, dtype=np.float64)
        from scipy.spatial.transform import Rotation

        vector = Rotation.from_matrix(motion[:3, :3]).as_rotvec()
        angle = float(np.linalg.norm(vector))
        axis = vector / angle if angle > 1e-12 else np.array([0.0, 0.0, 1.0])
        shift = motion[:3, :3] @ centroid + motion[:3, 3] - centroid
        return cls(pose, float(np.degrees(angle)), shift, axis, uncertainty, centroid, doubts)


@dataclass(frozen=True)
class CameraResult:
    """The camera of one X-ray as it was found.

    Parameters
    ----------
    camera : Camera
        In pixels of the X-ray as given; its extrinsic maps the world (LPS mm) to the camera.
    similarity : float
        Final, in [-1, 1].
    name : str
        Of the X-ray.

    """

    camera: Camera
    similarity: float
    name: str = ""

    @property
    def intrinsics(self) -> np.ndarray:
        """K (3, 3), pixels."""
        return self.camera.intrinsics

    @property
    def extrinsic(self) -> np.ndarray:
        """E (4, 4), world LPS mm to camera."""
        return self.camera.extrinsic

    @property
    def height(self) -> int:
        """Rows of the X-ray."""
        return self.camera.height

    @property
    def width(self) -> int:
        """Columns of the X-ray."""
        return self.camera.width


@dataclass
class Result:
    """Everything that a registration gives back.

    Parameters
    ----------
    structures : {str: StructureResult}
        The motion of every structure.
    cameras : list of CameraResult
        In the order of the study's X-rays.
    history : list of dict
        One entry per iteration: stage, iteration, similarity, and seconds and level_mm when known.
    seconds : {str: float}
        Time of every stage.
    device, versions : str, dict
        What it was computed on and with.
    warnings : list of str
        What was odd but not wrong.
    warped_ct, warped_labels : Volume
        HU (-1000 outside) and labels in the fixed frame, on the CT's grid.
    transform : DisplacementField
        Displacements from fixed to moving points.
    renderings_before, renderings_after, xray_images : list of (H, W) arrays
        Line integrals, one image per view, both renderings through the cameras found; only the second is kept in a
        result's folder.
    xray_masks : list of (H, W) bool arrays
        True where a pixel was compared.
    distrust : sequence of str
        Reasons why the result must not be trusted; empty when there are none.
    anchor : str
        The structure that defines the cameras, "" when it is not known.
    structure_labels : Volume or None
        In the CT's frame: n belongs to the nth of ``structures``; None in results of earlier versions.
    inverse_transform : DisplacementField or None
        Displacements from moving to fixed points; None in results of earlier versions.
    soft_tissue_deviation_mm : (3,) array or None
        How far the X-rays let soft tissue far from bones move beside them, as standard deviations along LPS x, y, z;
        None where that was not asked.
    segmentation_labels : tuple of int or None
        The numbers of the study's label map, 0 left out: those that ``warped_labels`` lacks were carried out of it.
        None in results of earlier versions.

    """

    structures: dict[str, StructureResult]
    cameras: list[CameraResult]
    history: list[dict[str, Any]]
    seconds: dict[str, float]
    device: str
    versions: dict[str, str]
    warnings: list[str]
    warped_ct: Volume
    warped_labels: Volume
    transform: DisplacementField
    renderings_after: list[np.ndarray]
    renderings_before: list[np.ndarray] = field(default_factory=list)
    xray_images: list[np.ndarray] = field(default_factory=list)
    xray_masks: list[np.ndarray] = field(default_factory=list)
    distrust: tuple[str, ...] = ()
    anchor: str = ""
    structure_labels: Volume | None = None
    inverse_transform: DisplacementField | None = None
    soft_tissue_deviation_mm: np.ndarray | None = None
    segmentation_labels: tuple[int, ...] | None = None
    _carrier: PointCarrier | None = field(default=None, init=False, repr=False, compare=False)

    @property
    def distrust_clauses(self) -> str:
        """The reasons in one sentence, without its full stop; "" when there are none."""
        return "; ".join(reason.rstrip(".") for reason in self.distrust)

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the result."""
        return not self.distrust

    def save(self, folder: str | Path, overwrite: bool = False) -> Path:
        """Write the result folder, all of it or nothing; raises InputError when it cannot be written.

        A folder that exists must be empty, or hold an earlier result and overwrite be true.
        """
        from PolyPoseLib.io.results import save_result

        return save_result(self, Path(folder), overwrite)

    def transform_points(self, points: np.ndarray, to: str = "xray") -> CarriedPoints:
        """Carry points between the CT and the patient as X-rayed.

        Points inside a bone take the bone's own rigid motion exactly, all others the dense transform.

        Parameters
        ----------
        points : (N, 3) array
            LPS mm.
        to : {"xray", "ct"}
            From the CT to the patient as X-rayed, or the other way.

        Returns
        -------
        CarriedPoints
            In the frame ``to``, with the covariance of each and what moved it.

        Raises
        ------
        InputError
            Other shapes or numbers, or a result of an earlier version, which has no label map of its structures.

        """
        return self.point_carrier()(points, to)

    def transform_mesh(self, vertices: np.ndarray, faces: np.ndarray, to: str = "xray") -> CarriedMesh:
        """Carry a surface mesh between the CT and the patient as X-rayed.

        A connected piece that lies in one bone or on its surface moves as a whole by that bone's motion.

        Parameters
        ----------
        vertices : (N, 3) array
            LPS mm.
        faces : (M, 3) array of int
            Indices of each triangle's vertices.
        to : {"xray", "ct"}
            As for :meth:`transform_points`.

        Returns
        -------
        CarriedMesh
            The carried vertices, each with its covariance and what moved it, and the faces as they were.

        Raises
        ------
        InputError
            As :meth:`transform_points`, and for faces of vertices that there are not.

        """
        from PolyPoseLib.carrying.pieces import carry_with_pieces, edges_of
        from PolyPoseLib.data.carried import CarriedMesh, require_faces, require_points

        points = require_points(vertices)
        kept = require_faces(faces, len(points))
        carried, _ = carry_with_pieces(self.point_carrier(), points, edges_of(kept), to)
        return CarriedMesh(carried, kept)

    def transform_image(self, volume: Volume, to: str = "xray", labels: bool = False) -> Volume:
        """Carry an image or a label map between the CT and the patient as X-rayed, by the dense transform.

        Parameters
        ----------
        volume : Volume
            Anything in the other frame: an image, a dose, labels.
        to : {"xray", "ct"}
            As for :meth:`transform_points`.
        labels : bool
            Whether the values are labels, which are never mixed.

        Returns
        -------
        Volume
            On the volume's own grid and of its type; its lowest value (0 for labels) where nothing came to lie.

        Raises
        ------
        InputError
            Labels that are not whole numbers.

        """
        from PolyPoseLib.carrying.images import carry_volume

        return carry_volume(self, volume, to, labels)

    def point_carrier(self) -> PointCarrier:
        """What carries this result's points, prepared once; raises InputError as :meth:`transform_points`."""
        if self._carrier is None:
            from PolyPoseLib.carrying.points import PointCarrier

            self._carrier = PointCarrier(self)
        return self._carrier


def installed_versions() -> dict[str, str]:
    """Versions of PolyPose, Python and the packages that decide results."""
    versions = {"polypose": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def total_seconds(seconds: Mapping[str, float]) -> float:
    """Computing time of all stages, from the times by stage; "total" among them is all of it."""
    return seconds.get("total") or sum(seconds.values())
