"""Tables and figures that rows do not give any more go, and whatever a user has put beside them stays."""

import json
import os

import pytest
from benchmark_rows import row

from PolyPoseLib.benchmark.outputs import write_outputs


def rows(*views, datasets=("drawn",)):
    return [
        row(system, subject, 0.8, views=each, dataset=dataset, case=f"{subject}-{dataset}-{each}")
        for dataset in datasets
        for each in views
        for subject in ("a", "b")
        for system in ("rest", "polypose")
    ]


def there(folder):
    return {
        f"{place}/{name}": (folder / place / name).read_bytes()
        for place in ("tables", "figures")
        for name in os.listdir(folder / place)
    }


OWN = {
    "tables/table-mine.md": b"# For the paper",
    "tables/table-drawn-9x90.md": b"named as the program would name it",
    "tables/table-drawn-2-frames-copy.csv": b"1,2",
    "tables/notes.txt": b"",
    "figures/figure-mine.png": b"\x89PNG",
    "figures/figure-other-views.svg": b"<svg/>",
}


def put(folder, files):
    for name, content in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(content)


@pytest.mark.parametrize("listed", [True, False])
def test_files_of_a_users_own_stay(tmp_path, listed):
    """listed: whether there was an earlier call, which left a list."""
    if listed:
        write_outputs(rows("2-frames"), tmp_path)
    put(tmp_path, OWN)
    write_outputs(rows("2-frames", "3-frames"), tmp_path)
    write_outputs(rows("3-frames"), tmp_path)
    found = there(tmp_path)
    assert OWN.items() <= found.items()
    assert {"tables/table-drawn-3-frames.md", "tables/scores.csv"} <= set(found)
    assert "tables/table-drawn-2-frames.md" not in found


def test_only_what_is_stale_goes(tmp_path):
    """Of views that are named by an arc there is a figure, too."""
    pytest.importorskip("matplotlib")
    kept = rows("2-frames")
    write_outputs([*kept, *rows("3-frames"), *rows("2x30", datasets=("other",))], tmp_path)
    before = set(there(tmp_path))
    write_outputs(kept, tmp_path)
    stems = ("tables/table-drawn-3-frames", "tables/table-other-2x30")
    expected = {f"{stem}.{ending}" for stem in stems for ending in ("md", "csv", "tex")}
    figures = {f"figures/figure-other-views.{ending}" for ending in ("png", "svg")}
    assert before - set(there(tmp_path)) == expected | figures
    (tmp_path / "alone").mkdir()
    write_outputs(kept, tmp_path / "alone")
    assert set(there(tmp_path)) == set(there(tmp_path / "alone"))


def test_a_table_that_was_edited_is_a_users_own_from_then_on(tmp_path):
    write_outputs(rows("2-frames", "3-frames"), tmp_path)
    edited = tmp_path / "tables/table-drawn-3-frames.md"
    edited.write_text(edited.read_text() + "\nSee Methods.\n")
    for _ in range(2):
        write_outputs(rows("2-frames"), tmp_path)
    assert edited.read_text().endswith("See Methods.\n")
    assert not (tmp_path / "tables/table-drawn-3-frames.csv").exists()


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", "\xff", '{"version": 1}', '{"version": 1, "files": {"tables/table-mine.md": 3}}'],
)
def test_a_damaged_list_costs_no_file(tmp_path, text):
    put(tmp_path, OWN)
    (tmp_path / "outputs.json").write_bytes(text.encode("latin-1"))
    write_outputs(rows("2-frames"), tmp_path)
    assert OWN.items() <= there(tmp_path).items()


def test_a_list_that_names_other_places_removes_nothing_there(tmp_path):
    """Folders are passed on; the digests of files that one guesses are easy to write."""
    folder = tmp_path / "out"
    folder.mkdir()
    write_outputs(rows("2-frames", "3-frames"), folder)
    listed = json.loads((folder / "outputs.json").read_text())
    digest = listed["files"]["tables/table-drawn-3-frames.md"]
    content = (folder / "tables/table-drawn-3-frames.md").read_bytes()
    outside = ["precious.md", "out/rows/precious.md", "out/precious.md", "out/tables/below/precious.md"]
    for name in outside:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    names = ["../precious.md", "rows/precious.md", "precious.md", "tables/below/precious.md"]
    names += ["tables/../precious.md", "tables/../../precious.md", str(tmp_path / "precious.md")]
    listed["files"] |= dict.fromkeys(names, digest)
    (folder / "outputs.json").write_text(json.dumps(listed))
    write_outputs(rows("2-frames"), folder)
    assert all((tmp_path / name).read_bytes() == content for name in outside)
    assert not (folder / "tables/table-drawn-3-frames.md").exists()
