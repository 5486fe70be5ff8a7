"""A result as a folder of DICOM objects: all of them or none."""

from __future__ import annotations

import logging
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib.data.result import Result
from PolyPoseLib.errors import InputError, unknown_name
from PolyPoseLib.io.dicom_export.behind import slices_behind
from PolyPoseLib.io.dicom_export.ct_images import write_converted, write_warped
from PolyPoseLib.io.dicom_export.inputs import CtChoice, ExportInputs, read_inputs
from PolyPoseLib.io.dicom_export.objects import RESEARCH_ONLY, Export, Series, save_object, text_of
from PolyPoseLib.io.dicom_export.parts import BONES, CONTENTS, CONTOURS, DEFORMATION, PARTS, SEGMENTATION
from PolyPoseLib.io.dicom_export.references import images_of
from PolyPoseLib.io.dicom_export.registrations import (
    Warped,
    deformable_registration,
    spatial_registration,
)
from PolyPoseLib.io.dicom_export.segmentation import (
    Segment,
    require_highdicom,
    segmentation,
    segments_present,
)
from PolyPoseLib.io.dicom_export.structure_set import structure_set
from PolyPoseLib.io.disk_space import require_space
from PolyPoseLib.io.whole_folders import claimed_folder

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

_LOG = logging.getLogger(__name__)


def export_dicom(
    result: Result,
    study: str | Path,
    folder: str | Path,
    choice: CtChoice | None = None,
    leave_out: Collection[str] = (),
) -> Path:
    """Write a result as DICOM, for planning systems.

    Parameters
    ----------
    result : Result
        Of a registration; ``load_result`` reads one.
    study : path
        The study's JSON file, which names the CT and its labels.
    folder : path
        New or empty.
    choice : CtChoice, optional
        Which CT is taken, where it is not the one that the study names.
    leave_out : collection of str
        Of `PARTS`.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        What was given does not suffice or does not belong together, or the system refuses to write; the sentence names
        the file and the fix, and nothing is left behind.

    """
    for part in leave_out:
        if part not in PARTS:
            raise InputError(unknown_name("part of an export", part, PARTS))
    if SEGMENTATION not in leave_out:
        require_highdicom()
    with claimed_folder(folder, overwrite=None) as claim:
        inputs = read_inputs(Path(study), result, choice or CtChoice())
        segments = segments_present(inputs.warped_labels, inputs.names, inputs.bones)
        require_space(claim.folder, _bytes_of(result, inputs, segments))
        with claim.whole() as temporary:
            _write((result, inputs, segments), temporary, leave_out)
    return Path(folder)


Content = tuple[Result, ExportInputs, list[Segment]]
"""The result, what it needs, and the segments of its labels."""


def _write(content: Content, folder: Path, leave_out: Collection[str]) -> None:
    """Write every object that is wanted."""
    writer = _Writer(content, folder)
    writer.write_original()
    writer.write_ct()
    if not content[2]:
        _LOG.warning("No label lies on the warped CT's grid: there are no segments and no contours to write.")
        leave_out = {*leave_out, SEGMENTATION, CONTOURS}
    if SEGMENTATION not in leave_out:
        writer.write_segmentation()
    if CONTOURS not in leave_out:
        writer.write_contours()
    if DEFORMATION not in leave_out:
        writer.write_deformation()
    if BONES not in leave_out:
        writer.write_bones()
    (folder / "README.txt").write_text(contents_text(content[0], folder), encoding="utf-8")


class _Writer:
    """Writes the objects of one export; the warped CT comes first, since the others refer to it."""

    def __init__(self, content: Content, folder: Path) -> None:
        self.result, self.inputs, self.segments = content
        texts = (*(each.name for each in self.segments), *_texts(self.result))
        self.export = Export(self.inputs.source, texts, _note(self.result))
        self.folder = folder
        self.headers: list[Dataset] = []
        self.warped_series = self._series("CT", 1, "CT in the posture of the X-rays")

    def write_original(self) -> None:
        """The CT, where it was not DICOM."""
        if self.inputs.ct is None:
            return
        number = self._series("CT", 0, "").number
        own = Series("CT", number, "CT before registration", self.export.source.uid)
        write_converted(self.export, self.inputs.ct, own, self._made("original_ct"))

    def write_ct(self) -> None:
        """The warped CT."""
        ct = self.inputs.warped_ct
        behind = slices_behind(self.export.source, ct, self.result.transform)
        self.headers = write_warped(self.export, ct, self.warped_series, behind, self._made("ct"))

    def write_segmentation(self) -> None:
        """The warped labels."""
        own = self._series("SEG", 2, "labels in the posture of the X-rays")
        made = segmentation(self.export, own, self.inputs.warped_labels, self.segments, self.headers)
        save_object(made, self.folder / "segmentation.dcm")

    def write_contours(self) -> None:
        """The warped labels once more."""
        own = self._series("RTSTRUCT", 3, "contours in the posture of the X-rays")
        made = structure_set(self.export, own, self._warped(), self.inputs.warped_labels, self.segments)
        save_object(made, self.folder / "contours.dcm")

    def write_deformation(self) -> None:
        """The displacement field."""
        own = self._series("REG", 4, "deformation between CT and X-rays")
        made = deformable_registration(self.export, own, self._warped(), self.result.transform)
        save_object(made, self.folder / "deformation.dcm")

    def write_bones(self) -> None:
        """Every bone's own motion, the anchor's, which is none, among them."""
        place = self._made("bones")
        for number, (name, structure) in enumerate(self.result.structures.items(), start=1):
            own = self._series("REG", 4 + number, f"rigid motion of {name}")
            made = spatial_registration(self.export, own, self._warped(), name, structure)
            save_object(made, place / bone_file(number, name))

    def _series(self, modality: str, number: int, description: str) -> Series:
        maker = "PolyPose" if self.result.trusted else "PolyPose, NOT TRUSTED"
        return self.export.series(modality, number, f"{maker}: {description}")

    def _warped(self) -> Warped:
        return Warped(self.warped_series, images_of(self.headers))

    def _made(self, name: str) -> Path:
        """A new folder within."""
        place = self.folder / name
        place.mkdir()
        return place


def contents_text(result: Result, folder: Path) -> str:
    """What the folder holds, for people."""
    lines = [RESEARCH_ONLY, "", *(f"NOT TRUSTED: {reason}" for reason in result.distrust)]
    for name, text in CONTENTS.items():
        if (folder / name).exists():
            lines += [name, *(f"    {line}" for line in text)]
    if (folder / BONES).exists():
        lines += [
            f"    {bone_file(n, name)}: {text_of(name)}" for n, name in enumerate(result.structures, start=1)
        ]
    return "\n".join(lines) + "\n"


def bone_file(number: int, name: str) -> str:
    """The name of a bone's file, in small letters of ASCII; number: from 1."""
    word = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")[:40] or "bone"
    return f"{number:02d}_{word}.dcm"


def _texts(result: Result) -> list[str]:
    """Names and reasons that objects hold."""
    return [
        *result.structures,
        *result.distrust,
        *(d for each in result.structures.values() for d in each.doubts),
    ]


def _note(result: Result) -> str:
    """What a reader of an image must know."""
    reasons = " ".join(result.distrust)
    return text_of(f"NOT TRUSTED: {reasons} {RESEARCH_ONLY}", 2000) if reasons else RESEARCH_ONLY


def _bytes_of(result: Result, inputs: ExportInputs, segments: Sequence[Segment]) -> float:
    """About how many bytes an export takes on the disk."""
    _, rows, columns = inputs.warped_ct.shape
    slices = len(inputs.source.images)
    images = 2.0 * inputs.warped_ct.voxels.size * (1 if inputs.ct is None else 2)
    frames = sum(each.slices for each in segments) * (rows * columns / 8 + 6000)
    references = 500.0 * slices * (len(result.structures) + 20)
    return images + frames + 12.0 * float(np.prod(result.transform.shape)) + references + 2e6
