"""Attributes that derived objects take over from the CT: the patient's, the study's, and how the CT was acquired."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from PolyPoseLib.io.dicom import quiet_pydicom

if TYPE_CHECKING:
    from pydicom.dataelem import DataElement
    from pydicom.dataset import Dataset

_LOG = logging.getLogger(__name__)

IDENTITY = ("PatientID", "PatientName", "StudyInstanceUID")
"""Taken over as they are, valid or not: by these a planning system finds the patient and the study."""

REQUIRED = (
    "PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyDate", "StudyTime", "ReferringPhysicianName",
    "StudyID", "AccessionNumber",
)  # fmt: skip
"""Present in every object, empty where they are not known (type 2)."""

PATIENT = (
    *IDENTITY, *REQUIRED,
    "IssuerOfPatientID", "IssuerOfPatientIDQualifiersSequence", "TypeOfPatientID", "OtherPatientIDsSequence",
    "PatientBirthTime", "OtherPatientNames", "EthnicGroup", "QualityControlSubject", "PatientSpeciesDescription",
    "PatientSpeciesCodeSequence", "PatientBreedDescription", "PatientBreedCodeSequence", "BreedRegistrationSequence",
    "ResponsiblePerson", "ResponsiblePersonRole", "ResponsibleOrganization", "PatientIdentityRemoved",
    "DeidentificationMethod", "DeidentificationMethodCodeSequence", "ClinicalTrialSponsorName",
    "ClinicalTrialProtocolID", "ClinicalTrialProtocolName", "ClinicalTrialSiteID", "ClinicalTrialSiteName",
    "ClinicalTrialSubjectID", "ClinicalTrialSubjectReadingID",
    "StudyDescription", "IssuerOfAccessionNumberSequence", "ReferringPhysicianIdentificationSequence",
    "ProcedureCodeSequence", "PatientAge", "PatientSize", "PatientWeight", "PregnancyStatus", "PatientSexNeutered",
    "ClinicalTrialTimePointID", "ClinicalTrialTimePointDescription",
)  # fmt: skip
"""Patient, Clinical Trial, General Study and Patient Study modules (PS3.3 C.7.1, C.7.2)."""

REGION = ("BodyPartExamined", "AnatomicRegionSequence", "Laterality")
"""Where in the body (PS3.3 C.7.3.1)."""

PAIRED_PARTS = (
    "ANKLE", "ARM", "CALCANEUS", "CLAVICLE", "ELBOW", "EXTREMITY", "FEMUR", "FOOT", "FOREARM", "HAND", "HIP", "HUMERUS",
    "KNEE", "LEG", "SCAPULA", "SHOULDER", "THIGH", "WRIST",
)  # fmt: skip
"""Values of Body Part Examined (PS3.16 L) of which people have two."""

ACQUISITION = (
    "PatientPosition", "AcquisitionDate", "AcquisitionTime", "AcquisitionNumber", "KVP", "ContrastBolusAgent",
    "ContrastBolusRoute", "ReconstructionDiameter", "ConvolutionKernel", "WindowCenter", "WindowWidth",
    "LossyImageCompression", "LossyImageCompressionRatio", "LossyImageCompressionMethod",
)  # fmt: skip
"""Of the CT Image: true of every image that is derived from it."""

SCANNER = (
    "Manufacturer", "ManufacturerModelName", "InstitutionName", "StationName", "DeviceSerialNumber",
    "SoftwareVersions",
)  # fmt: skip
"""Of the equipment that acquired the CT (PS3.3 C.12.1, Contributing Equipment Sequence)."""

_SEXES = ("M", "F", "O")

_TOGETHER = ("WindowCenter", "WindowWidth")
"""Of no use, and not allowed, one without the other."""


def taken_over(header: Dataset, keywords: Iterable[str], whose: str = "The CT") -> Dataset:
    """The attributes of a header that are there and valid, with text in Unicode.

    Attributes that are invalid are left out with a warning, which names no value: a file may not be refused by the
    receiver for what another device wrote wrongly.

    Parameters
    ----------
    header : Dataset
        Of a slice; values of any quality.
    keywords : iterable of str
        Which attributes.
    whose : str
        For the warning.

    Returns
    -------
    Dataset
        Of plain values.

    """
    from pydicom.dataset import Dataset

    found, wrong = Dataset(), []
    with quiet_pydicom():
        for keyword in dict.fromkeys(keywords):
            try:
                if keyword not in header:
                    continue
                element = header[keyword]
                if keyword not in IDENTITY:
                    _require_valid(element, keyword)
            except Exception:  # pydicom raises nearly every kind for values that are none
                wrong.append(keyword)
                continue
            found.add(element)
        if len({len(_values(found[each])) if each in found else 0 for each in _TOGETHER}) > 1:
            for each in _TOGETHER:
                found.pop(each, None)
    if wrong:
        _LOG.warning("%s's attributes %s are not valid DICOM and are left out.", whose, ", ".join(wrong))
    return found


def _require_valid(element: DataElement, keyword: str) -> None:
    """Raise an exception where a value breaks the rules of its kind, or those of a code."""
    from pydicom import config
    from pydicom.datadict import dictionary_VR
    from pydicom.dataset import Dataset
    from pydicom.filebase import DicomBytesIO
    from pydicom.filewriter import write_dataset
    from pydicom.valuerep import DA, TM, validate_value

    if element.VR not in dictionary_VR(element.tag):
        raise ValueError(keyword)
    for value in _values(element):
        if element.VR == "SQ":
            for inner in value:
                _require_valid(inner, "")
            continue
        if element.VR == "DA" and value:
            DA(str(value))
        elif element.VR == "TM" and value:
            TM(str(value))
        validate_value(element.VR, value if isinstance(value, bytes) else str(value), config.RAISE)
        if keyword == "PatientSex" and value and value not in _SEXES:
            raise ValueError(keyword)
    alone = Dataset()
    alone.SpecificCharacterSet = "ISO_IR 192"
    alone.add(element)
    stream = DicomBytesIO()
    stream.is_little_endian, stream.is_implicit_VR = True, False
    write_dataset(stream, alone)


def _values(element: DataElement) -> list[Any]:
    """The values of an element: none where it is empty."""
    value = element.value
    if element.VR == "SQ" or (isinstance(value, list | tuple) or type(value).__name__ == "MultiValue"):
        return list(value)
    return [] if value is None or value == "" else [value]
