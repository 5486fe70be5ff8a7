"""A study's preview is written in the study's own folder, unless the user allows another."""

import pytest

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.paths import resolve_output


def test_a_file_in_the_folder(tmp_path):
    (tmp_path / "below").mkdir()
    for name in ("preview.h5", "below/preview.h5"):
        assert resolve_output(name, "preview", tmp_path, False) == tmp_path.resolve() / name


@pytest.mark.parametrize(
    "name", ["../preview.h5", "/etc/preview.h5", "link/preview.h5", "taken.h5", "", 5, "a\0"]
)
def test_nothing_outside_is_overwritten(tmp_path, name):
    study, outside = tmp_path / "study", tmp_path / "outside"
    study.mkdir()
    outside.mkdir()
    (outside / "precious.h5").write_text("precious")
    (study / "link").symlink_to(outside)
    (study / "taken.h5").symlink_to(outside / "precious.h5")
    with pytest.raises(InputError):
        resolve_output(name, "preview", study, False)


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        resolve_output("nowhere/preview.h5", "preview", tmp_path, False)
