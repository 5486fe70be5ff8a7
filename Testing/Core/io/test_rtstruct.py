"""RT structure sets as segmentations: contours filled on the CT's grid, in any direction; hostile files refused."""

import json

import numpy as np
import pytest
from dicom_stack import write_stack
from segment_files import random_affine, saved, structure_set
from small_study import write_small_study

from PolyPoseLib.data.study import Study
from PolyPoseLib.data.volume import Volume
from PolyPoseLib.errors import InputError
from PolyPoseLib.io import contour_volume, rtstruct
from PolyPoseLib.io.segmentations import read_segmentation
from PolyPoseLib.io.volumes import read_volume

SHAPE = (12, 14, 16)
CENTRE = np.array([7.3, 6.6, 5.4])
SQUARE = np.array([[2.2, 2.2], [9.7, 2.2], [9.7, 8.4], [2.2, 8.4]])


def read(folder, rois, reference=None, **how):
    return read_segmentation(saved(structure_set(rois, **how), folder / "rs.dcm"), reference)


def mask_of(found, name, grid):
    layer, label = found.find(name, "bone")
    return found.on_grid(layer, grid).voxels == label


def grid_of(affine=None):
    return Volume(np.zeros(SHAPE, np.int16), np.eye(4) if affine is None else affine)


def squares(grid, depths, axis=2, outline=SQUARE):
    """One contour a depth (index along an axis of the grid) in LPS mm."""
    found = []
    for depth in depths:
        points = np.insert(outline, axis, depth, axis=1)
        found.append(grid.to_world(points))
    return found


def box(axis, slices):
    """The voxels of SQUARE in these slices along an axis of (i, j, k)."""
    low, high = np.zeros(3), np.zeros(3)
    others = [each for each in range(3) if each != axis]
    low[others], high[others] = SQUARE.min(axis=0), SQUARE.max(axis=0)
    low[axis], high[axis] = min(slices) - 0.5, max(slices) + 0.5
    index = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1)[..., ::-1]
    return ((index > low) & (index < high)).all(axis=-1)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("seed", range(4))
def test_contours_in_the_planes_of_any_ct_fill_exactly_its_voxels(tmp_path, axis, seed):
    grid = grid_of(random_affine(np.random.default_rng(seed), oblique=seed < 3))
    found = read(tmp_path, {"femur left": squares(grid, range(3, 9), axis)}, grid)
    assert found.layers[0].same_grid(grid)
    assert np.array_equal(mask_of(found, "femur left", grid), box(axis, range(3, 9)))
    assert not found.warnings


@pytest.mark.parametrize("through_ct", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_oblique_contours_are_right_to_half_a_voxel(tmp_path, seed, through_ct):
    rng = np.random.default_rng(seed)
    grid = grid_of(random_affine(rng, (1.0, 1.1, 1.2)))
    centre, axes = grid.to_world(CENTRE), np.linalg.qr(rng.normal(size=(3, 3)))[0]
    angles, contours = np.linspace(0, 2 * np.pi, 60)[:-1], []
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for height in np.arange(-4.9, 5, 0.5):
        ring = np.sqrt(25 - height**2) * circle
        contours.append(centre + ring @ axes[:2] + height * axes[2])
    found = read(tmp_path, {"ball": contours}, grid if through_ct else None)
    mask = mask_of(found, "ball", grid)
    index = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1)[..., ::-1]
    radius = np.linalg.norm(grid.to_world(index) - centre, axis=-1)
    # Half a voxel of the ball's own grid, 1 x 1 x 0.5 mm, along its diagonal.
    assert mask[radius < 5 - 0.75].all()
    assert not mask[radius > 5 + 0.75].any()


@pytest.mark.parametrize("step", [2, 3])
def test_contours_of_every_second_slice_stand_for_those_between(tmp_path, step):
    grid = grid_of()
    found = read(tmp_path, {"bone": squares(grid, range(2, 11, step))}, grid)
    filled = np.flatnonzero(mask_of(found, "bone", grid).any(axis=(1, 2)))
    assert np.array_equal(filled, np.arange(filled[0], filled[-1] + 1))
    assert len(filled) == pytest.approx(step * len(range(2, 11, step)), abs=1)


def test_pieces_of_one_slice_fill_nothing_between_them(tmp_path):
    grid = grid_of()
    rois = {"pieces": squares(grid, (2, 9)), "bone": squares(grid, range(3, 8), outline=SQUARE[[0, 1, 2]])}
    filled = mask_of(read(tmp_path, rois, grid), "pieces", grid).any(axis=(1, 2))
    assert np.flatnonzero(filled).tolist() == [2, 9]


def test_thin_contours_between_thick_slices_fill_each_slice_once(tmp_path):
    grid = grid_of(np.diag([1, 1, 5, 1.0]))
    found = read(tmp_path, {"bone": squares(grid, np.arange(3, 7.01, 0.2))}, grid)
    assert np.array_equal(mask_of(found, "bone", grid), box(2, range(3, 8)))


@pytest.mark.parametrize("kind", ["CLOSED_PLANAR", "CLOSEDPLANAR_XOR"])
def test_a_contour_in_another_is_a_hole_and_the_same_twice_is_none(tmp_path, kind):
    grid = grid_of()
    hole = np.array([[4.4, 4.4], [6.6, 4.4], [6.6, 6.6], [4.4, 6.6]])
    outer = squares(grid, [5])
    found = read(tmp_path, {"bone": outer + squares(grid, [5], outline=hole) + outer}, grid, kind=kind)
    expected = box(2, [5])
    expected[5, 5:7, 5:7] = False
    assert np.array_equal(mask_of(found, "bone", grid), expected)


def test_overlaps_go_to_the_smaller_structure_and_the_body_is_no_overlap(tmp_path):
    grid = grid_of()
    small = squares(grid, range(4, 6))
    rois = {"Body": squares(grid, range(1, 11)), "sacrum": small, "hip_left": squares(grid, range(3, 8))}
    found = read(tmp_path, rois, grid)
    assert np.array_equal(mask_of(found, "sacrum", grid), box(2, range(4, 6)))
    assert len(found.warnings) == 1
    assert "Body" not in found.warnings[0]
    assert "sacrum" in found.warnings[0]


def test_studies_name_the_structures(tmp_path):
    path = write_small_study(tmp_path / "s")
    folder, labels = tmp_path / "s", read_volume(tmp_path / "s" / "labels.nii.gz")
    outline = np.array([[-0.4, -0.4], [11.4, -0.4], [11.4, 10.4], [-0.4, 10.4]])
    rois = {
        "hip_left": squares(labels, range(5), outline=outline),
        "femur_left": squares(labels, range(6, 10), outline=outline),
    }
    rois["isocentre"] = []
    (folder / "dicom").mkdir()
    write_stack(folder / "dicom", read_volume(folder / "ct.nii.gz").voxels, step=1.0,
                positions=[(0, 0, k) for k in range(10)], FrameOfReferenceUID="1.2.3", PixelSpacing=[1, 1])  # fmt: skip
    saved(structure_set(rois), folder / "dicom" / "rs.dcm")
    structures = {"pelvis": ["hip_left"], "femur": ["femur_left"]}
    fields = {
        **json.loads(path.read_text()),
        "ct": "dicom",
        "segmentation": "dicom",
        "structures": structures,
    }
    path.write_text(json.dumps(fields))
    study = Study.load(path)
    assert np.array_equal(study.structures.mask("pelvis"), labels.voxels == 25)
    assert np.array_equal(study.structures.mask("femur"), labels.voxels == 75)
    assert not any("another scan" in each for each in study.warnings)


def test_folders_of_two_structure_sets_are_refused(tmp_path):
    grid = grid_of()
    for name in ("a.dcm", "b"):
        saved(structure_set({"bone": squares(grid, [3])}), tmp_path / name)
    with pytest.raises(InputError, match="2 segmentations"):
        read_segmentation(tmp_path)


def bent(grid):
    contour = squares(grid, [5])[0]
    contour[0, 2] += 5
    return [contour]


@pytest.mark.parametrize(
    ("rois", "kind", "words"),
    [
        (lambda g: {"bone": []}, "CLOSED_PLANAR", "no closed contour"),
        (lambda g: {"bone": squares(g, [3])}, "OPEN_PLANAR", "no closed contour"),
        (lambda g: {"bone": [np.full((4, 3), np.nan)]}, "CLOSED_PLANAR", "no places"),
        (lambda g: {"bone": [np.full((4, 3), 1e12)]}, "CLOSED_PLANAR", "no places"),
        (lambda g: {"bone": [each + 900 for each in squares(g, [3])]}, "CLOSED_PLANAR", "drawn on this CT"),
        (lambda g: {"bone": bent(g)}, "CLOSED_PLANAR", "parallel planes"),
        (lambda g: {"bone": squares(g, [3], 0) + squares(g, [3], 1)}, "CLOSED_PLANAR", "parallel planes"),
        (lambda g: {}, "CLOSED_PLANAR", "lists 0 structures"),
    ],
)
def test_structure_sets_without_a_sense_are_refused(tmp_path, rois, kind, words):
    grid = grid_of()
    with pytest.raises(InputError, match=words):
        read(tmp_path, rois(grid), grid, kind=kind)


def test_what_is_too_large_is_refused(tmp_path, monkeypatch):
    grid = grid_of()
    rois = {"bone": squares(grid, range(3, 9)), "other": squares(grid, range(3, 9))}
    for module, name, least in (
        (rtstruct, "MAX_BYTES", 100),
        (rtstruct, "MAX_CONTOURS", 11),
        (rtstruct, "MAX_POINTS", 47),
        (rtstruct, "MAX_SEGMENTS", 1),
        (contour_volume, "MAX_CROSSINGS", 5),
        (contour_volume, "MAX_WORK", 500),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, least)
            with pytest.raises(InputError):
                read(tmp_path, rois, grid)
    assert read(tmp_path, rois, grid).segments
    far = {"bone": [*squares(grid, [3, 4]), *(each + 9e4 for each in squares(grid, [3]))]}
    with pytest.raises(InputError, match="too much"):
        read(tmp_path, far)


def test_files_cut_or_changed_anywhere_end_in_one_sentence_or_labels(tmp_path):
    grid, rng = grid_of(), np.random.default_rng(0)
    content = saved(structure_set({"bone": squares(grid, range(3, 6))}), tmp_path / "rs.dcm").read_bytes()
    for number in range(60):
        at = int(rng.integers(140, len(content)))
        changed = content[:at] + (b"" if number % 2 else bytes([rng.integers(256)]) + content[at + 1 :])
        (tmp_path / "changed.dcm").write_bytes(changed)
        try:
            read_segmentation(tmp_path / "changed.dcm", grid)
        except InputError as error:
            assert "\n" not in str(error)


def test_contours_of_an_independent_writer_hold_its_voxels(tmp_path):
    rt_utils = pytest.importorskip("rt_utils")
    pytest.importorskip("cv2")
    from pydicom import dcmread

    # Square pixels: rt-utils exchanges the two spacings.
    write_stack(tmp_path / "ct", np.zeros(SHAPE, int), axes=(1, 0, 0, 0, 1, 0), PixelSpacing=[0.8, 0.8])
    for file in (tmp_path / "ct").iterdir():
        each = dcmread(file)
        each.FrameOfReferenceUID, each.StudyInstanceUID, each.SliceThickness = "1.2.3", "1.2.4", 2.5
        each.PatientBirthDate = each.PatientSex = each.PatientAge = each.PatientSize = each.PatientWeight = ""
        each.StudyDate = each.StudyTime = each.ReferringPhysicianName = each.StudyID = (
            each.AccessionNumber
        ) = ""
        each.StudyDescription = each.SeriesDate = each.SeriesTime = ""
        each.save_as(file)
    mask = box(2, range(3, 9)) | box(0, [11, 12])
    mask[3:8, 4:7, 5:8] = False
    made = rt_utils.RTStructBuilder.create_new(dicom_series_path=str(tmp_path / "ct"))
    made.add_roi(mask=np.moveaxis(mask, 0, -1), name="bone")
    made.save(str(tmp_path / "rs.dcm"))
    ct = read_volume(tmp_path / "ct")
    found = read_segmentation(tmp_path / "rs.dcm", ct)
    assert np.array_equal(mask_of(found, "bone", ct), mask)
