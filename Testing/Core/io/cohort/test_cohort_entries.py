"""Lists and folders of studies: what a cohort is, and every way in which a list can be wrong or hostile."""

import os

import pytest
from small_study import write_small_study

from PolyPoseLib.errors import InputError
from PolyPoseLib.io.cohort.entries import read_entries


def listed(folder, text, **options):
    """The studies of a list with this text."""
    path = folder / "list.csv"
    path.write_text(text, encoding="utf-8")
    return read_entries(path, options.get("allow_outside", False))


def test_a_list_names_studies_relative_to_itself(tmp_path):
    text = "\ufeff\n,,\nSite, ID ,study\nBonn,a-1,one/study.json\n\n,b.2,two\n"
    (tmp_path / "two").mkdir()
    found = listed(tmp_path, text)
    assert [each.identity for each in found] == ["a-1", "b.2"]
    assert [each.study for each in found] == [tmp_path / "one/study.json", tmp_path / "two/study.json"]
    assert [str(each.place) for each in found] == ["studies/a-1", "studies/b.2"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", 'no column "id"'),
        ("id,studi\na,b\n", 'no column "study" \\(it has "studi"\\)'),
        ("id;study\na;b\n", "separated by semicolons"),
        ("id,id,study\na,b,c\n", 'column "id" 2 times'),
        ("id,study\n", "there is no study"),
        ("id,study\na,s.json\nA,t.json\n", 'line 3 has the "id" "A" of line 2'),
        ("id,study\na\n", 'line 2 has no "study"'),
        ("id,study\n,s.json\n", "line 2"),
        ("id,study\na,../s.json\n", "outside of the list's folder"),
        ("id,study\na,/etc/passwd\n", "outside of the list's folder"),
        ("id,study\na,b\0c\n", 'no CSV|no "study"'),
        ('id,study\na,"b\nb,c\n', "line 3 is no CSV"),  # what follows would be lost
        ('id,study\na,"b\nb,c"\nd,e\n', "line 3: a cell goes over several lines"),
        (f"id,study\na,{'x' * 5000}\n", 'line 2: the "study" cannot be followed .File name too long'),
    ],
)
def test_wrong_lists_are_refused_with_a_fix(tmp_path, text, said):
    with pytest.raises(InputError, match=said):
        listed(tmp_path, text)


@pytest.mark.parametrize(
    "identity",
    [
        "../x", "..", ".", ".hidden", "a/b", "a\\b", "C:", "a b", "-rf", "=1+1", "@x", "+1", "é", "a.", "con",
        "NUL.txt", "x" * 101, "a\tb", "<b>", "a:b", "*", "lpt1",
    ],
)  # fmt: skip
def test_names_that_are_no_files_are_refused(tmp_path, identity):
    with pytest.raises(InputError, match=r'line 2: .*"id"'):
        listed(tmp_path, f'id,study\n"{identity}",s.json\n')


@pytest.mark.skipif(not hasattr(os, "symlink"), reason="needs links")
def test_a_link_out_of_the_folder_is_followed_before_it_is_refused(tmp_path):
    inside = tmp_path / "in"
    inside.mkdir()
    (inside / "link").symlink_to(tmp_path)
    with pytest.raises(InputError, match="outside"):
        listed(inside, "id,study\na,link/study.json\n")
    found = listed(inside, "id,study\na,link/study.json\n", allow_outside=True)
    assert found[0].study == tmp_path / "study.json"


def test_a_folder_gives_its_folders_with_a_study(tmp_path):
    for name in ("b", "a", ".hidden"):
        write_small_study(tmp_path / name)
    (tmp_path / "notes").mkdir()
    found = read_entries(tmp_path, False)
    assert [each.identity for each in found] == ["a", "b"]
    write_small_study(tmp_path / "a b")
    with pytest.raises(InputError, match='folder "a b"'):
        read_entries(tmp_path, False)
    with pytest.raises(InputError, match="no folder in it holds"):
        read_entries(tmp_path / "notes", False)


def test_what_is_no_list_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_entries(tmp_path / "absent.csv", False)
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00id")
    with pytest.raises(InputError, match="not UTF-8"):
        read_entries(tmp_path / "binary.csv", False)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(InputError, match="named pipe"):
            read_entries(tmp_path / "pipe", False)
