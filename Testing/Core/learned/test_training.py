"""A few seconds of training help; an interrupted training that is resumed ends where an uninterrupted one does."""

from dataclasses import replace

import learned_phantom
import numpy as np
import pytest
import torch

from PolyPoseLib.data.progress import Monitor
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.io.camera_models import read_tensors, write_tensors
from PolyPoseLib.learned.detector import VirtualDetector
from PolyPoseLib.learned.samples import TRAINING, VALIDATION
from PolyPoseLib.learned.training import Trainer, TrainingPlan, train
from PolyPoseLib.learned.view_range import ViewRange
from PolyPoseLib.rendering.select import select_backend

pytest.importorskip("monai", reason="learned cameras need MONAI")

VIEWS = ViewRange(("AP",), 735.0)
TINY = TrainingPlan(
    minutes=None,
    steps=12,
    side=32,
    channels=(4, 8, 8, 16),
    size_mm=12.0,
    renderings=4,
    copies=2,
    validate_every=4,
    validation_batches=2,
)


@pytest.fixture(scope="module")
def scene():
    return learned_phantom.scene()


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def trained(scene, plan, views=VIEWS, monitor=None, checkpoint=None, resume=False):
    """As the subcommand train does it: checkpoints go to a file, and come from there."""
    keep = None if checkpoint is None else lambda fields: write_tensors(fields, checkpoint)
    earlier = read_tensors(checkpoint, "checkpoint") if resume else None
    monitor = monitor or Monitor(None, None)
    detector = VirtualDetector(plan.side, 0.15)
    return train(scene, "of the phantom", views, detector, plan, monitor, keep, earlier)


def test_training_lowers_the_validation_error(scene):
    plan = replace(
        TINY, steps=70, channels=(8, 16, 16, 16), renderings=8, learning_rate=3e-3, validate_every=35
    )
    untrained = Trainer(scene, VIEWS, VirtualDetector(32, 0.15), plan).validation_mm()
    model = trained(scene, plan)
    assert model.validation_mm < 0.75 * untrained


def test_resumed_is_uninterrupted(scene, tmp_path, monkeypatch):
    monkeypatch.setattr(Trainer, "_bfloat16_pays", lambda *_: False)  # it measures time
    path = tmp_path / "checkpoint"
    whole = trained(scene, TINY)

    class Interruption:
        seen = 0

        def __call__(self):
            self.seen += 1
            return self.seen > 6

    with pytest.raises(CancelledError):
        trained(scene, TINY, monitor=Monitor(None, Interruption()), checkpoint=path)
    assert path.is_file()
    resumed = trained(scene, TINY, checkpoint=path, resume=True)
    assert resumed.validation_mm == pytest.approx(whole.validation_mm, rel=1e-3)
    for name, value in whole.state.items():
        torch.testing.assert_close(resumed.state[name], value, rtol=1e-3, atol=1e-4)


def test_a_checkpoint_of_another_training_is_refused(scene, tmp_path):
    path = tmp_path / "checkpoint"
    trained(scene, replace(TINY, steps=4), checkpoint=path)
    for plan, views in ((replace(TINY, seed=1), VIEWS), (TINY, ViewRange(("PA",), 735.0))):
        with pytest.raises(InputError, match="another CT, range of views or plan"):
            trained(scene, plan, views, checkpoint=path, resume=True)
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(InputError, match="checkpoint"):
        trained(scene, TINY, checkpoint=path, resume=True)


def test_time_and_patience_end_a_training(scene):
    steps = []
    trained(scene, replace(TINY, minutes=0.03, steps=10_000), monitor=Monitor(steps.append, None))
    assert len(steps) < 5_000
    steps.clear()
    frozen = replace(TINY, steps=10_000, learning_rate=1e-30, validate_every=1, patience=3)
    trained(scene, frozen, monitor=Monitor(steps.append, None))
    assert len(steps) < 100


def test_several_views_and_images_in_the_loss(scene):
    views = ViewRange(("AP", "LL"), 735.0)
    plan = replace(TINY, steps=3, image_weight=0.5, image_from=0.0, image_views=4)
    trainer = Trainer(scene, views, VirtualDetector(32, 0.15), plan)
    batch = trainer.sampler.draw(TRAINING, 0, select_backend(threads=1))
    assert set(batch.views.tolist()) == {0, 1}
    loss = trainer.loss(batch)
    loss.backward()
    assert torch.isfinite(loss)
    gradients = [each.grad for each in trainer.state.network.parameters()]
    assert all(each is not None and torch.isfinite(each).all() for each in gradients)
    plain = Trainer(scene, views, VirtualDetector(32, 0.15), replace(plan, image_weight=0.0)).loss(batch)
    assert float(loss.detach()) > float(plain.detach())


def test_batches_follow_from_seed_and_number(scene):
    sampler = Trainer(scene, VIEWS, VirtualDetector(32, 0.15), TINY).sampler
    backend = select_backend(threads=1)
    first, again = (sampler.draw(TRAINING, 3, backend) for _ in range(2))
    np.testing.assert_array_equal(first.images, again.images)
    for stream, number, seed in ((TRAINING, 4, 0), (VALIDATION, 3, 0), (TRAINING, 3, 1)):
        other = replace(sampler, seed=seed).draw(stream, number, backend)
        assert np.abs(other.extrinsics - first.extrinsics).max() > 1


@pytest.mark.long
def test_batches_rendered_by_another_process_are_the_same(scene):
    one = trained(scene, replace(TINY, steps=4))
    other = trained(scene, replace(TINY, steps=4, workers=1))
    assert other.validation_mm == pytest.approx(one.validation_mm, rel=1e-3)
