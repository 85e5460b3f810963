"""CSV files are read and written in parts: memory stays flat, and nothing shows the seams."""

import os
import threading
import tracemalloc
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rigwatch.wire.errors import ImportDataError
from rigwatch.wire.exchange import ImportMapping, export_session, import_file
from rigwatch.wire.exchange.csv_table import PART
from rigwatch.wire.messages.message_types import SampleBlock
from rigwatch.wire.session import open_session

ROWS = 3 * PART + 17
MAPPED = ImportMapping(channels={"position": "x[m]", "force": "u*2[N]"}, time="t[s]")
PEAK_PER_ROW = 120
"""Times, their steps and what the grid says of them; the text of a row would take 600 [bytes]."""


def lines(rows: int) -> list[str]:
    """A header and rows at 256 Hz."""
    return list(_lines(rows))


@cache
def _lines(rows: int) -> tuple[str, ...]:
    values = np.random.default_rng(1).normal(size=(rows, 2)).tolist()
    return ("t,x,u", *(f"{k / 256!r},{x!r},{u!r}" for k, (x, u) in enumerate(values)))


def written(path: Path, text: list[str]) -> Path:
    path.write_text("\n".join(text) + "\n")
    return path


def imported(source: Path, mapping: ImportMapping = MAPPED) -> SampleBlock:
    """All samples of the session that the file becomes."""
    target = source.with_suffix(".mcap")
    import_file(source, target, mapping)
    (block,) = open_session(target).samples(size=1 << 30)
    return block


def peak(rows: int, folder: Path, mapping: ImportMapping) -> int:
    """The most memory that an import takes [bytes]."""
    source = written(folder / f"{rows}.csv", lines(rows))
    if not mapping.channels:
        import_file(source, folder / "once.mcap", MAPPED)
        source.unlink()
        export_session(open_session(folder / "once.mcap"), source)
    tracemalloc.start()
    try:
        import_file(source, folder / "peak.mcap", mapping)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        for made in folder.glob("*.mcap"):
            made.unlink()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "mapping",
    [pytest.param(MAPPED, id="mapped"), pytest.param(ImportMapping(), id="exported")],
)
def test_memory_does_not_grow_with_the_text(tmp_path: Path, mapping: ImportMapping) -> None:
    few, many = 2 * PART, 6 * PART
    peak(PART, tmp_path, mapping)  # what is imported once
    grown = peak(many, tmp_path, mapping) - peak(few, tmp_path, mapping)
    assert grown / (many - few) < PEAK_PER_ROW


def test_every_row_comes_over_to_the_bit(tmp_path: Path) -> None:
    text = lines(ROWS)
    block = imported(written(tmp_path / "run.csv", text))
    cells = [line.split(",") for line in text[1:]]
    assert block.channel("position").values.tolist() == [float(x) for _, x, _ in cells]
    assert block.channel("force").values.tolist() == [2 * float(u) for _, _, u in cells]
    assert np.array_equal(block.t_ns, np.round(np.arange(ROWS) / 256 * 1e9).astype(np.int64))
    assert block.seq == 0


def test_rows_written_twice_at_a_seam_count_once(tmp_path: Path) -> None:
    text = lines(ROWS)
    once = imported(written(tmp_path / "once.csv", text))
    twice = imported(written(tmp_path / "twice.csv", [*text[: PART + 1], *text[PART:]]))
    assert twice.channel("force").values.tobytes() == once.channel("force").values.tobytes()
    assert np.array_equal(twice.t_ns, once.t_ns)


def test_a_cell_of_a_later_part_is_named_with_its_line(tmp_path: Path) -> None:
    text = lines(ROWS)
    text[2 * PART + 5] = text[2 * PART + 5].replace(",", ",two", 1)
    with pytest.raises(ImportDataError, match=rf"run.csv:{2 * PART + 6}, column x: found 'two"):
        imported(written(tmp_path / "run.csv", text))
    assert not list(tmp_path.glob("*.mcap*"))


def test_rows_left_out_are_left_out_of_the_parts(tmp_path: Path) -> None:
    text = lines(ROWS)
    mapping = ImportMapping(channels=MAPPED.channels, time=MAPPED.time, skip_rows=PART + 3)
    block = imported(written(tmp_path / "run.csv", text), mapping)
    assert len(block) == ROWS - PART - 3
    assert block.channel("position").values[0] == float(text[PART + 4].split(",")[1])


def test_a_pipe_which_is_read_once_is_imported(tmp_path: Path) -> None:
    text = lines(ROWS)
    once = imported(written(tmp_path / "file.csv", text))
    os.mkfifo(tmp_path / "pipe.csv")
    feed = threading.Thread(target=written, args=(tmp_path / "pipe.csv", text))
    feed.start()
    block = imported(tmp_path / "pipe.csv")
    feed.join()
    assert block.channel("position").values.tobytes() == once.channel("position").values.tobytes()
