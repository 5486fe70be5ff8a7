"""The packages of the extra ``cohort``, which nothing else of the program needs."""

from __future__ import annotations

from PolyPoseLib.errors import InputError


def require_packages() -> None:
    """Raise InputError where one is missing."""
    try:
        import cryptography
        import dask_jobqueue
        import distributed
        import pyarrow
    except ImportError as error:
        raise InputError(
            f"A cohort needs packages that are not installed ({error}): pip install 'polypose[cohort]'."
        ) from error
    del cryptography, dask_jobqueue, distributed, pyarrow
