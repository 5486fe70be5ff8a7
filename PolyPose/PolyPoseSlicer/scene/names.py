"""Names of new nodes."""

from __future__ import annotations

import itertools

import slicer


def free_name(name: str) -> str:
    """The name, or with the first number after it that no node bears, as in "CT_2".

    vtkMRMLScene.GenerateUniqueName counts every call: what a cancelled run had made and removed left a gap.
    """
    numbered = (f"{name}_{number}" for number in itertools.count(1))
    return next(
        each
        for each in itertools.chain([name], numbered)
        if slicer.mrmlScene.GetFirstNodeByName(each) is None
    )
