"""Files of weights: tensors and nothing else, for the network that they fit."""

import pickle

import pytest
import torch

from PolyPoseLib.baselines.weights import load_weights, read_weights
from PolyPoseLib.errors import InputError


class Trap:
    """Pickled, it would write a file when it is read."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_weights_load_whether_or_not_the_network_was_compiled(tmp_path):
    given, compiled, found = (torch.nn.Linear(3, 2) for _ in range(3))
    torch.save(given.state_dict(), tmp_path / "plain.pth")
    torch.save({f"_orig_mod.{k}": v for k, v in given.state_dict().items()}, tmp_path / "compiled.pth")
    for name, network in (("plain.pth", found), ("compiled.pth", compiled)):
        load_weights(network, tmp_path / name, "x")
        assert torch.equal(network.weight, given.weight)


def test_nothing_is_unpickled(tmp_path):
    trap = tmp_path / "sprung"
    torch.save({"weight": Trap(trap)}, tmp_path / "torch.pth")
    (tmp_path / "plain.pth").write_bytes(pickle.dumps(Trap(trap)))
    for name in ("torch.pth", "plain.pth"):
        with pytest.raises(InputError, match=r"this is no file of weights for fdk-x"):
            read_weights(tmp_path / name, "fdk-x")
    assert not trap.exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"weights", b"\x80\x02}."])
def test_other_files_are_refused(tmp_path, content):
    (tmp_path / "w.pth").write_bytes(content)
    with pytest.raises(InputError, match=r"w\.pth: "):
        read_weights(tmp_path / "w.pth", "fdk-x")


@pytest.mark.parametrize(
    "change, said",
    [
        (lambda state: state.pop("bias"), '"bias" has the shape of nothing'),
        (lambda state: state.update(weight=torch.zeros(2, 4)), r'"weight" has the shape \(2, 4\)'),
        (lambda state: state.update(more=torch.zeros(1)), "none of that name"),
        (lambda state: state.update(bias=torch.tensor([1.0, float("nan")])), "NaN or infinity"),
    ],
)
def test_weights_of_another_network_are_refused(tmp_path, change, said):
    network = torch.nn.Linear(3, 2)
    state = dict(network.state_dict())
    change(state)
    torch.save(state, tmp_path / "w.pth")
    with pytest.raises(InputError, match=said):
        load_weights(network, tmp_path / "w.pth", "fdk-x")


def test_a_file_of_something_else_is_refused(tmp_path):
    torch.save({"epoch": 3}, tmp_path / "w.pth")
    with pytest.raises(InputError, match="something else than named tensors"):
        read_weights(tmp_path / "w.pth", "fdk-x")


@pytest.mark.parametrize("content", [b"\x80\x02.", b"ustar", b"\x80\x02(K\x01e."])
def test_hostile_files_are_told_in_a_sentence(tmp_path, content):
    """Torch's reader raises IndexError for these."""
    (tmp_path / "w.pth").write_bytes(content)
    with pytest.raises(InputError, match=r"w\.pth: this is no file of weights for x"):
        read_weights(tmp_path / "w.pth", "x")
