"""What people see on the console while they wait, and afterwards."""

from PolyPoseLib.cli._console import ProgressBar, bar_line, table
from PolyPoseLib.data.progress import Progress


def test_the_bar_is_readable(capsys):
    line = bar_line(Progress("camera ap", 5, 10, 0.87654, 12.3))
    assert line == "camera ap            [############............] 5/10  similarity 0.8765  12 s"
    bar = ProgressBar()
    for n in range(100):
        bar(Progress("a", n, 100, None, 0.0))
    bar.close()
    assert capsys.readouterr().err.count("\n") == 1
    assert bar_line(Progress("x", 0, 0, None, 0)).endswith("0/0  0 s")


def test_tables_align():
    text = table(("name", "x mm"), [("a", 1.0), ("long name", float("nan")), ("b", None)])
    assert text.splitlines() == [
        "name       x mm",
        "---------  ----",
        "a          1.00",
        "long name     -",
        "b             -",
    ]
