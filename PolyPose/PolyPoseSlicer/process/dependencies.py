"""The Python packages of the registration: asked for and installed when they are first needed, never before."""

from __future__ import annotations

import importlib.metadata
from pathlib import Path

import slicer
from slicer.i18n import tr as _

from PolyPoseLib.errors import PolyPoseError

REQUESTER = "PolyPose"
TORCH_REQUIREMENT = ">=2.2"


class DependencyError(PolyPoseError):
    """A package is missing and was not installed; the sentence says how to get it."""


def ensure_dependencies(requirements: str | Path) -> None:
    """Install what is missing after asking the user; returns at once when nothing is.

    requirements: path of requirements.txt. Raises DependencyError when the user declines or it fails.
    """
    import slicer.packaging

    try:
        wanted = slicer.packaging.load_requirements(str(requirements))
        slicer.packaging.pip_ensure(wanted, requester=REQUESTER)
    except Exception as error:
        raise DependencyError(
            _("The Python packages that PolyPose needs were not installed ({reason}): try again.").format(
                reason=str(error) or type(error).__name__
            )
        ) from error
    _install_torch_if_missing()


def has_torch() -> bool:
    """Whether PyTorch is installed; it is not imported, for only the child process uses it."""
    try:
        importlib.metadata.version("torch")
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def is_testing() -> bool:
    """Whether the application was started for tests, which install nothing."""
    return bool(slicer.app.testingEnabled())


def _install_torch_if_missing() -> None:
    """Let the PyTorch extension install PyTorch; it finds the build that fits the graphics card."""
    if has_torch():
        return
    try:
        import PyTorchUtils
    except ImportError as error:
        raise DependencyError(
            _(
                "PyTorch is missing: install the extension PyTorch in the Extensions Manager and restart Slicer."
            )
        ) from error
    if is_testing():
        raise DependencyError(_("PyTorch is missing, and nothing is installed while testing."))
    try:
        torch = PyTorchUtils.PyTorchUtilsLogic().installTorch(
            askConfirmation=True, torchVersionRequirement=TORCH_REQUIREMENT
        )
    except Exception as error:
        if (
            has_torch()
        ):  # it was installed, but not imported into Slicer itself: only the child process needs it
            return
        raise DependencyError(
            _("PyTorch could not be installed ({reason}): install it in the module PyTorch Utils.").format(
                reason=error
            )
        ) from error
    if torch is None:
        raise DependencyError(_("PyTorch was not installed: PolyPose cannot register without it."))
