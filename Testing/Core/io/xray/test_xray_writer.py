"""Simulated X-rays as DICOM: what is written comes back, and the file is a proper XA image."""

import numpy as np
import pydicom
import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.geometry.carm import carm_extrinsic
from PolyPoseLib.io.xray.read import read_xray
from PolyPoseLib.io.xray.storage import Storage
from PolyPoseLib.io.xray.writer import Stand, write_xray_dicom

GEOMETRY = dict(source_to_detector_mm=1020.0, pixel_spacing_mm=(0.4, 0.3), source_to_isocenter_mm=700.0)


def write(path, image, study="", **settings):
    """Write an image with settings of the stand and of the storage side by side."""
    stand = {key: settings.pop(key) for key in Stand.__dataclass_fields__ if key in settings}
    return write_xray_dicom(path, image, Stand(**stand), Storage(**settings), study=study)


def lines(seed=0, shape=(40, 60), high=6.0):
    return np.random.default_rng(seed).uniform(0.2, high, shape)


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16])
@pytest.mark.parametrize("display", ["source", "detector"])
def test_intensities_return_within_half_a_step(tmp_path, bits, display):
    truth = lines(high=4.0)
    xray = read_xray(write(tmp_path / "x.dcm", truth, bits=bits, display=display, **GEOMETRY))
    stored = (2**bits - 1) * np.exp(-truth)
    step = -np.log(1 - 0.5 / np.maximum(stored, 1.01))
    image = xray.image if display == "source" else xray.image[:, ::-1]
    assert (np.abs(image - truth) <= step + 1e-5).all()
    assert xray.mask.all()


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_logarithms_return_within_half_a_step(tmp_path, bits):
    truth = lines(high=9.0)
    xray = read_xray(write(tmp_path / "x.dcm", truth, bits=bits, encoding="log", **GEOMETRY))
    np.testing.assert_allclose(xray.image, truth, atol=0.51 * truth.max() / (2**bits - 1) + 1e-6)


@pytest.mark.parametrize("encoding", ["linear", "log"])
def test_a_burnt_out_beam_returns_at_its_level(tmp_path, encoding):
    truth = lines()
    written = write(tmp_path / "x.dcm", truth, bits=16, encoding=encoding, saturation=1.0, **GEOMETRY)
    np.testing.assert_allclose(read_xray(written).image, np.maximum(truth, 1.0), atol=5e-3)


@pytest.mark.parametrize("display", ["source", "detector"])
@pytest.mark.parametrize("seed", range(5))
def test_angles_and_orientation_lead_back_to_the_extrinsic(tmp_path, display, seed):
    rng = np.random.default_rng(seed)
    angles = rng.uniform((-170, -70), (170, 70))
    extrinsic = carm_extrinsic(*angles, 700, rng.normal(0, 100, 3), detector_rotation_deg=90 * (seed % 4))
    path = write(tmp_path / "x.dcm", lines(), extrinsic=extrinsic, display=display, **GEOMETRY)
    isocenter = np.linalg.inv(extrinsic) @ (0, 0, 700, 1)
    xray = read_xray(path, isocenter=isocenter[:3])
    np.testing.assert_allclose(xray.extrinsic, extrinsic, atol=1e-8)
    assert xray.mirrored is (display == "detector")
    again = read_xray(path, fields={"extrinsic": extrinsic.tolist(), "camera": "known"})
    assert again.mirrored is xray.mirrored
    np.testing.assert_array_equal(again.image, xray.image)


def test_angles_alone_are_enough(tmp_path):
    path = write(tmp_path / "x.dcm", lines(), primary_deg=-25, secondary_deg=8, **GEOMETRY)
    np.testing.assert_allclose(read_xray(path).extrinsic, carm_extrinsic(-25, 8, 700), atol=1e-9)


def test_the_detector_returns(tmp_path):
    xray = read_xray(write(tmp_path / "x.dcm", lines(), **GEOMETRY))
    assert xray.source_to_detector_mm == 1020
    assert xray.pixel_spacing_mm == (0.4, 0.3)
    assert xray.camera == "absent"


def test_photon_noise_is_seeded_and_has_the_right_size(tmp_path):
    truth = np.full((60, 60), 2.0)
    truth[0] = 0.0
    photons = 1e4
    read = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        path = write(
            tmp_path / f"{name}.dcm", truth, bits=16, saturation=0.0, photons=photons, seed=seed, **GEOMETRY
        )
        read.append(read_xray(path).image)
    np.testing.assert_array_equal(read[0], read[1])
    assert not np.array_equal(read[0], read[2])
    expected = 1 / np.sqrt(photons * np.exp(-2))
    assert read[0][1:].std() == pytest.approx(expected, rel=0.1)
    assert read[0][1:].mean() == pytest.approx(2, abs=0.005)


def test_a_run_keeps_its_frames(tmp_path):
    run = lines(shape=(3, 20, 30))
    path = write(tmp_path / "x.dcm", run, bits=16, **GEOMETRY)
    for index in range(3):
        np.testing.assert_allclose(read_xray(path, frame=index).image, run[index], atol=3e-3)


@pytest.mark.parametrize("encoding", ["linear", "log"])
def test_the_file_is_a_valid_anonymous_xa_image(tmp_path, encoding):
    path = write(
        tmp_path / "x.dcm",
        lines(),
        encoding=encoding,
        primary_deg=1,
        secondary_deg=2,
        study="case",
        **GEOMETRY,
    )
    ds = pydicom.dcmread(path)
    assert ds.file_meta.TransferSyntaxUID == "1.2.840.10008.1.2.1"
    assert ds.SOPClassUID == ds.file_meta.MediaStorageSOPClassUID == "1.2.840.10008.5.1.4.1.1.12.1"
    assert ds.SOPInstanceUID == ds.file_meta.MediaStorageSOPInstanceUID
    assert str(ds.PatientName) == "ANONYMOUS"
    assert ds.PatientIdentityRemoved == "YES"
    required = (
        "StudyInstanceUID SeriesInstanceUID Modality ImageType Rows Columns BitsAllocated BitsStored HighBit "
    )
    required += "PixelRepresentation PhotometricInterpretation PixelIntensityRelationship RadiationSetting"
    for keyword in required.split():
        assert keyword in ds
        assert ds[keyword].value is not None
    optional = (
        "PatientBirthDate PatientSex StudyDate StudyTime StudyID AccessionNumber ReferringPhysicianName KVP "
    )
    for keyword in (optional + "PositionerPrimaryAngle PositionerSecondaryAngle PatientOrientation").split():
        assert keyword in ds
    assert ("ModalityLUTSequence" in ds) is (encoding == "log")
    other = pydicom.dcmread(write(tmp_path / "y.dcm", lines(1), study="case", **GEOMETRY))
    assert other.StudyInstanceUID == ds.StudyInstanceUID
    assert other.SOPInstanceUID != ds.SOPInstanceUID


def test_the_standards_own_attributes_are_enough_for_other_readers(tmp_path):
    # Without the private scale, line integrals return up to a constant (LIN) or from the Modality LUT (LOG).
    truth = lines(high=4.0)
    truth[:5, :20] = 0.0
    for encoding, tolerance in (("linear", 0.02), ("log", 0.01)):
        path = write(tmp_path / "x.dcm", truth, encoding=encoding, **GEOMETRY)
        ds = pydicom.dcmread(path)
        ds.remove_private_tags()
        ds.save_as(path)
        image = read_xray(path).image
        np.testing.assert_allclose(image - image[5:].mean(), truth - truth[5:].mean(), atol=tolerance)


def test_writing_twice_gives_the_same_bytes(tmp_path):
    a = write(tmp_path / "a.dcm", lines(), photons=1e4, **GEOMETRY).read_bytes()
    assert a == write(tmp_path / "b.dcm", lines(), photons=1e4, **GEOMETRY).read_bytes()


@pytest.mark.parametrize(
    "change",
    [
        {"bits": 7},
        {"bits": 17},
        {"bits": 12.0},
        {"encoding": "linar"},
        {"saturation": -1},
        {"photons": 0},
        {"display": "left"},
        {"patient_position": "XX"},
        {"pixel_spacing_mm": (0.4, 0)},
        {"source_to_detector_mm": np.nan},
        {"source_to_isocenter_mm": 2000},
        {"extrinsic": np.zeros((4, 4))},
    ],
)
def test_settings_that_cannot_be_stored_are_refused(tmp_path, change):
    with pytest.raises(InputError):
        write(tmp_path / "x.dcm", lines(), **{**GEOMETRY, **change})
    assert not (tmp_path / "x.dcm").exists()


def test_values_that_cannot_be_stored_are_refused(tmp_path):
    for bad in (np.full((20, 20), np.nan), np.zeros(20), np.zeros((0, 5))):
        with pytest.raises(InputError):
            write(tmp_path / "x.dcm", bad, **GEOMETRY)
    with pytest.raises(InputError, match="cannot be written"):
        write(tmp_path / "no" / "x.dcm", lines(), **GEOMETRY)
