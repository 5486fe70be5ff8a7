"""What to track: nodes and settings, as the panel and Slicer's Python console give them."""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from slicer.i18n import tr as _

from PolyPoseLib.geometry.camera import Camera

from ..scene.cameras import camera_of
from ..scene.motions import motions_of
from .parameters import PolyPoseParameterNode, outputs_of, structures_of, xray_sources
from .xray_source import XraySource

if TYPE_CHECKING:
    from .results import OutputNodes


class Start(enum.Enum):
    """How the first frame begins."""

    REST = "rest"
    REGISTRATION = "registration"
    RESULT = "result"

    def label(self) -> str:
        """Its label for people."""
        return {
            "rest": _("where the CT has the bones"),
            "registration": _("registration of the first frame"),
            "result": _("poses of the present result"),
        }[self.value]


@dataclass(frozen=True)
class TrackSettings:
    """How to track.

    Parameters
    ----------
    frames_per_second : float
        Of all cameras; 0: as the images state it.
    first, last : int, optional
        Frames to track, counted from 0, the last one included; None: the first that makes sense, and the end.
    reference : str
        The structure relative to which others are reported; empty: the anchor.
    still : tuple of str
        Structures that do not move during the sequence.
    start : Start
        How the first frame begins.
    backward : bool
        Whether a second pass goes back in time and keeps the better of two poses.
    smooth : bool
        Whether poses are smoothed.

    """

    frames_per_second: float = 0.0
    first: int | None = None
    last: int | None = None
    reference: str = ""
    still: tuple[str, ...] = ()
    start: Start = Start.REST
    backward: bool = True
    smooth: bool = False

    @classmethod
    def of(cls, text: str) -> TrackSettings:
        """From the parameter node's text; whatever it does not hold, or is damaged, has its default."""
        usual = cls()
        try:
            stored = json.loads(text or "{}")
            fields = {name: stored.get(name, value) for name, value in asdict(usual).items()}
            return cls(
                frames_per_second=float(fields["frames_per_second"]),
                first=None if fields["first"] is None else int(fields["first"]),
                last=None if fields["last"] is None else int(fields["last"]),
                reference=str(fields["reference"]),
                still=tuple(map(str, fields["still"])),
                start=Start(fields["start"]),
                backward=bool(fields["backward"]),
                smooth=bool(fields["smooth"]),
            )
        except (ValueError, TypeError, AttributeError):
            return usual

    def text(self) -> str:
        """For the parameter node; defaults are left out."""
        usual = asdict(TrackSettings())
        fields = {name: value for name, value in asdict(self).items() if value != usual[name]}
        if "start" in fields:
            fields["start"] = self.start.value
        return json.dumps(fields)


@dataclass(frozen=True)
class FoundView:
    """What a registration of one frame found for an X-ray: its camera, and which image of the row it used."""

    camera: Camera
    frame: int = 0


@dataclass(frozen=True)
class TrackRequest:
    """Bones to follow through X-ray sequences.

    Parameters
    ----------
    ct : vtkMRMLScalarVolumeNode
        The CT in HU, taken as it is shown; never changed.
    segmentation : vtkMRMLSegmentationNode
        Its bones, taken as they are shown; never changed.
    structures : dict of str to sequence of str, or sequence of str
        {structure: names or IDs of the segments that move together}, or names of segments that each move by themselves.
    xrays : sequence of XraySource, vtkMRMLSequenceNode, or path
        One entry a camera. The `frame` of an XraySource says which of its images belongs together with the others'.
        Its camera is known exactly by its fields ("camera": "known" with an extrinsic or a calibration, see
        docs/study-format.md), or is among `found`. Those with a single image are left out.
    settings : TrackSettings
        How to track.
    found : dict of str to FoundView
        Cameras that a registration of one frame has found, by `XraySource.series`.
    poses : dict of str to (4, 4) array
        Where structures are in the first frame, from the X-rays' posture to the CT, LPS mm; for Start.RESULT.
    threads : int, optional
        CPU threads; None for all.
    uncertain : sequence of str
        Structures of `poses` that the registration flagged as uncertain.

    """

    ct: Any
    segmentation: Any
    structures: Mapping[str, Sequence[str]] | Sequence[str]
    xrays: Sequence[Any]
    settings: TrackSettings = field(default_factory=TrackSettings)
    found: Mapping[str, FoundView] = field(default_factory=dict)
    poses: Mapping[str, np.ndarray] = field(default_factory=dict)
    threads: int | None = None
    uncertain: Sequence[str] = ()

    @classmethod
    def of(cls, parameters: PolyPoseParameterNode) -> TrackRequest:
        """What a parameter node asks for; cameras and poses are those of its result, where it has one."""
        outputs, structures = outputs_of(parameters), structures_of(parameters)
        settings = TrackSettings.of(parameters.tracking)
        reference = settings.reference if settings.reference in structures else parameters.anchor
        motions = {name: each for name, each in motions_of(outputs.motions).items() if name in structures}
        return cls(
            parameters.ct,
            parameters.segmentation,
            structures,
            xray_sources(parameters),
            replace(settings, reference=reference),
            found_views(outputs),
            {name: np.linalg.inv(motion.matrix) for name, motion in motions.items()},
            int(json.loads(parameters.options or "{}").get("threads") or 0) or None,
            tuple(name for name, motion in motions.items() if motion.doubts),
        )

    def by_structure(self) -> Mapping[str, Sequence[str]]:
        """{structure: names or IDs of its segments}."""
        if isinstance(self.structures, Mapping):
            return self.structures
        return {name: [name] for name in self.structures}

    def sources(self) -> list[XraySource]:
        """The X-rays."""
        return [XraySource.of(each) for each in self.xrays]

    @property
    def reference(self) -> str:
        """The structure relative to which others are reported; the first where none is chosen."""
        return self.settings.reference or next(iter(self.by_structure()), "")


def found_views(outputs: OutputNodes) -> dict[str, FoundView]:
    """The cameras of a result by `XraySource.series`; those whose node was removed or spoilt are left out."""
    found = {}
    for identity, node in zip(outputs.sources, outputs.cameras, strict=False):
        series, _bar, frame = identity.rpartition("|")
        camera = camera_of(node)
        if camera is not None:
            found[series] = FoundView(camera, int(frame or 0))
    return found
