"""The warped labels as a DICOM Segmentation (PS3.3 A.51), written by highdicom."""

from __future__ import annotations

import importlib.util
import logging
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from PolyPoseLib import __version__
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.dicom import quiet_pydicom
from PolyPoseLib.io.dicom_export.objects import DERIVATION, MAKER, Export, Series, text_of
from PolyPoseLib.io.dicom_export.segment_codes import ANATOMY, Coded, segment_code
from PolyPoseLib.io.dicom_export.source import new_uid

if TYPE_CHECKING:
    from highdicom.seg import SegmentDescription
    from highdicom.sr import CodedConcept
    from pydicom.dataset import Dataset

LONGEST_NAME = 64
"""Characters of a segment's label (LO)."""


@dataclass(frozen=True)
class Segment:
    """A label that a segmentation holds.

    Attributes
    ----------
    label
        Its number among the voxels.
    name
        For people.
    is_bone
        Whether a structure of the study has it.
    slices
        How many slices hold it.

    """

    label: int
    name: str
    is_bone: bool
    slices: int = 1


def require_highdicom() -> None:
    """Raise InputError where the package that writes segmentations is missing."""
    if importlib.util.find_spec("highdicom") is None:
        raise InputError(
            'DICOM segmentations need highdicom, which is not installed: pip install "polypose[dicom]", or leave the '
            "segmentation out."
        )


def segments_present(labels: Volume, names: Mapping[int, str], bones: Collection[int]) -> list[Segment]:
    """The labels that voxels hold, each with a name of its own.

    Parameters
    ----------
    labels
        0 is background.
    names
        Of labels; others are called by their number.
    bones
        Labels of the study's structures.

    """
    highest = int(labels.voxels.max())
    slices = np.zeros(highest + 1, int)
    for section in labels.voxels:
        slices += np.bincount(section.ravel(), minlength=highest + 1) > 0
    found: list[Segment] = []
    taken: set[str] = set()
    for label in (int(each) for each in np.flatnonzero(slices) if each):
        name = text_of(names.get(label, f"label {label}"), LONGEST_NAME)
        if name in taken:
            name = f"{name[: LONGEST_NAME - 8]} ({label})"
        taken.add(name)
        found.append(Segment(label, name, label in bones, int(slices[label])))
    return found


def segmentation(
    export: Export, series: Series, labels: Volume, segments: Sequence[Segment], images: Sequence[Dataset]
) -> Dataset:
    """A binary segmentation in the frame of reference of the patient as X-rayed.

    Parameters
    ----------
    export
        Patient, study and time.
    series
        The object's own.
    labels
        On the grid of the images.
    segments
        At least one; others are left out.
    images
        The warped CT's slices without pixels, in the order of k.

    Returns
    -------
    Dataset
        A Segmentation Storage object.

    Raises
    ------
    InputError
        highdicom is missing, or finds something that the standard does not allow.

    """
    require_highdicom()
    with _quiet():
        from highdicom.seg import Segmentation

        numbers = np.zeros(int(labels.voxels.max()) + 1, np.min_scalar_type(len(segments)))
        numbers[[each.label for each in segments]] = np.arange(1, len(segments) + 1)
        try:
            made = Segmentation(
                source_images=[_in_unicode(images[0]), *images[1:]],
                pixel_array=numbers[labels.voxels],
                segmentation_type="BINARY",
                segment_descriptions=[_description(n, each) for n, each in enumerate(segments, start=1)],
                series_instance_uid=series.uid,
                series_number=series.number,
                sop_instance_uid=new_uid(),
                instance_number=1,
                manufacturer=MAKER,
                manufacturer_model_name=MAKER,
                software_versions=__version__,
                device_serial_number=__version__,
                content_description="Labels of the CT, carried along",
                content_label="WARPED_LABELS",
                series_description=series.description,
            )
        except (ValueError, TypeError, AttributeError, KeyError):
            raise InputError(
                "The CT's header does not suffice for a DICOM segmentation: export the CT from the archive again, or "
                "leave the segmentation out."
            ) from None
        if export.character_set is not None:
            made.SpecificCharacterSet = export.character_set
        made.add_new("SeriesDate", "DA", export.date)
        made.add_new("SeriesTime", "TM", export.time)
        made.update(export.region)
        made.pop("Laterality", None)  # not of segmentations: each segment has its own
        made.DerivationDescription = DERIVATION
        return made


def _in_unicode(image: Dataset) -> Dataset:
    """The image, which highdicom takes for a model, without its character set: some sets it refuses.

    The text is decoded already, and is encoded when the segmentation is written.
    """
    from pydicom.dataset import Dataset

    model = Dataset()
    model.update(image)
    model.pop("SpecificCharacterSet", None)
    return model


def _description(number: int, segment: Segment) -> SegmentDescription:
    """A segment's name, code and origin."""
    from highdicom import AlgorithmIdentificationSequence
    from highdicom.seg import SegmentDescription

    code = segment_code(segment.name, segment.is_bone)
    made = SegmentDescription(
        segment_number=number,
        segment_label=segment.name,
        segmented_property_category=_concept(ANATOMY),
        segmented_property_type=_concept(code.kind),
        algorithm_type="SEMIAUTOMATIC",
        algorithm_identification=AlgorithmIdentificationSequence(
            name=MAKER, family=_concept(("123111", "DCM", "Deformable Models")), version=__version__
        ),
        tracking_uid=new_uid(),
        tracking_id=segment.name,
    )
    if code.side is not None:
        kind = made.SegmentedPropertyTypeCodeSequence[0]
        kind.SegmentedPropertyTypeModifierCodeSequence = [_concept(code.side)]
    return made


def _concept(code: Coded) -> CodedConcept:
    """A code as highdicom takes it."""
    from highdicom.sr import CodedConcept

    return CodedConcept(*code)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence highdicom, whose log repeats patients' names."""
    logger = logging.getLogger("highdicom")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)
    try:
        with quiet_pydicom():
            yield
    finally:
        logger.setLevel(level)
