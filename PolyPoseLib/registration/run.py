"""What every step of one registration shares."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace

from PolyPoseLib.data.displacement_field import DisplacementField
from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.registration.articulations import Articulation
from PolyPoseLib.registration.fit.soft_tissue import SoftTissue
from PolyPoseLib.registration.scene import Scene
from PolyPoseLib.rendering.backend import Backend

Preview = Callable[[DisplacementField], str | None]
"""Takes a coarse displacement field (fixed to moving) and returns the file that it was written to."""


HELD, HELD_FROM, HELD_WHOLLY = 100.0, 0.3, 0.7
"""How many times more weight the joints of a hidden structure have, the shares hidden from which they gain weight and
at which they have all of it: what the X-rays do not show stays near its neighbours. Wires and instruments hide up to
0.2, pedicle screws and a prosthesis 0.4 to 0.5."""


@dataclass(frozen=True)
class Run:
    """The patient, the renderer and the monitor of one registration, with the name of the present stage.

    Parameters
    ----------
    soft_tissue : SoftTissue
        The scene with its smooth warp.
    backend : Backend
        Carries out the rays.
    monitor : Monitor
        Takes the progress, and raises CancelledError when the caller wants to stop.
    stage : str
        Name of the present stage in the progress.
    preview : callable, optional
        Takes coarse displacement fields while bones are fitted.
    magnification : float
        How many times larger than the patient the scene is (:mod:`PolyPoseLib.registration.magnification`); lengths
        that people read are divided by it.
    hidden : mapping of int to float
        Shares, 0 to 1, that metal hides of the structures that their joints hold the more for it.
    level_mm : float, optional
        Size of the pixels and voxels of the present resolution level, in the scene; None where there are no levels.

    """

    soft_tissue: SoftTissue
    backend: Backend
    monitor: Monitor
    stage: str = "registration"
    preview: Preview | None = None
    magnification: float = 1.0
    hidden: Mapping[int, float] = field(default_factory=dict)
    level_mm: float | None = None

    @property
    def scene(self) -> Scene:
        """The CT taken apart for rendering."""
        return self.soft_tissue.scene

    @property
    def articulations(self) -> list[Articulation]:
        """The scene's joints and companions, those of hidden structures with more weight."""
        return [
            replace(
                joint,
                weight=joint.weight * (1 + HELD * max(self._held(joint.first), self._held(joint.second))),
            )
            for joint in [*self.scene.articulations, *self.scene.companions]
        ]

    def _held(self, k: int) -> float:
        """From 0 to 1, by how much of a structure is hidden."""
        part = (self.hidden.get(k, 0.0) - HELD_FROM) / (HELD_WHOLLY - HELD_FROM)
        return min(max(part, 0.0), 1.0)

    def named(self, stage: str) -> Run:
        """The same run in another stage."""
        return replace(self, stage=stage, level_mm=None)

    def at_level(self, size_mm: float | None) -> Run:
        """The same stage at a resolution level."""
        return replace(self, level_mm=size_mm)

    def step(
        self,
        iteration: int,
        of: int,
        similarity: float | None = None,
        field: Callable[[], DisplacementField] | None = None,
    ) -> None:
        """Report one iteration of the stage.

        Parameters
        ----------
        iteration, of : int
            How far the stage is, 0 <= iteration <= of.
        similarity : float, optional
            Mean over the views, in [-1, 1].
        field : callable, optional
            Returns the present coarse displacement field; called only when somebody wants a preview.

        Raises
        ------
        CancelledError
            When the caller wants to stop.

        """
        preview = self.preview
        show = (lambda: preview(field())) if preview is not None and field is not None else None
        level_mm = None if self.level_mm is None else self.level_mm / self.magnification
        self.monitor.step(self.stage, iteration, of, similarity, show, level_mm)

    def timed(self) -> AbstractContextManager[None]:
        """Count the time spent inside as the stage's."""
        return self.monitor.timed(self.stage)
