"""Breathing in: ribs turn rigidly about their joints, lungs grow and keep their mass, nothing folds."""

import numpy as np
import pytest
from chest_phantom import LABELS, LUNG_AXES, NAMES, RIBS, chest
from scipy.spatial import KDTree

from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.data.structures import Structures, structures_from_labels
from PolyPoseLib.errors import InputError
from PolyPoseLib.io.samples import CT_FILE, LABELS_FILE, cached_sample, sample_named
from PolyPoseLib.io.volumes import read_ct, read_volume
from PolyPoseLib.simulation.breathing import numbered_ribs, separate_ribs
from PolyPoseLib.simulation.motion import apply
from PolyPoseLib.simulation.named_motions import Anatomy, named_posture
from PolyPoseLib.simulation.posed_ct import pose_ct

LUNGS = (11, 14)
AMPLITUDE = 20.0


def anatomy_of(handedness=1):
    ct, structures, source = chest(handedness=handedness)
    return ct, source, Anatomy(structures, ct.affine, NAMES[0], source.voxels, LABELS)


def posed(ct, source, anatomy, posture, **options):
    poses = {name: np.linalg.inv(joint.moving_to_fixed) for name, joint in posture.joints.items()}
    return pose_ct(ct, anatomy.structures, poses, source.voxels, 4.0, 8.0, soft=posture.soft, **options)


@pytest.fixture(scope="module", params=[1, -1])
def breath(request):
    ct, source, anatomy = anatomy_of(request.param)
    posture = named_posture("breathing", AMPLITUDE, anatomy, np.random.default_rng(3))
    return ct, source, anatomy, posture, posed(ct, source, anatomy, posture)


def test_ribs_are_rigid_and_turn_about_their_heads(breath):
    _, _, anatomy, posture, _ = breath
    for name in RIBS:
        motion = posture.joints[name].moving_to_fixed
        assert np.allclose(motion[:3, :3] @ motion[:3, :3].T, np.eye(3), atol=1e-12)
        points = anatomy.points[name]
        head = points[points[:, 1] > points[:, 1].max() - 8]
        assert np.linalg.norm(apply(motion, head) - head, axis=1).max() < 2.0
        front = points[points[:, 1] < points[:, 1].min() + 8]
        shift = (apply(motion, front) - front).mean(0)
        assert shift[2] > 2 and shift[1] < 0


def test_upper_ribs_are_pump_handles_and_lower_ones_bucket_handles(breath):
    _, _, anatomy, posture, _ = breath
    shares = []
    for name in RIBS[:4]:
        axis = np.abs(posture.joints[name].axis)
        shares.append(axis[1] / axis[0])
    assert shares == sorted(shares)
    for name in RIBS:
        points = anatomy.points[name]
        side = np.argmax(np.abs(points[:, 0]))
        outwards = apply(posture.joints[name].moving_to_fixed, points[side]) - points[side]
        assert outwards[0] * points[side, 0] > 0


def test_the_sternum_follows_the_ribs(breath):
    _, _, anatomy, posture, _ = breath
    motion = posture.joints["sternum"].moving_to_fixed
    points = anatomy.points["sternum"]
    shift = (apply(motion, points) - points).mean(0)
    assert 2 < shift[2] < 15 and shift[1] < 0 and abs(shift[0]) < 1


def test_the_dome_descends_by_the_amplitude_and_organs_go_along(breath):
    ct, source, _, posture, made = breath
    assert posture.soft.displacements[:, 2].min() == pytest.approx(-AMPLITUDE, rel=0.15)
    assert not posture.soft.displacements[:, :2].any()
    core = made.grid.core(made.source_labels)
    for label, low, high in ((5, 6.0, 20.0), (51, 6.0, 16.0)):
        before, after = (
            ct.to_world(np.argwhere(voxels == label)[:, ::-1])[:, 2].mean()
            for voxels in (source.voxels, core)
        )
        assert low < before - after < high


def test_lungs_grow_by_what_the_diaphragm_and_the_ribs_make_room_for(breath):
    ct, source, _, _, made = breath
    before, after = (np.isin(v, LUNGS).sum() for v in (source.voxels, made.source_labels))
    swept = 2 * np.pi * LUNG_AXES.prod() * AMPLITUDE / np.prod(ct.spacing)
    assert 0.3 * swept < after - before < 1.5 * swept


def test_lungs_keep_their_mass_and_become_less_dense(breath):
    """Where all the body has one density, so that voxels at the border are not partly something else."""
    ct, source, anatomy, posture, _ = breath
    even = ct.with_voxels(np.full_like(ct.voxels, -800.0))
    made = posed(even, source, anatomy, posture)
    inside = made.hu[np.isin(made.source_labels, LUNGS)].astype(float) + 1000
    assert inside.sum() == pytest.approx(200.0 * np.isin(source.voxels, LUNGS).sum(), rel=0.03)
    assert np.median(inside) < 0.97 * 200.0


def test_nothing_folds_and_the_spine_stays(breath):
    ct, _, anatomy, posture, made = breath
    assert made.folds_percent < 0.1
    assert NAMES[0] not in posture.joints
    spine = anatomy.structures.labels == 1
    assert np.allclose(made.grid.core(made.hu)[spine], ct.voxels[spine], atol=1e-2)


def test_no_breath_is_rest():
    ct, source, anatomy = anatomy_of()
    posture = named_posture("breathing", 0.0, anatomy, np.random.default_rng(0))
    made = posed(ct, source, anatomy, posture)
    assert all(np.allclose(j.moving_to_fixed, np.eye(4), atol=1e-12) for j in posture.joints.values())
    assert np.abs(made.nodes).max() < 1e-5
    assert np.allclose(made.grid.core(made.hu), ct.voxels, atol=1e-2)
    assert np.array_equal(made.grid.core(made.source_labels), source.voxels)


def test_elastic_tissue_breathes_as_well():
    ct, source, anatomy = anatomy_of()
    posture = named_posture("breathing", 10.0, anatomy, np.random.default_rng(0))
    poses = {name: np.linalg.inv(joint.moving_to_fixed) for name, joint in posture.joints.items()}
    made = pose_ct(
        ct, anatomy.structures, poses, source.voxels, 8.0, 8.0, tissue="elastic", soft=posture.soft
    )
    grown = np.isin(made.source_labels, LUNGS).sum() / np.isin(source.voxels, LUNGS).sum()
    assert 1.02 < grown < 1.5


def test_the_generator_decides():
    _, _, anatomy = anatomy_of()
    first, again, other = (
        named_posture("breathing", None, anatomy, np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    for name in RIBS:
        assert np.array_equal(first.joints[name].moving_to_fixed, again.joints[name].moving_to_fixed)
        assert not np.allclose(first.joints[name].moving_to_fixed, other.joints[name].moving_to_fixed)
    assert np.array_equal(first.soft.displacements, again.soft.displacements)


def test_what_breathing_needs_is_named():
    _, source, anatomy = anatomy_of()
    structures = anatomy.structures
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="needs lungs among the labels"):
        named_posture("breathing", None, Anatomy(structures, anatomy.affine, NAMES[0]), rng)
    with pytest.raises(InputError, match="needs every rib as a structure of its own"):
        named_posture(
            "breathing", None, Anatomy(structures, anatomy.affine, RIBS[0], source.voxels, LABELS), rng
        )
    fused = Structures(("spine", "ribs_left"), np.minimum(structures.labels, 2))
    with pytest.raises(InputError, match="the structures are spine, ribs_left"):
        named_posture("breathing", None, Anatomy(fused, anatomy.affine, "spine", source.voxels, LABELS), rng)


@pytest.mark.parametrize("anchor", ["sternum", "clavicle_left", "pelvis"])
def test_the_anchor_of_breathing_is_the_spine(anchor):
    _, source, anatomy = anatomy_of()
    names = tuple(anchor if name == "sternum" else name for name in NAMES)
    other = Anatomy(
        Structures(names, anatomy.structures.labels), anatomy.affine, anchor, source.voxels, LABELS
    )
    with pytest.raises(InputError, match="and the spine as the anchor"):
        named_posture("breathing", None, other, np.random.default_rng(0))


@pytest.mark.parametrize("fused", ["ribs_left", "side"])
def test_ribs_that_would_stay_still_are_refused(fused):
    """Those of one side are one structure, found by its name or by its labels."""
    _, source, anatomy = anatomy_of()
    before = anatomy.structures.labels
    names = (NAMES[0], fused, *RIBS[4:], "sternum")
    number_of = np.array([0, 1, 2, 2, 2, 2, *range(3, 8)], np.int16)
    labels = np.where(before > 0, before + 100, source.voxels)
    all_names = LABELS | {number + 101: name for number, name in enumerate(NAMES)}
    left = Anatomy(Structures(names, number_of[before]), anatomy.affine, NAMES[0], labels, all_names)
    with pytest.raises(InputError, match=f'every rib .*but "{fused}" holds ribs'):
        named_posture("breathing", None, left, np.random.default_rng(0))
    known = Anatomy(anatomy.structures, anatomy.affine, NAMES[0], labels, all_names)
    assert set(RIBS) <= set(named_posture("breathing", None, known, np.random.default_rng(0)).joints)


@pytest.mark.parametrize("name", ["lung_left", "left lung", "Left-Lung"])
def test_organs_are_found_however_their_words_are_joined(name):
    labels = np.array([[[0, 1, 2]]])
    structures = Structures(("spine", "skull"), labels)
    anatomy = Anatomy(structures, np.eye(4), "spine", labels, {1: name, 2: "lungfish left"})
    assert anatomy.organ("lung", "left").tolist() == [[[False, True, False]]]


def test_a_speck_of_lung_moves_no_diaphragm():
    _, source, anatomy = anatomy_of()
    labels = np.where(np.isin(source.voxels, LUNGS), 0, source.voxels)
    labels[30, 20, 21] = LUNGS[0]
    speck = Anatomy(anatomy.structures, anatomy.affine, NAMES[0], labels, LABELS)
    posture = named_posture("breathing", None, speck, np.random.default_rng(0))
    assert np.isfinite(posture.soft.displacements).all()


def test_ribs_are_found_by_their_names():
    labels = np.arange(1, 5, dtype=np.int16).reshape(1, 1, 4)
    names = ("left rib 4", "rib_right_11", "ribs_left", "Fourth rib")
    anatomy = Anatomy(Structures(names, labels), np.eye(4), "ribs_left")
    assert numbered_ribs(anatomy) == {"left rib 4": ("left", 4), "rib_right_11": ("right", 11)}


def test_ribs_are_taken_out_of_what_holds_them():
    names = {
        1: "vertebrae_T4",
        2: "vertebrae_T5",
        3: "rib_left_4",
        4: "rib_right_4",
        5: "sternum",
        6: "femur_left",
    }
    groups, anchor = separate_ribs({"thorax": [1, 2, 3, 4, 5], "femur_left": [6]}, "thorax", names)
    assert anchor == "thoracic_spine"
    assert groups == {
        "thoracic_spine": [1, 2],
        "rib_left_4": [3],
        "rib_right_4": [4],
        "sternum": [5],
        "femur_left": [6],
    }
    assert separate_ribs({"femur_left": [6]}, "femur_left", names) == ({"femur_left": [6]}, "femur_left")


def test_what_is_left_of_two_structures_stays_two():
    names = {1: "vertebrae_T1", 2: "rib_left_1", 3: "vertebrae_T10", 4: "rib_left_10"}
    groups, anchor = separate_ribs({"upper": [1, 2], "lower": [3, 4]}, "lower", names)
    assert groups == {"thoracic_spine": [1], "rib_left_1": [2], "lower": [3], "rib_left_10": [4]}
    assert anchor == "lower"


def test_an_anchor_of_ribs_is_named_as_its_bone_or_refused():
    names = {1: "sternum", 2: "vertebrae_T4", 3: "rib_left_4", 4: "rib_left_5"}
    groups, anchor = separate_ribs({"breastbone": [1], "spine": [2]}, "breastbone", names)
    assert anchor == "sternum" and groups == {"sternum": [1], "spine": [2]}
    with pytest.raises(InputError, match=r'anchor "cage" holds nothing but ribs .*: choose the spine'):
        separate_ribs({"cage": [3, 4], "spine": [2]}, "cage", names)


@pytest.mark.long
def test_a_real_chest_breathes_plausibly():
    """Of 3.7 litres, 20 mm add half a litre: 60 % of it by the diaphragm's 0.03 square metres."""
    folder = cached_sample("chest")
    if folder is None:
        pytest.skip("the chest sample is not in the cache (python -m PolyPoseLib sample chest --output DIR)")
    ct, labels = read_ct(folder / CT_FILE), read_volume(folder / LABELS_FILE)
    sample, names = sample_named("chest"), label_table(sample_named("chest").label_table)
    groups, anchor = separate_ribs({n: list(v) for n, v in sample.structures.items()}, sample.anchor, names)
    structures = structures_from_labels(labels, groups, ct)
    anatomy = Anatomy(structures, ct.affine, anchor, labels.voxels, names)
    posture = named_posture("breathing", AMPLITUDE, anatomy, np.random.default_rng(0))
    made = posed(ct, labels, anatomy, posture)
    lungs = [number for number, name in names.items() if name.startswith("lung_")]
    before, after = np.isin(labels.voxels, lungs), np.isin(made.source_labels, lungs)
    litres = np.prod(ct.spacing) / 1e6
    assert 0.3 < (after.sum() - before.sum()) * litres < 0.8
    mass = (made.hu[after].astype(float) + 1000).sum() / (ct.voxels[before].astype(float) + 1000).sum()
    assert mass == pytest.approx(1, abs=0.04)
    assert made.folds_percent < 0.05 and max(made.overlap.values()) < 0.03
    for name in numbered_ribs(anatomy):
        motion, points = posture.joints[name].moving_to_fixed, anatomy.points[name]
        distance, _ = KDTree(anatomy.points[anchor]).query(points)
        head = points[distance < distance.min() + 3]
        assert np.linalg.norm(apply(motion, head) - head, axis=1).max() < 3
