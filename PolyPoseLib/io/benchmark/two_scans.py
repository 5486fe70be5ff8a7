"""Cases from two scans of a subject: registered is the first, to X-rays rendered from the second."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from PolyPoseLib.data.benchmark.case import BenchmarkCase, CaseTruth, HeldOutView
from PolyPoseLib.data.structures import structures_from_labels
from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume, hounsfield_to_attenuation
from PolyPoseLib.data.xray import Xray
from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.camera import Camera
from PolyPoseLib.io.benchmark.cut_ends import cut_at_ends
from PolyPoseLib.io.benchmark.shadow_masks import ShadowMasks
from PolyPoseLib.io.benchmark.view_sets import ViewSet
from PolyPoseLib.simulation.anchor_alignment import align_anchor
from PolyPoseLib.simulation.case_study import pixel_spacing
from PolyPoseLib.simulation.independent_projector import project, projector_name
from PolyPoseLib.simulation.simulate import SOURCE_TO_DETECTOR_MM, structures_centre, view_cameras

PIXELS = 200
DETECTOR_MM = 430.0
"""The same detector for every data set whose X-rays are rendered: 200 x 200 pixels of 2.15 mm."""

RESIDUAL_LIMIT_MM = 4.0
"""An anchor whose aligned surfaces are farther apart on average is not one bone of one patient."""

_RESIDUAL_ODD_MM = 1.5


@dataclass(frozen=True, eq=False)
class TwoScans:
    """What a reader found of one subject.

    Attributes
    ----------
    dataset, subject
        The columns of the tables.
    moving, fixed
        The earlier scan and the later one in HU, each in its own world.
    moving_labels, fixed_labels
        On the scans' grids, numbered alike.
    structures
        {bone: its labels}: the bodies that move, of the earlier scan.
    organs
        {soft organ: its labels}.
    anchor
        The structure that gives both scans one world.
    aligned
        Whether the two worlds already are one in which the anchor coincides.
    warnings
        For the study.
    pair
        What the case is called after where a subject has several pairs of scans; empty where the subject's name does.
    ends
        {structure or organ: planes beyond which it is not scored}, see :class:`CaseTruth`.

    """

    dataset: str
    subject: str
    moving: Volume
    fixed: Volume
    moving_labels: Volume
    fixed_labels: Volume
    structures: Mapping[str, tuple[int, ...]]
    organs: Mapping[str, tuple[int, ...]]
    anchor: str
    aligned: bool = False
    warnings: tuple[str, ...] = ()
    pair: str = ""
    ends: Mapping[str, np.ndarray] = dataclasses.field(default_factory=dict)


def render_cases(scans: TwoScans, sets: Sequence[ViewSet]) -> Iterator[BenchmarkCase]:
    """One case for each set of views, rendered when it is asked for.

    The anchor is aligned first: the later scan is carried, as a rigid whole, to where its anchor lies upon the earlier
    one's. That world is the fixed frame, in which the cameras are stated and the truth is kept.

    Raises
    ------
    InputError
        The anchor is not the same bone in both scans, or a scan does not fit before the cameras.

    """
    try:
        scene = Scene.of(_in_one_world(scans))
        for each in sets:
            yield scene.case(each)
    except InputError as error:
        raise InputError(f"{scans.dataset}, {scans.pair or scans.subject}: {error}") from error


@dataclass(frozen=True, eq=False)
class Scene:
    """What all sets of views of a subject share.

    Attributes
    ----------
    scans
        In one world.
    study_parts
        Of the study, but for its X-rays.
    attenuation
        Of the later scan, 1/mm.
    isocenter
        (3,) LPS mm, the middle of the earlier scan's bones.
    scored
        {structure or organ: labels} of what both scans show.

    """

    scans: TwoScans
    study_parts: dict
    attenuation: Volume
    isocenter: np.ndarray
    scored: dict[str, tuple[int, ...]]

    @classmethod
    def of(cls, scans: TwoScans) -> Scene:
        """Prepare a subject's scans, which are in one world; raises InputError."""
        structures = structures_from_labels(scans.moving_labels, scans.structures, scans.moving)
        there = set(np.unique(scans.fixed_labels.voxels).tolist())
        scored = {
            name: numbers
            for name, numbers in {**scans.structures, **scans.organs}.items()
            if there.intersection(numbers)
        }
        if not scored:
            raise InputError(
                "the two scans have no label in common but of what an end of the first cuts off: segment both by the "
                "same program, or give a CT that shows more."
            )
        parts = {
            "ct": scans.moving,
            "structures": structures,
            "anchor": scans.anchor,
            "source_segmentation": scans.moving_labels,
        }
        fixed = scans.fixed
        attenuation = fixed.with_voxels(hounsfield_to_attenuation(fixed.voxels))
        return cls(scans, parts, attenuation, structures_centre(structures, scans.moving.affine), scored)

    def cameras(self, angles_deg: Sequence[float]) -> list[Camera]:
        """True cameras at these angles."""
        return view_cameras(self.scans.moving, angles_deg, PIXELS, DETECTOR_MM, isocenter=self.isocenter)

    def case(self, views: ViewSet, given: Sequence[tuple[Xray, Camera]] | None = None) -> BenchmarkCase:
        """Render a set of views and prepare the held-out ones.

        Parameters
        ----------
        views : ViewSet
            The set.
        given : sequence of (Xray, Camera), optional
            X-rays that exist, with their true cameras, instead of rendered ones.

        """
        scans, projector = self.scans, ""
        if given is None:
            projector = projector_name()
            cameras = self.cameras(views.angles_deg)
            images = (project(self.attenuation, camera) for camera in cameras)
            given = [
                (rendered_xray(image, camera, f"{angle:g} degrees"), camera)
                for image, camera, angle in zip(images, cameras, views.angles_deg, strict=True)
            ]
        held_out = tuple(
            HeldOutView(
                f"{angle:g} degrees",
                camera,
                pixel_spacing(camera, SOURCE_TO_DETECTOR_MM),
                ShadowMasks(scans.fixed_labels, camera, self.scored),
            )
            for camera, angle in zip(self.cameras(views.held_out_deg), views.held_out_deg, strict=True)
        )
        xrays, cameras = zip(*given, strict=True)
        return BenchmarkCase(
            name=f"{scans.pair or scans.subject}-{views.name}",
            dataset=scans.dataset,
            subject=scans.subject,
            views=views.name,
            study=Study(xrays=xrays, warnings=scans.warnings, **self.study_parts),
            labels=self.scored,
            groups=groups_of(scans.structures, scans.organs, self.scored),
            truth=CaseTruth(
                cameras, labels=scans.fixed_labels, ct=scans.fixed, held_out=held_out, ends=scans.ends
            ),
            projector=projector,
        )


def groups_of(
    bones: Mapping[str, object], organs: Mapping[str, object], scored: Mapping[str, object]
) -> dict[str, tuple[str, ...]]:
    """The tables' groups: bones and soft organs, of what is scored."""
    groups = {
        "bones": tuple(name for name in bones if name in scored),
        "soft organs": tuple(name for name in organs if name in scored),
    }
    return {group: names for group, names in groups.items() if names}


def rendered_xray(image: np.ndarray, camera: Camera, name: str) -> Xray:
    """Line integrals (H, W) as a study's X-ray whose camera is known."""
    return Xray(
        image=image,
        mask=np.ones(image.shape, dtype=bool),
        intrinsics=camera.intrinsics,
        extrinsic=camera.extrinsic,
        camera="known",
        pixel_spacing_mm=pixel_spacing(camera, SOURCE_TO_DETECTOR_MM),
        source_to_detector_mm=SOURCE_TO_DETECTOR_MM,
        name=name,
        provenance=("rendered from the later scan by an independent projector",),
    )


def _in_one_world(scans: TwoScans) -> TwoScans:
    """The later scan carried to where its anchor coincides with the earlier one's; raises InputError."""
    if scans.aligned:
        return scans
    numbers = _common_whole(scans) or _common(scans)
    if not numbers:
        raise InputError(
            f'the anchor "{scans.anchor}" is not in both scans: check that its labels are of the same patient.'
        )
    first, second = (
        labels.with_voxels(np.isin(labels.voxels, numbers))
        for labels in (scans.moving_labels, scans.fixed_labels)
    )
    found = align_anchor(first, second)
    if found.residual_mm > RESIDUAL_LIMIT_MM:
        raise InputError(
            f'the anchor "{scans.anchor}" differs by {found.residual_mm:.1f} mm between the scans however it is placed '
            f"(at most {RESIDUAL_LIMIT_MM:g} mm may): check that both are of one patient and labelled alike."
        )
    told = (
        f"The later scan was moved by {found.moved_mm:.1f} mm and {found.moved_deg:.1f} degrees, so that "
        f'"{scans.anchor}" lies where the CT has it; a mean surface distance of {found.residual_mm:.2f} mm remains.',
    )
    if found.residual_mm > _RESIDUAL_ODD_MM:
        told += (
            f"The anchor's labels agree poorly between the scans ({found.residual_mm:.1f} mm): the cameras are "
            "uncertain by about as much.",
        )
    fixed, labels = (
        Volume(each.voxels, found.to_first @ each.affine) for each in (scans.fixed, scans.fixed_labels)
    )
    labels, ends = cut_at_ends(scans.moving_labels, labels, {**scans.structures, **scans.organs})
    return dataclasses.replace(
        scans, fixed=fixed, fixed_labels=labels, ends=ends, aligned=True, warnings=(*scans.warnings, *told)
    )


def _common(scans: TwoScans) -> list[int]:
    """Labels of the anchor that both scans hold."""
    present = [set(np.unique(labels.voxels).tolist()) for labels in (scans.moving_labels, scans.fixed_labels)]
    return [number for number in scans.structures[scans.anchor] if all(number in each for each in present)]


def _common_whole(scans: TwoScans) -> list[int]:
    """Those of them that no end of a scan cuts off: halves of a vertebra would be aligned to the whole."""
    cut = [set(_at_ends(labels.voxels)) for labels in (scans.moving_labels, scans.fixed_labels)]
    return [number for number in _common(scans) if not any(number in each for each in cut)]


def _at_ends(voxels: np.ndarray) -> list[int]:
    """Labels in the first or last layer of voxels along any axis."""
    layers = [np.unique(np.take(voxels, (0, -1), axis=axis)) for axis in range(3)]
    return np.unique(np.concatenate(layers)).tolist()
