"""Sentences and logs without the names of folders and files that may be a patient's: tables and logs are published."""

from __future__ import annotations

import os
import re
from pathlib import Path

from PolyPoseLib.data.benchmark.job import CaseSource
from PolyPoseLib.data.label_names import label_table
from PolyPoseLib.io.benchmark.named_labels import TABLE
from PolyPoseLib.io.benchmark.places import subject_name
from PolyPoseLib.io.whole_files import replaced_whole

_WORD = (
    r"(?:ct|labels?|segmentations?|study|truth|organs?|moving|fixed|field|poses?|xrays?|views?|images?|volume|mask|"
    r"imagesTr|labelsTr|ThoraxCBCT|dataset|subject|HN_P|im|slice|(?<![0-9])[0-9]{1,6}(?![0-9]))"
)
_ENDING = r"(?:\.(?:nii\.gz|nii|seg\.nrrd|nrrd|mha|json|dcm|pt|h5|hdf5|png|tiff?|npz|tfm))?"
_PLAIN = rf"{_WORD}(?:[-_. ]?{_WORD})*{_ENDING}"
"""Names of files and folders that say what they hold; whatever else may say whose it is."""

_UNKNOWN = re.compile(r"[^/\\:\n]*")
_ENDS = re.compile(_ENDING + r"$")
_SEPARATORS = "/\\"


class HiddenNames:
    """Texts about a source of cases, without names that may be a patient's.

    Parameters
    ----------
    source : CaseSource
        Its root becomes "the data", its subject's folder the subject, and every other name below the root that tells
        more than what a file holds "s" and a hash, as subjects are called.

    """

    def __init__(self, source: CaseSource) -> None:
        self._root, self._subject = source.root, source.subject
        places = [os.path.basename(self._root), *_names_in(Path(self._root))]
        self._own = next((each for each in places if self._called(each) == self._subject != each), None)

    def __call__(self, text: str) -> str:
        """The text; of a path only what lies below the root is left."""
        parts, done = [], 0
        while (at := text.find(self._root, done)) >= 0:
            end = at + len(self._root)
            parts.append(text[done:at])
            if text[end : end + 1].isalnum() or text[end : end + 1] in ("_", "-"):  # another folder beside it
                parts.append(self._root)
            else:
                names, end = self._below(text, end)
                parts.append("/".join(map(self._called, names)) or "the data")
            done = end
        found = "".join([*parts, text[done:]])
        return found.replace(self._own, self._subject) if self._own else found

    def in_file(self, path: Path) -> None:
        """Rewrite a log; raises OSError where the system refuses."""
        with replaced_whole(path) as temporary, temporary.open("wb") as kept, path.open("rb") as lines:
            for line in lines:
                kept.write(self(line.decode("utf-8", "surrogateescape")).encode("utf-8", "surrogateescape"))

    def _below(self, text: str, end: int) -> tuple[list[str], int]:
        """Names of the path that goes on in a text, as they lie on the disk, and where it ends."""
        place, names = Path(self._root), []
        while text[end : end + 1] and text[end] in _SEPARATORS:
            there = [each for each in _names_in(place) if text.startswith(each, end + 1)]
            unknown = _UNKNOWN.match(text, end + 1)
            name = max(there, key=len) if there else unknown[0] if unknown else ""
            end += 1 + len(name)
            if name:
                names.append(name)
            place = place / name
        return names, end

    def _called(self, name: str) -> str:
        ending = _ENDS.search(name)
        stem = name[: ending.start()] if ending else name
        if name == self._subject or stem in label_table(TABLE).values():
            return name
        return subject_name(Path(name), _PLAIN)


def _names_in(folder: Path) -> list[str]:
    """Names in a folder; none where it cannot be listed."""
    try:
        return os.listdir(folder)
    except (OSError, ValueError):
        return []
