"""Foreign recordings for `rigwatch import`, and the readers of their mutations."""

import contextlib
import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.exchange import ImportMapping, columns_of, export_session, import_file
from rigwatch.wire.messages import Column, SampleBlock
from rigwatch.wire.session import SessionWriter, open_session, run_info

MAPPING = ImportMapping(channels={"position": "x[mm]", "force": "u*2[N]"}, time="t[ms]")
Reader = Callable[[bytes], None]
ROWS = 200


def import_readers(folder: Path) -> dict[str, tuple[Reader, tuple[bytes, ...]]]:
    """For each format: imports bytes with columns mapped and as an exported session, examples."""
    made = {
        "csv": (_csv(folder), _exported(folder, ".csv")),
        "mat": (_mat(folder), _exported(folder, ".mat")),
        "parquet": (_parquet(folder), _exported(folder, ".parquet")),
        "json": (json.dumps(_columns()).encode(),),
    }
    return {
        f"import of {ending}": (_reader(folder, ending), examples)
        for ending, examples in made.items()
    }


def _reader(folder: Path, ending: str) -> Reader:
    source, target = folder / f"fuzzed.{ending}", folder / "imported.mcap"

    def read(data: bytes) -> None:
        source.write_bytes(data)
        for mapping in (MAPPING, ImportMapping()):
            target.unlink(missing_ok=True)
            with contextlib.suppress(RigwatchError):
                import_file(source, target, mapping)
        columns_of(source)

    return read


def _columns() -> dict[str, Any]:
    times = np.arange(ROWS) * 4.0
    return {"t": times.tolist(), "x": np.sin(times).tolist(), "u": np.cos(times).tolist()}


def _csv(folder: Path) -> bytes:
    path, columns = folder / "example.csv", _columns()
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path.read_bytes()


def _mat(folder: Path) -> bytes:
    savemat(folder / "example.mat", {k: np.array(v) for k, v in _columns().items()})
    return (folder / "example.mat").read_bytes()


def _parquet(folder: Path) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table(_columns()), folder / "example.parquet")
    return (folder / "example.parquet").read_bytes()


def _exported(folder: Path, ending: str) -> bytes:
    session, target = folder / "exported.mcap", folder / f"exported{ending}"
    if not session.exists():
        index = np.arange(ROWS)
        column = Column("position", "m", np.sin(index), np.zeros(ROWS, np.uint8))
        stamps = 10**18 + index * 3_906_250
        with SessionWriter(session, run_info("bench", 256.0, t_ns=1), sync=False) as writer:
            writer.write(SampleBlock("rig", 7, 0, index * 3906, stamps, (column,)))
    export_session(open_session(session), target)
    return target.read_bytes()
