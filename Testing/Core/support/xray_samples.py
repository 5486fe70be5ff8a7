"""Small DICOM X-rays made for the tests."""

from pathlib import Path

import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import ExplicitVRLittleEndian, generate_uid

HEADERS = Path(__file__).resolve().parents[4] / "shared" / "data" / "dicom_headers"

CLASSES = {
    "XA": "1.2.840.10008.5.1.4.1.1.12.1",
    "RF": "1.2.840.10008.5.1.4.1.1.12.2",
    "CR": "1.2.840.10008.5.1.4.1.1.1",
    "DX": "1.2.840.10008.5.1.4.1.1.1.1",
    "MG": "1.2.840.10008.5.1.4.1.1.1.2",
    "RTIMAGE": "1.2.840.10008.5.1.4.1.1.481.1",
    "CT": "1.2.840.10008.5.1.4.1.1.2",
}

SECRET = "Doe^Jane"
"""A patient's name that no message may repeat."""


def random_pixels(seed=0, shape=(24, 32), high=4000):
    return np.random.default_rng(seed).integers(1, high, shape, dtype=np.uint16)


def dataset(pixels=None, modality="XA", *, bits=12, known=True, **attributes):
    """A file of this modality; `known` adds distance and imager pixel spacing."""
    pixels = random_pixels() if pixels is None else np.asarray(pixels)
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    ds.file_meta.MediaStorageSOPClassUID = ds.SOPClassUID = CLASSES[modality]
    ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPInstanceUID = generate_uid()
    ds.PatientName, ds.PatientID, ds.Modality = SECRET, "SECRET42", modality
    ds.SamplesPerPixel, ds.PhotometricInterpretation = 1, "MONOCHROME2"
    ds.Rows, ds.Columns = pixels.shape[-2:]
    ds.BitsAllocated, ds.BitsStored, ds.HighBit = 8 * pixels.itemsize, bits, bits - 1
    ds.PixelRepresentation = int(pixels.dtype.kind == "i")
    if pixels.ndim == 3:
        ds.NumberOfFrames = len(pixels)
    if known:
        if modality == "RTIMAGE":
            ds.RTImageSID, ds.ImagePlanePixelSpacing = 1500, [0.4, 0.4]
        else:
            ds.DistanceSourceToDetector, ds.ImagerPixelSpacing = 1000, [0.5, 0.4]
    if modality in ("XA", "RF"):
        ds.PixelIntensityRelationship = "LIN"
    raw = pixels.tobytes()
    ds.add_new("PixelData", "OB" if pixels.itemsize == 1 else "OW", raw + b"\0" * (len(raw) % 2))
    for keyword, value in attributes.items():
        if value is None and keyword in ds:
            delattr(ds, keyword)
        else:
            setattr(ds, keyword, value)
    return ds


def save(ds, path):
    ds.save_as(path, enforce_file_format=True)
    return path
