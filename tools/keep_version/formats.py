"""The formats of the files that a rig keeps, each as a digest that changes when the format does.

`keeping` stores them beside the files it keeps, and `tests/versions` compares them with those of
the present code: a format that has changed since asks for files of the present version.

Files of TOML and JSON are described by the types that read them: keys, types, bounds and defaults,
without descriptions. Of binary files and messages it is the bytes that their writers write of a
fixed content. What a step of a study adds to the ledger is declared nowhere, and not covered.
"""

import hashlib
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from daq.known_device import Met
from monitor.alarms.record import AlarmRecord
from monitor.model import RigModel
from monitor.model.model_versions import Version
from monitor.process.cursor import Cursor
from rigwatch.archive.tables import ALARM_COLUMNS, LOSS_COLUMNS, SESSION_COLUMNS
from rigwatch.recorder.positions import FILE, PositionFile
from rigwatch.wire.bus import KeptMessages
from rigwatch.wire.bus.kept_messages import BEGIN, END
from rigwatch.wire.messages import TOPICS, encode
from rigwatch.wire.messages.protobuf_schema import file_descriptor_set
from rigwatch.wire.ordering import Numbered
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.session import Session, open_session
from rigwatch.wire.typed_files import as_json
from rigwatch.workbench.study import StudyFile

NAME = "formats.toml"
SENT_HALF = 1024
"""Size of half a file of sent alarms here; a monitor's is larger [bytes]."""
LENGTH = 16
"""Hexadecimal digits of a digest."""
_UNREAD = ("description", "title")
"""Keys of a schema that no reader of a file depends on."""
TYPES: Mapping[str, type] = {
    "configuration": RigConfig,
    "model": RigModel,
    "model_history": Version,
    "alarm_journal": AlarmRecord,
    "known_device": Met,
    "study": StudyFile,
}


def digests(session: Path) -> dict[str, str]:
    """The digest of each format.

    Args:
        session: a recording, any that stays the same: its messages are encoded anew.
    """
    written: dict[str, Callable[[], bytes]] = {
        "messages": lambda: file_descriptor_set() + as_json([_said(topic) for topic in TOPICS]),
        "blocks": lambda: _encoded(open_session(session)),
        "monitor_position": _monitor_position,
        "recorder_positions": _recorder_positions,
        "sent_alarms": _sent_alarms,
        "index": lambda: as_json([SESSION_COLUMNS, ALARM_COLUMNS, LOSS_COLUMNS]),
    }
    found = {name: digest_of(kind) for name, kind in TYPES.items()}
    return found | {name: _digest(write()) for name, write in written.items()}


def digest_of(kind: Any) -> str:
    """The digest of a file that is read as a value of a type."""
    schema = _without_words(msgspec.json.schema(kind))
    return _digest(as_json(schema, sort_keys=True))


def changed(kept: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Names of the formats that differ, those that only one of them has included."""
    return sorted(name for name in {*kept, *now} if kept.get(name) != now.get(name))


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:LENGTH]


def _without_words(schema: Any) -> Any:
    if isinstance(schema, list):
        return [_without_words(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    # A property of such a name holds a schema, and no text.
    unread = {key for key in _UNREAD if isinstance(schema.get(key), str)}
    return {key: _without_words(value) for key, value in schema.items() if key not in unread}


def _said(topic: Any) -> tuple[str, str, bool, bool]:
    return topic.name, topic.message.__name__, topic.recorded, topic.numbered


def _encoded(session: Session) -> bytes:
    """The first message of each topic of a recording, as it would be stored now."""
    first: dict[str, bytes] = {}
    for item in session.messages([topic.name for topic in TOPICS]):
        first.setdefault(type(item.message).__name__, encode(item.message))
    return b"".join(first[name] for name in sorted(first))


def _monitor_position() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "position")
        cursor = Cursor(path)
        cursor.write(5, 7)
        cursor.close()
        return path.read_bytes()


def _sent_alarms() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "said")
        kept = KeptMessages(path, SENT_HALF)
        for number, payload in ((BEGIN, b"a start of the machine"), (0, b"an alarm"), (END, b"")):
            kept.write(Numbered(5, number, payload))
        kept.close()
        return path.read_bytes()


def _recorder_positions() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        kept = PositionFile(Path(folder))
        for number in (7, 8):
            kept.save({"estimates": {"monitor": (5, number)}})
        return Path(folder, FILE).read_bytes()
