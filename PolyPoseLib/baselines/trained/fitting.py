"""What a trained system does with a study: weights, inputs, the network, and its displacement in mm."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import nn

from PolyPoseLib.baselines.trained.network_grid import NetworkGrid
from PolyPoseLib.baselines.trained.network_inputs import lifted, scaled_ct, views_of
from PolyPoseLib.baselines.trained.trained_weights import TrainedWeights, read_weights
from PolyPoseLib.data.benchmark.system import Motion, SystemSetting
from PolyPoseLib.data.study import Study
from PolyPoseLib.errors import CancelledError, InputError
from PolyPoseLib.rendering.select import resolve_device
from PolyPoseLib.similarity.torch_threads import torch_threads


def training_command(system: str) -> str:
    """The command that trains a system, for sentences."""
    return (
        f'"python -m PolyPoseLib train STUDY.json --system {system} --output {system}.pt", or with DATASET DATA '
        "--views VIEWS in place of STUDY.json"
    )


def fit_trained(
    system: str, network_of: Callable[[TrainedWeights], nn.Module], study: Study, setting: SystemSetting
) -> Motion:
    """Answer with a trained network.

    Parameters
    ----------
    system : str
        Its name, under which the setting has its weights.
    network_of : Callable[[TrainedWeights], nn.Module]
        Builds the network, in which the weights' tensors are.
    study, setting
        As :class:`PolyPoseLib.data.benchmark.system.System` has them.

    Raises
    ------
    InputError
        No weights, wrong ones, or of another number of X-rays, view angles or size of CT; an X-ray without a camera;
        a GPU that is asked for and not there.
    CancelledError
        The caller cancelled.

    """
    path = setting.weights.get(system)
    command = training_command(system)
    if path is None:
        raise InputError(
            f"{system} needs weights that were trained for such CTs and X-rays: train them with {command}, and give "
            f"the file as the weights of {system}."
        )
    device = resolve_device(setting.device)
    weights = read_weights(path, system, command)
    _ask(setting)
    setting.progress(0, 3, None)
    grid = NetworkGrid.of(study.ct, weights.side)
    views = views_of(study.xrays, weights.side)
    try:
        order = weights.require(grid, [view.camera for view in views])
    except InputError as error:
        raise InputError(
            f"{path}: these weights do not fit: {error}. Train others with {command}."
        ) from error
    try:
        network = network_of(weights)
    except (RuntimeError, KeyError, ValueError, AttributeError) as error:
        raise InputError(
            f"{path}: these weights do not fit their settings: train them with {command}."
        ) from error
    with torch_threads(setting.threads), torch.no_grad():
        network = network.to(device).eval()
        moving = torch.from_numpy(scaled_ct(study.ct, grid))[None, None].to(device)
        _ask(setting)
        setting.progress(1, 3, None)
        xrays = torch.from_numpy(lifted([views[number] for number in order], grid))[None].to(device)
        displacement = network(moving, xrays)[0].cpu().numpy()
    _ask(setting)
    setting.progress(2, 3, None)
    field = grid.field(displacement, study.ct)
    setting.progress(3, 3, None)
    report = weights.report
    return Motion(
        field=field,
        notes=(
            f"{system}: {weights.side}^3 nodes, trained on {report.get('pairs', '?')} pairs for "
            f"{report.get('steps', '?')} steps, written anew after the published description",
        ),
    )


def _ask(setting: SystemSetting) -> None:
    """Raise CancelledError when the caller wants to stop."""
    if setting.cancelled():
        raise CancelledError("The registration was cancelled.")
