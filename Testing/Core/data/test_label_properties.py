"""Label tables and proposals of structures, over any set of labels."""

from hypothesis import given
from hypothesis import strategies as st

from PolyPoseLib.data.label_names import (
    DETAILS,
    TABLES,
    label_table,
    propose_anchor,
    propose_structures,
    structure_of,
)

TABLE = st.sampled_from(TABLES)


@given(TABLE)
def test_every_label_of_a_table_has_a_name_of_its_own(table):
    names = label_table(table)
    assert all(number > 0 and name for number, name in names.items())
    assert len(set(names.values())) == len(names)


@given(TABLE, st.sampled_from(DETAILS), st.data())
def test_a_proposal_holds_each_bone_once_and_nothing_else(table, detail, data):
    names = label_table(table)
    labels = data.draw(st.lists(st.sampled_from(sorted(names)), unique=True))
    groups = propose_structures(labels, table, detail)
    bones = [number for number in labels if structure_of(names[number], detail)]
    assert sorted(number for group in groups.values() for number in group) == sorted(bones)
    assert all(
        structure_of(names[number], detail) == name for name, group in groups.items() for number in group
    )


@given(TABLE, st.sampled_from(DETAILS), st.data())
def test_numbers_and_names_lead_to_the_same_structures(table, detail, data):
    names = label_table(table)
    labels = data.draw(st.lists(st.sampled_from(sorted(names)), unique=True))
    by_number = propose_structures(labels, table, detail)
    by_name = propose_structures([names[number] for number in labels], detail=detail)
    assert {key: [names[number] for number in group] for key, group in by_number.items()} == by_name
    assert list(by_number) == list(by_name)


@given(st.text())
def test_any_text_is_the_name_of_a_bone_or_of_none(name):
    found = structure_of(name)
    assert found is None or (found and found == structure_of(name.upper()))


@given(st.lists(st.text(min_size=1), unique=True))
def test_the_anchor_is_one_of_the_structures(structures):
    anchor = propose_anchor(structures)
    assert anchor in structures if structures else anchor is None
