"""The table that `make bench` prints."""

from benchmarks.__main__ import measure
from benchmarks.table import Row, as_markdown, as_text

GOOD = Row("replay speed", "2 400 × real time", "2 000 ×", "", "one core", passed=True)
BAD = Row("false alarms", "1 in 24 h", "0", "none", "", passed=False)
OPEN = Row("jitter | worst", "0.4 ms", "", "", "", passed=None)


def test_every_cell_and_note_is_in_the_text() -> None:
    text = as_text([GOOD, BAD])
    for part in ("ok", "MISS", "replay speed", "2 400 × real time", "one core", "none"):
        assert part in text


def test_long_cells_are_wrapped_and_nothing_is_cut() -> None:
    words = [f"word{i}" for i in range(60)]
    text = as_text([Row(" ".join(words), "1", "2", "3", "", passed=None)])
    assert all(word in text for word in words)
    assert max(len(line) for line in text.splitlines()) <= 150


def test_markdown_has_a_line_a_row_and_no_stray_column() -> None:
    lines = as_markdown([GOOD, OPEN]).splitlines()
    assert len(lines) == 4
    assert {line.replace("\\|", "").count("|") for line in lines} == {7}


def test_a_benchmark_that_fails_is_a_row_that_misses_its_bar() -> None:
    rows = measure("no_such_benchmark", quick=True)
    assert [row.passed for row in rows] == [False]
