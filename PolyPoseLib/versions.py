"""The versions that a result records."""

from __future__ import annotations

import platform
from importlib import metadata

from PolyPoseLib import __version__

_PACKAGES = ("numpy", "scipy", "torch", "SimpleITK", "pydicom", "numba")


def installed_versions() -> dict[str, str]:
    """Versions of PolyPose, Python and the packages that decide results."""
    versions = {"polypose": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions
