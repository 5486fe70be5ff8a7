"""Every row stands in the table of its views, and none that failed is passed over."""

from benchmark_rows import row

from PolyPoseLib.evaluation.benchmark.statistics import tables_of
from PolyPoseLib.evaluation.benchmark.table_rows import table_rows


def counts(rows):
    """{(views, system): (cases with scores, cases)}."""
    return {
        (table.views, line.system): (line.done, line.cases)
        for table in tables_of(rows)
        for line in table.lines
    }


def test_real_x_rays_share_a_table_by_their_number():
    rows = [
        row("a", "s1", 0.9, views="10+9"),
        row("a", "s2", 0.9, views="0+33"),
        row("a", "s3", 0.9, views="7"),
    ]
    assert counts(rows) == {("2-frames", "a"): (2, 2), ("1-frames", "a"): (1, 1)}


def test_own_x_rays_that_could_not_be_read_count_in_every_table_of_own_x_rays():
    done = [row("a", "s1", 0.9, views="own-2x60"), row("a", "s2", 0.9, views="own-3x90"), row("a", "s1", 0.8)]
    unread = row("a", "s3", status="failed", views="own", reason="it could not be read")
    for rows in ([*done, unread], [unread, *done]):
        assert counts(rows) == {
            ("own-2x60", "a"): (1, 2),
            ("own-3x90", "a"): (1, 2),
            ("2x30", "a"): (1, 1),
        }
    assert counts([unread, done[2]]) == {("own", "a"): (0, 1), ("2x30", "a"): (1, 1)}


def test_rows_of_other_data_sets_are_apart():
    rows = [row("a", "s1", 0.9), row("a", "s1", views="own", status="failed", dataset="other")]
    assert [(place, len(own)) for place, own in table_rows(rows).items()] == [
        (("drawn", "2x30"), 1),
        (("other", "own"), 1),
    ]
