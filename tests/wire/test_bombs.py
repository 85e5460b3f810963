"""Files that ask for gigabytes, or that no writer wrote: one plain line, little time and memory."""

import struct
import subprocess
import sys
import time
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
import zstandard
from scipy.io import savemat

from rigwatch.commands import main
from rigwatch.wire.bus import MAX_PAYLOAD
from rigwatch.wire.errors import ImportDataError, MessageError, SessionError
from rigwatch.wire.exchange.mapping import ImportMapping, parse_source
from rigwatch.wire.exchange.mat5 import MatError, read_mat5
from rigwatch.wire.exchange.table_files import MOST_COLUMNS, read_table
from rigwatch.wire.messages import EstimateBlock, SampleBlock, decode
from rigwatch.wire.messages.packed import decode_block
from rigwatch.wire.session import chunk_reader, open_session
from rigwatch.wire.session.chunk_reader import MOST_OTHERS
from rigwatch.wire.session.chunks import MAGIC
from rigwatch.wire.typed_files import parse
from tests.exchange.test_exchange_import import made, simple
from tests.wire.test_session_damage import intact

MEMORY = 300 << 20
MAT_HEAD = b"MATLAB 5.0".ljust(124) + b"\x00\x01IM"


def peak_of(refused: type[Exception], call: object, *arguments: object, most: int = MEMORY) -> str:
    """The refusal, after at most 5 s of processor time and 300 MB."""
    tracemalloc.start()
    began = time.process_time()
    try:
        with pytest.raises(refused) as error:
            call(*arguments)  # type: ignore[operator]
        assert time.process_time() - began < 5.0
        assert tracemalloc.get_traced_memory()[1] < most
    finally:
        tracemalloc.stop()
    return str(error.value)


def chunk(records: bytes, packed: bytes | None = None, size: int | None = None) -> bytes:
    """A chunk of an MCAP file under the right checksum."""
    packed = zstandard.compress(records) if packed is None else packed
    head = struct.pack("<QQQI", 0, 1, size or len(records), zlib.crc32(records))
    body = head + struct.pack("<I4sQ", 4, b"zstd", len(packed)) + packed
    return struct.pack("<BQ", 6, len(body)) + body


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def test_a_session_whose_chunk_unpacks_to_much_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(MAGIC + chunk(bytes(256 << 20)) + MAGIC)
    assert path.stat().st_size < 50_000
    assert "wrong size" in peak_of(SessionError, open_session, path)


MALFORMED = {
    "many records of no kind": record(0, b"") * (MOST_OTHERS + 1),
    "a message without a head": record(5, b"abc"),
    "a schema that breaks off": record(3, b"\x01\x00\xff"),
    "a channel that breaks off": record(4, b"\x01\x00\x01\x00\xff\xff\xff\xff"),
    "a schema whose name is no text": record(3, b"\x01\x00\x02\x00\x00\x00\xff\xfe"),
    "a length beyond the chunk": struct.pack("<BQ", 5, 1 << 60),
}


def test_many_packed_records_of_no_kind_are_refused_at_the_first_of_them(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mcap"
    path.write_bytes(MAGIC + chunk(bytes(64 << 20)) * 3 + MAGIC)
    with pytest.raises(SessionError, match=f"more than {MOST_OTHERS} records"):
        list(open_session(path).samples())


def message(channel: int, body: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", channel, 0, 0, 0) + body)


FOREIGN = record(4, struct.pack("<HHI6sI4sI", 77, 0, 6, b"camera", 4, b"json", 0))
PACKED = {
    "messages of another topic": message(77, b"") * 400_000,
    "a long message of another topic": message(77, bytes(60 << 20)),
    "declarations": FOREIGN * 12_000,
    "messages of rigwatch without content": message(2, b"") * 400_000,
}


@pytest.mark.parametrize("records", PACKED.values(), ids=PACKED)
def test_packed_records_that_hold_nothing_are_read_only_as_far_as_the_size_of_the_file_warrants(
    tmp_path: Path, records: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chunk_reader, "BASE", 1 << 26)  # for the time of the test
    path = tmp_path / "bomb.mcap"
    path.write_bytes(intact()[: -len(MAGIC)] + chunk(FOREIGN + records) * 3 + MAGIC)
    with pytest.raises(SessionError, match="unpacks to far more than a file of its size"):
        list(open_session(path).messages(["run"]))


def test_messages_of_others_that_are_in_a_session_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "shared.mcap"
    frames = (message(77, np.random.default_rng(n).bytes(60_000)) for n in range(32))
    path.write_bytes(intact()[: -len(MAGIC)] + chunk(FOREIGN + b"".join(frames)) * 2 + MAGIC)
    assert list(open_session(path).samples())


@pytest.mark.parametrize("records", MALFORMED.values(), ids=MALFORMED)
def test_records_malformed_under_a_right_checksum_are_one_line(
    tmp_path: Path, records: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "forged.mcap"
    path.write_bytes(intact()[: -len(MAGIC)] + chunk(records) + MAGIC)
    assert main(["info", str(path)]) in (0, 2)
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("promised", "told"), [(1 << 28, "unpacks to more than"), (8, "longer than it says")]
)
def test_a_mat_file_that_unpacks_to_much_is_refused_for_its_first_bytes(
    promised: int, told: str
) -> None:
    packed = zlib.compress(struct.pack("<II", 14, promised) + bytes(1 << 28), 1)
    bomb = MAT_HEAD + struct.pack("<II", 15, len(packed)) + packed
    assert told in peak_of(MatError, read_mat5, bomb, most=8 << 20)


def test_a_mat_file_of_many_small_parts_is_refused() -> None:
    inside = struct.pack("<HHI", 1, 0, 0) * 4_000_000
    packed = zlib.compress(struct.pack("<II", 14, len(inside)) + inside)
    bomb = MAT_HEAD + struct.pack("<II", 15, len(packed)) + packed
    assert "parts" in peak_of(MatError, read_mat5, bomb)


def test_a_mat_file_of_constant_channels_is_read(tmp_path: Path) -> None:
    path = tmp_path / "zeros.mat"
    savemat(path, {"u": np.zeros(1_000_000), "x": np.arange(1_000_000.0)}, do_compression=True)
    assert {k: v.size for k, v in read_mat5(path.read_bytes()).items() if k in "ux"} == {  # type: ignore[union-attr]
        "u": 1_000_000,
        "x": 1_000_000,
    }


def test_a_parquet_file_that_unpacks_to_much_is_refused(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "bomb.parquet"
    table = pyarrow.table({"t": pyarrow.array(np.zeros(30_000_000, np.int8))})
    parquet.write_table(table, path, compression="zstd")
    del table
    assert "unpacks to more than" in peak_of(ImportDataError, read_table, path, ImportMapping())


def test_parquet_texts_that_unpack_to_much_are_refused_and_so_are_too_many_columns(
    tmp_path: Path,
) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path, text = tmp_path / "bomb.parquet", "a" * (40 << 20)
    parquet.write_table(pyarrow.table({"t": [0.0], "u": [text]}), path, compression="zstd")
    assert "unpacks to more than" in peak_of(ImportDataError, read_table, path, ImportMapping())
    columns = {f"c{number}": [0.0] for number in range(MOST_COLUMNS + 1)}
    parquet.write_table(pyarrow.table(columns), path)
    found = f"{MOST_COLUMNS + 1} columns, expected at most {MOST_COLUMNS}"
    assert found in peak_of(ImportDataError, read_table, path, ImportMapping())


def test_a_parquet_text_that_many_rows_repeat_takes_the_memory_of_one(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    rows, path = 4000, tmp_path / "bomb.parquet"
    texts = pyarrow.DictionaryArray.from_arrays(np.zeros(rows, np.int32), ["a" * 20_000])
    lists = pyarrow.ListArray.from_arrays(np.arange(rows + 1, dtype=np.int32), texts)
    columns = {"t": np.arange(float(rows)), "u": texts, "notes": lists}
    parquet.write_table(pyarrow.table(columns), path, store_schema=False)
    tracemalloc.start()
    cells = read_table(path, ImportMapping()).cells
    assert tracemalloc.get_traced_memory()[1] < 8 << 20
    tracemalloc.stop()
    assert list(cells) == ["t", "u"]
    assert {*cells["u"]} == {"a" * 20_000}


def test_parquet_columns_whose_names_select_each_other_are_refused(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    for number, second in enumerate(("t", "t.u")):
        path = tmp_path / f"{number}.parquet"
        inside = pyarrow.array([{"v": 1.0}])
        parquet.write_table(pyarrow.Table.from_arrays([[0.0], inside], ["t", second]), path)
        with pytest.raises(ImportDataError, match="several columns of one name"):
            read_table(path, ImportMapping())


def test_an_error_that_quotes_a_long_name_is_cut(tmp_path: Path) -> None:
    with pytest.raises(ImportDataError, match="found no column") as error:
        made(tmp_path, f"t,{'a' * 100_000}\n0,1\n1,2\n2,3\n", simple())
    assert len(str(error.value)) < 5000


@pytest.mark.parametrize(("kind", "field"), [(SampleBlock, 6), (EstimateBlock, 5)])
def test_a_message_of_empty_columns_is_refused_before_they_are_made(
    kind: type[SampleBlock | EstimateBlock], field: int
) -> None:
    bomb = bytes([field << 3 | 2, 0]) * (MAX_PAYLOAD // 2)
    for reads in (decode, decode_block):
        began = time.process_time()
        with pytest.raises(MessageError, match="131072 columns, expected at most 4096"):
            reads(kind, bomb)
        assert time.process_time() - began < 0.5


def test_a_cell_without_end_is_named(tmp_path: Path) -> None:
    with pytest.raises(ImportDataError, match=r"run\.csv: not readable as CSV: field larger"):
        made(tmp_path, f"t,qm\n0,{'1' * 200_000}\n1,2\n", simple())


@pytest.mark.parametrize(("times", "told"), [("0 1 2 1e12", "a jump from"), ("0 1 1e300", "time:")])
def test_a_jump_of_time_is_named_and_asks_for_no_memory(
    tmp_path: Path, times: str, told: str
) -> None:
    rows = "".join(f"{t},1\n" for t in times.split())
    message = peak_of(ImportDataError, made, tmp_path, f"t,qm\n{rows}", simple(time="t[ms]"))
    assert told in message


@pytest.mark.parametrize("source", ["qm*nan[m]", "qm*inf[m]", "qm*1e999[m]", "qm + 1e999[m]"])
def test_factors_that_are_no_numbers_are_refused(source: str) -> None:
    with pytest.raises(ImportDataError, match="finite"):
        parse_source("position", source, ("qm",))


@pytest.mark.parametrize("rate", ["inf", "nan", "1e-300", "1e300", "0"])
def test_rates_that_no_device_has_are_refused(rate: str) -> None:
    from rigwatch.wire.errors import ConfigError

    with pytest.raises(ConfigError, match="rate"):
        parse(f"rate = {rate}\n", ImportMapping, "map.toml")


def test_a_rate_that_no_device_has_is_refused_as_an_option_too(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    table = tmp_path / "a.csv"
    table.write_text("x\n1\n2\n")
    words = [str(table), str(tmp_path / "a.mcap"), "--map", "position=x[m]", "--rate", "1e-300"]
    assert main(["import", *words]) == 2
    told = capsys.readouterr().err
    assert told == "rigwatch: options of import: rate: found 1e-300, expected a number >= 1e-06\n"


def test_output_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "good.mcap"
    path.write_bytes(intact())
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "rigwatch", "info", str(path)]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "rigwatch: the output cannot be written: no space left on the disk\n"
