"""The polyrigid projectors against a float64 oracle, and what must hold for every warp."""

import numpy as np
import pytest
import torch
from polyrigid_cases import make_case, oracle, oracle_jacobian, relative_l2

from PolyPoseLib.baselines.published import projector as projector_module
from PolyPoseLib.baselines.published.projector import Sampling
from PolyPoseLib.baselines.published.projector_torch import TorchPolyrigidProjector
from PolyPoseLib.baselines.published.projectors import polyrigid_projector
from PolyPoseLib.geometry import se3
from PolyPoseLib.geometry.camera import look_at
from PolyPoseLib.geometry.rigid import about
from PolyPoseLib.rendering.numba_backend import NumbaBackend
from PolyPoseLib.rendering.rigid import Body, project_body
from PolyPoseLib.rendering.torch_backend import TorchBackend
from PolyPoseLib.warp.polyrigid import PolyrigidWarp, RotationFalloff

STEP = 4.0
FIELDS = [(frame, form) for frame in ("fixed", "moving") for form in ("mass", "epsilon", "rigid")]
BACKENDS = {"numba": NumbaBackend, "torch": TorchBackend}


@pytest.fixture(params=BACKENDS)
def backend(request):
    if request.param == "numba":
        pytest.importorskip("numba")
    return BACKENDS[request.param]()


def projector(case, backend, **options):
    return polyrigid_projector(case.volume, case.warp, case.camera, Sampling(STEP, **options), backend)


def numba_projector(case, **options):
    pytest.importorskip("numba")
    from PolyPoseLib.baselines.published.projector_numba import NumbaPolyrigidProjector

    return NumbaPolyrigidProjector(case.volume, case.warp, case.camera, Sampling(STEP, **options))


@pytest.mark.parametrize(("frame", "form"), FIELDS)
def test_image_and_jacobian_agree_with_float64_autograd(backend, frame, form):
    case = make_case(FIELDS.index((frame, form)), frame, form, pixels=(7, 6))
    image, jacobian = projector(case, backend).image_and_jacobian(case.logs)
    assert relative_l2(image, oracle(case, STEP).numpy()) < 1e-5
    expected = oracle_jacobian(case, STEP)
    assert jacobian.shape == (3, 6, 7, 6)
    for found, wanted in zip(jacobian, expected, strict=True):
        assert relative_l2(found, wanted) < 1e-4


@pytest.mark.parametrize("frame", ["fixed", "moving"])
def test_large_rotations_keep_their_digits(backend, frame):
    case = make_case(3, frame)
    turned = np.zeros((3, 6))
    turned[1, :3] = np.radians(170) * np.array([0.6, 0.0, 0.8])
    turned[2, :3] = np.radians(100) * np.array([0.0, 1.0, 0.0])
    turned[:, 3:] = np.random.default_rng(0).normal(0, 5, (3, 3))
    image = projector(case, backend).image(turned)
    assert relative_l2(image, oracle(case, STEP, turned).numpy()) < 2e-5


def test_at_rest_it_is_the_plain_projection(backend):
    for seed in range(3):
        case = make_case(seed, form="rigid")
        image = projector(case, backend).image(np.zeros((3, 6)))
        body = Body(case.volume.voxels, case.volume.affine, case.warp.center.numpy())
        window = project_body(body, case.camera, np.eye(4), STEP, backend)
        row0, row1, column0, column1 = window.window
        assert relative_l2(image[row0:row1, column0:column1], window.image) < 1e-5


@pytest.mark.parametrize(("frame", "form"), [("fixed", "mass"), ("moving", "rigid")])
def test_bones_that_move_as_one_move_everything_rigidly(backend, frame, form):
    case = make_case(5, frame, form)
    one = np.tile(np.array([0.1, -0.2, 0.15, 4.0, -3.0, 2.0]), (3, 1))
    image = projector(case, backend, margin_mm=60).image(one)
    centre = case.warp.center.numpy()
    pose = about(se3.exp(torch.as_tensor(one[0])).numpy(), centre)
    part = project_body(
        Body(case.volume.voxels, case.volume.affine, centre), case.camera, pose, STEP, backend
    )
    row0, row1, column0, column1 = part.window
    expected = np.zeros_like(image)
    expected[row0:row1, column0:column1] = part.image
    assert relative_l2(image, expected) < 1e-4


def test_samples_beyond_the_distance_maps(backend):
    for frame in ("fixed", "moving"):
        case = make_case(6, frame)
        image = projector(case, backend, margin_mm=90).image(case.logs)
        assert relative_l2(image, oracle(case, STEP, margin_mm=90).numpy()) < 1e-5


@pytest.mark.parametrize("frame", ["fixed", "moving"])
def test_gradient_of_a_scored_image(backend, frame, monkeypatch):
    case = make_case(7, frame, pixels=(8, 8))
    weight = np.random.default_rng(0).normal(size=(8, 8))

    def score(image):
        return float((weight * image.astype(float) ** 2).sum()), 2 * weight * image

    def found():
        return projector(case, backend).scored(case.logs, score)

    logs = torch.as_tensor(case.logs).requires_grad_()
    value = (torch.as_tensor(weight) * oracle(case, STEP, logs) ** 2).sum()
    (expected,) = torch.autograd.grad(value, logs)
    at_once = found()
    assert at_once.value == pytest.approx(float(value.detach()), rel=1e-4)
    assert relative_l2(at_once.gradient, expected.numpy()) < 1e-4
    monkeypatch.setattr(projector_module, "JACOBIAN_BYTES", 0)
    np.testing.assert_array_equal(found().gradient, at_once.gradient)


def test_chunks_and_kept_weights_change_no_bit():
    for frame in ("fixed", "moving"):
        case = make_case(8, frame)
        whole = numba_projector(case)
        image, jacobian = whole.image_and_jacobian(case.logs)
        for options in ({"samples_per_chunk": 100}, {"weights_bytes": 0}, {"weights_bytes": 60_000}):
            part = numba_projector(case, **({"samples_per_chunk": 400} | options))
            assert len(part.chunks) > 1
            for _ in range(2):
                again, derivative = part.image_and_jacobian(case.logs)
                np.testing.assert_array_equal(again, image)
                np.testing.assert_array_equal(derivative, jacobian)


def test_chunks_of_the_torch_path_agree():
    case = make_case(9)
    whole = TorchPolyrigidProjector(case.volume, case.warp, case.camera, Sampling(STEP))
    expected = whole.image_and_jacobian(case.logs)
    for weights_bytes in (0, 1 << 20):
        sampling = Sampling(STEP, weights_bytes=weights_bytes, samples_per_chunk=150)
        parts = TorchPolyrigidProjector(case.volume, case.warp, case.camera, sampling)
        for _ in range(2):
            image, jacobian = parts.image_and_jacobian(case.logs)
            assert relative_l2(image, expected[0]) < 1e-6
            assert relative_l2(jacobian, expected[1]) < 1e-5


def test_weights_of_the_blocks_are_those_of_the_warp():
    pytest.importorskip("numba")
    from PolyPoseLib.baselines.published.kernel_stages import LANES

    for form in ("mass", "epsilon", "rigid"):
        case = make_case(10, form=form)
        found = numba_projector(case)
        (rays,) = found.chunks
        blocks = found._rays[0].blocks
        weights = found.weights_of(0)
        for ray in range(0, rays.rays, 7):
            own = weights[blocks[ray] : blocks[ray + 1]].transpose(1, 0, 2).reshape(3, -1)
            number = np.arange(rays.count[ray])
            points = rays.first[ray] + number[:, None] * rays.step[ray] + rays.centre
            expected = case.warp.weights(torch.as_tensor(points)).numpy()
            assert own.shape[1] % LANES == 0
            np.testing.assert_allclose(own[:, : len(number)], expected, rtol=2e-3, atol=2e-4)
            np.testing.assert_allclose(own.sum(0), 1, atol=1e-6)


def test_a_camera_that_looks_away_sees_nothing(backend):
    case = make_case(0)
    source = case.camera.source
    away = case.camera.with_extrinsic(look_at(source, 2 * source - case.warp.center.numpy()))
    found = polyrigid_projector(case.volume, case.warp, away, Sampling(STEP), backend)
    image, jacobian = found.image_and_jacobian(case.logs)
    assert not image.any() and not jacobian.any()
    scored = found.scored(case.logs, lambda image: (1.0, np.ones(image.shape)))
    assert scored.value == 1 and not scored.gradient.any()


def test_a_warp_with_a_rotation_falloff_is_refused(backend):
    case = make_case()
    old = case.warp
    rotation_falloff = RotationFalloff(40.0, np.zeros((old.distances.count, 3)))
    warp = PolyrigidWarp(old.distances, old.share, old.poses, rotation_falloff=rotation_falloff)
    with pytest.raises(ValueError, match="without rotation falloff"):
        polyrigid_projector(case.volume, warp, case.camera, Sampling(STEP), backend)
