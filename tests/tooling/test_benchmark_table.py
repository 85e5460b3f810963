"""The table that `make bench` prints, and the page that it writes."""

from pathlib import Path

from tools.benchmark_page import keep, page, read
from tools.benchmark_table import Row, as_markdown, as_text, failed, rows_of

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


def test_markdown_has_a_line_a_row_and_only_the_columns_that_a_row_fills() -> None:
    lines = as_markdown([GOOD, OPEN]).splitlines()
    assert lines[0] == "|  | what | measured | bar | note |"
    assert len(lines) == 4
    assert {line.replace("\\|", "").count("|") for line in lines} == {6}


def test_a_benchmark_that_fails_is_a_row_that_misses_its_bar() -> None:
    def broken() -> list[Row]:
        raise OSError("no room")

    rows = rows_of("replay", broken)
    assert [(row.what, row.passed) for row in rows] == [("replay", False)]
    assert rows_of("replay", lambda: [GOOD]) == [GOOD]


def test_a_run_replaces_the_rows_of_what_ran_and_keeps_the_others(tmp_path: Path) -> None:
    file = tmp_path / "results.json"
    keep({"replay": [GOOD], "false_alarms": [BAD]}, {"cores": "2"}, file)
    keep({"replay": [OPEN]}, {"cores": "4"}, file)
    kept = read(file)
    assert (kept["replay"].rows, kept["replay"].machine) == ([OPEN], {"cores": "4"})
    assert (kept["false_alarms"].rows, kept["false_alarms"].machine) == ([BAD], {"cores": "2"})


def test_a_benchmark_that_fails_keeps_its_earlier_rows(tmp_path: Path) -> None:
    file = tmp_path / "results.json"
    keep({"replay": [GOOD]}, {}, file)
    keep({"replay": [failed("replay", OSError("no room"))], "rivals": []}, {}, file)
    assert {name: kept.rows for name, kept in read(file).items()} == {"replay": [GOOD]}


def test_the_page_names_command_machine_and_verdict_also_of_a_benchmark_it_does_not_know(
    tmp_path: Path,
) -> None:
    text = page(keep({"replay": [GOOD], "odd": [BAD]}, {"cores": "2"}, tmp_path / "results.json"))
    assert "`python -m benchmarks replay`, on 2 cores." in text
    assert "| ok | replay speed |" in text
    assert "| MISS | false alarms |" in text
    assert text.index("replay speed") < text.index("Further benchmarks") < text.index("### odd")
