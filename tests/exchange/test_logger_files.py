"""Text files as loggers and spreadsheets write them: dates, preambles, units, encodings."""

from pathlib import Path

import numpy as np
import pytest

from rigwatch.physics.engine.equations import model_named
from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange import ImportMapping, read_table
from rigwatch.workbench.steps.log_columns import matched


def table(folder: Path, text: str, encoding: str = "utf-8"):
    path = folder / "log.csv"
    path.write_bytes(text.encode(encoding))
    return read_table(path, ImportMapping())


@pytest.mark.parametrize(
    "cells",
    [
        ("2026-03-02 23:59:59", "2026-03-03 00:00:00.5"),
        ("2026-03-02T23:59:59+01:00", "2026-03-02T23:00:00.5Z"),
        ("02.03.2026 23:59:59", "03.03.2026 00:00:00,5"),
        ("28/2/2026 23:59:59", "1/3/2026 00:00:00.5"),
        ("1/2/2026 11:59:59 PM", "1/3/2026 12:00:00.5 AM"),
        ("23:59:59", "00:00:00.5"),
    ],
)
def test_dates_and_times_of_day_are_seconds(tmp_path, cells):
    found = table(tmp_path, f"Time;x\n{cells[0]};1,5\n{cells[1]};2\n")
    assert found.states_time("Time")
    np.testing.assert_allclose(np.diff(found.numbers("Time")), [1.5], atol=1e-6)


def test_a_time_that_is_none_is_named(tmp_path):
    found = table(tmp_path, "Time,x\n2026-02-28 09:00:00,1\n2026-02-30 09:00:01,2\n")
    with pytest.raises(ImportDataError, match=r"log.csv:3, column Time: found '2026-02-30"):
        found.numbers("Time")


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("Logger;7\n\nt;Kraft;n\ns;kN;-\n0,0;1,5;2\n0,1;1,6;3\n", ("t [s]", "Kraft [kN]", "n")),
        ("# made by a logger\n# t, F\n0,1.5\n0.1,1.6\n", ("t", "F")),
        ("Log v2\nstarted today\n\nt\tF (N)\n0\t1.5\n0.1\t1.6\n", ("t", "F (N)")),
        ("t (s),F\n[ms],[N]\n0.0,1.5\n0.1,1.6\n", ("t (s)", "F [N]")),
    ],
)  # fmt: skip
def test_the_header_is_found_below_a_preamble_with_the_units_below_it(tmp_path, text, names):
    found = table(tmp_path, text)
    assert found.names == names
    np.testing.assert_allclose(found.numbers(names[0]), [0.0, 0.1])
    np.testing.assert_allclose(found.numbers(names[1]), [1.5, 1.6])


def test_a_broken_row_is_no_header(tmp_path):
    found = table(tmp_path, "t,x\nfoo,bar\n0,1\n1,2\n")
    assert found.names == ("t", "x")
    with pytest.raises(ImportDataError, match=r"log.csv:2, column t: found 'foo'"):
        found.numbers("t")


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
def test_a_degree_sign_is_read_in_any_usual_encoding(tmp_path, encoding):
    assert table(tmp_path, "t,T (°C)\n0,1\n1,2\n", encoding).names == ("t", "T (°C)")


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "log.csv").write_bytes(bytes(range(256)) * 9)
    with pytest.raises(ImportDataError, match="bytes that are no text"):
        read_table(tmp_path / "log.csv", ImportMapping())


@pytest.mark.parametrize(
    ("columns", "dated", "time"),
    [
        (("Zeit (s)", "displacement (mm)", "force (N)"), (), "Zeit (s)[s]"),
        (("Datum", "displacement (mm)", "force (N)"), ("Datum",), "Datum[s]"),
        (("Time [hh:mm:ss]", "displacement (mm)", "force (N)"), ("Time [hh:mm:ss]",), "[s]"),
        (("lap (s)", "pause (s)", "displacement (mm)", "force (N)"), (), ""),
    ],
)
def test_the_only_column_of_times_is_the_time(columns, dated, time):
    found = matched(columns, model_named("damper"), {}, "", dated)
    assert found.time.endswith(time)
    assert bool(found.time) == bool(time)
    assert not any("assumed s" in remark for remark in found.remarks)


def test_with_a_rate_a_column_of_durations_is_no_time():
    columns = ("lap (s)", "displacement (mm)", "force (N)")
    assert not matched(columns, model_named("damper"), {}, counted=True).time
