"""Real files with their oddities: each gives a good image or the right sentence."""

import numpy as np
import pytest
from xray_samples import HEADERS

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.xray.read import read_xray

pytestmark = pytest.mark.skipif(
    not HEADERS.is_dir(), reason="the real DICOM samples (../shared/data/dicom_headers) are not here"
)

GEOMETRY = {"source_to_detector_mm": 1000, "pixel_spacing_mm": [0.4, 0.4]}


def read(name, frame=None, **fields):
    matches = sorted(HEADERS.glob(f"{name}*.dcm"))
    if not matches:
        pytest.skip(f"no sample named {name}")
    return read_xray(matches[0], fields=fields, frame=frame)


@pytest.mark.parametrize("name", ["CR_fodicom", "CR_pydicomdata", "XA_fodicom"])
def test_files_without_geometry_ask_for_the_two_fields(name):
    with pytest.raises(InputError, match=r'"source_to_detector_mm" and "pixel_spacing_mm"'):
        read(name)


def test_a_radiograph_without_preamble_shows_the_spine_bright():
    xray = read("CR_fodicom", **GEOMETRY)
    assert xray.image.shape == (440, 440)
    lung, spine = xray.image[180:230, 120:150].mean(), xray.image[180:300, 210:230].mean()
    assert spine > lung + 1
    assert any("MONOCHROME1" in line for line in xray.provenance)
    # View position PA and no orientation: displayed facing the patient, so mirrored against the source's
    # view.
    assert xray.mirrored


def test_a_jpeg_2000_radiograph_is_decoded_and_its_collimator_masked():
    xray = read("CR_pydicomdata", **GEOMETRY)
    assert xray.image.shape == (1760, 1760)
    assert 0.4 < xray.mask.mean() < 0.8
    assert not xray.mask[:, :200].any()
    bone, air = xray.image[400:900, 860:910].max(), xray.image[400:900, 1180:1200].mean()
    assert bone > air + 2


def test_a_radiograph_processed_for_presentation_is_read_with_its_uncertain_spacing():
    xray = read("DX_highdicom")
    assert xray.source_to_detector_mm == 1000
    np.testing.assert_allclose(xray.pixel_spacing_mm, (1.2, 1.2012), atol=1e-6)
    np.testing.assert_allclose(xray.intrinsics[:2, 2], (105, 84))
    assert any("field of view" in line for line in xray.warnings)
    assert any("processed for presentation" in line for line in xray.provenance)
    # Air around the animal is the least attenuating, its spine among the most.
    assert xray.image[164:, 60:150].mean() < 0.5
    assert xray.image[40:60, 100:160].mean() > 2


def test_a_mammogram_whose_sign_contradicts_its_display_shows_the_needle_guide_bright():
    xray = read("MG_fodicom")
    assert xray.image.shape == (788, 1318)
    assert xray.pixel_spacing_mm == (0.085, 0.085)
    assert xray.source_to_detector_mm == 650
    assert xray.image[60:120, 1040:1060].mean() > xray.image[60:120, 300:600].mean() + 2
    assert any("contradicts" in line for line in xray.warnings)
    assert xray.camera == "absent"
    assert xray.mask.all()


def test_a_portal_image_has_its_distances_and_gantry():
    xray = read("RTIMAGE_pynetdicom")
    assert xray.source_to_detector_mm == 1600
    assert xray.pixel_spacing_mm == (0.402, 0.402)
    assert xray.camera == "initial"
    np.testing.assert_allclose(xray.extrinsic[:3, :3], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)
    np.testing.assert_allclose(xray.extrinsic[:3, 3], (0, 0, 1000), atol=1e-9)
    # The small open field is the least attenuated part.
    assert xray.image[500:524, 500:524].mean() < xray.image[:200, :200].mean() - 2


def test_an_angiogram_of_96_jpeg_frames():
    xray = read("XA_fodicom", **GEOMETRY)
    assert any('48 (counted from 0), is used; add "frame"' in line for line in xray.warnings)
    assert any("RAO 32, CRA 2" in line for line in xray.provenance)
    assert 0.6 < xray.mask.mean() < 0.85
    assert not xray.mask[:10, :10].any()
    assert xray.camera == "initial"
    assert xray.extrinsic[2, 0] < 0
    first, last = read("XA_fodicom", frame=0, **GEOMETRY), read("XA_fodicom", frame=95, **GEOMETRY)
    assert not np.array_equal(first.image, last.image)
    with pytest.raises(InputError, match="from 0 to 95"):
        read("XA_fodicom", frame=96, **GEOMETRY)


def test_no_patient_is_named():
    for path in sorted(HEADERS.glob("*.dcm")):
        import pydicom

        secrets = pydicom.dcmread(path, force=True, stop_before_pixels=True)
        names = [str(secrets.get(key, "")) for key in ("PatientName", "PatientID", "AccessionNumber")]
        xray = read_xray(path, fields=GEOMETRY)
        text = " ".join((*xray.provenance, *xray.warnings))
        for name in names:
            assert len(name) < 4 or name not in text
