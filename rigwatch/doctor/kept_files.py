"""The files that a rig's processes keep, each read by the code of the process that keeps it.

configuration   every process      a value that an earlier version took and this one refuses
model           monitor            keys that have come since it was written
journal         monitor            the same, and lines that were torn
position        monitor            damaged, or beyond what a device can have sent
alarms sent   monitor, witness   damaged; the alarm of the witness that stands
device          daq                damaged
positions       recorder           damaged
session         recorder           segments without an end, of a recorder that was killed
unfinished      every process      what a process that was killed had begun to write
"""

import os
import re
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from functools import partial
from glob import escape
from pathlib import Path

from daq.known_device import DamagedError, device_file, read_devices
from monitor.alarms import journal_text, read_journal
from monitor.detectors import detectors_of
from monitor.model import model_text, model_versions
from monitor.process import stored_position, suitable_model
from rigwatch.doctor.kept import Kept
from rigwatch.doctor.kept_alarms import MONITOR, WITNESS, kept_alarms
from rigwatch.recorder import POSITIONS, load_positions, sessions_of
from rigwatch.wire.delivery import LARGEST_SEQ
from rigwatch.wire.errors import ConfigError, RigwatchError, reason_of
from rigwatch.wire.host import replace_file
from rigwatch.wire.new_file import PART, left_behind, new_file
from rigwatch.wire.rig_config import RigConfig, load_rig
from rigwatch.wire.session import SUFFIX, Session, open_session, recover
from rigwatch.wire.typed_files import loads, read_text

_NEW_FORM = "write it in the form of this version"
_ASIDE = "set it aside; its process begins anew with the newest sample"


def kept_configuration(path: Path) -> Kept:
    """The configuration: the silence that earlier versions took at any rate may be too short."""
    try:
        config = load_rig(path)
    except ConfigError as error:
        file, (section, _, key) = Path(error.file), error.key.partition(".")
        if key != "stale_after" or not section.isalpha():
            return Kept("configuration", path, str(error), "fail")
        text = read_text(file)
        table = re.compile(rf"(?ms)(^\s*\[{section}\](?:(?!^\s*\[).)*?)^\s*{key}\s*=[^\n]*\n?")
        change = f"remove {error.key}: three periods or polls of the device count then"
        mend = partial(replace_file, file, table.sub(r"\1", text, count=1))
        found = str(error).removeprefix(f"{file}: ")
        return Kept("configuration", file, found, "fail", change, mend)
    return Kept("configuration", path, f"rig {config.rig.id}")


def kept_files(config: RigConfig, path: Path) -> Iterator[Kept]:
    """All files that the processes of a valid configuration at `path` keep and read."""
    if config.monitor is not None:
        yield _model(config, path)
        if config.monitor.journal:
            journal = Path(config.monitor.journal)
            yield from _journal(journal)
            yield from _position(journal.with_name(f"{journal.name}.position"))
            yield from kept_alarms(config.monitor.journal)
    if file := device_file(config):
        yield from _device(file)
    if config.recorder is not None:
        yield from _recordings(Path(config.recorder.folder), config.rig.id)
    yield from _unfinished(config, path)


def in_use(config: RigConfig) -> Iterator[Path]:
    """The files that a running process of the rig has open."""
    if config.monitor is not None and config.monitor.journal:
        names = ("{}", MONITOR, WITNESS)
        yield from (Path(name.format(config.monitor.journal)) for name in names)
    if config.recorder is not None:
        for folder in sessions_of(Path(config.recorder.folder), config.rig.id):
            yield from folder.glob(f"*{SUFFIX}")


def _model(config: RigConfig, path: Path) -> Kept:
    assert config.monitor is not None
    file = Path(config.monitor.model)
    try:
        model = suitable_model(config, path)
        detectors_of(config.monitor.detectors, model, path)
    except RigwatchError as error:
        text = str(error).removeprefix(f"{file}: ")
        remedy = "make it with rigwatch commission, or correct monitor.model"
        return Kept("model", file, text, "fail", remedy=remedy)
    form = model_text(model)
    before, now = loads(read_text(file)), loads(form)
    if before == now:
        return Kept("model", file, "of this version")
    younger = ", ".join(sorted(_paths(now) - _paths(before))) or "another form"
    text = f"of an earlier version, without {younger}"
    mend = partial(model_versions.rewrite, file, form, time.time_ns())
    return Kept("model", file, text, "warn", _NEW_FORM, mend)


def _paths(tree: object, above: str = "") -> set[str]:
    """Dotted paths of all keys of a tree."""
    if isinstance(tree, list):
        return set().union(*(_paths(item, above) for item in tree if isinstance(item, dict)))
    if not isinstance(tree, dict):
        return set()
    here = {f"{above}{key}" for key in tree}
    return here.union(*(_paths(value, f"{above}{key}.") for key, value in tree.items()))


def _journal(path: Path) -> Iterator[Kept]:
    if not path.is_file():
        return
    try:
        records, unread = read_journal(path)
    except RigwatchError as error:
        yield Kept("journal", path, str(error), "fail")
        return
    text, form = f"{len(records)} records", journal_text(records)
    if path.read_bytes() == form:
        yield Kept("journal", path, text)
        return
    if unread:
        text = f"{text}, {unread} lines that cannot be read"
    else:
        text = f"{text} of an earlier version"
    yield Kept("journal", path, text, "warn", _NEW_FORM, partial(replace_file, path, form))


def _position(path: Path) -> Iterator[Kept]:
    if not path.is_file():
        return
    data = path.read_bytes()
    found = stored_position(data)
    if found and -1 <= found[1] <= LARGEST_SEQ:
        yield Kept("position", path, f"sample {found[1]} of boot {found[0]}")
    elif not data.strip(b"\0"):
        yield Kept("position", path, "none yet")
    else:
        yield Kept("position", path, "it is damaged", "warn", _ASIDE, path.unlink)


def _device(path: Path) -> Iterator[Kept]:
    """The device that daq has met; a file that is set aside lets it learn one anew."""
    try:
        devices = read_devices(path)
    except DamagedError:
        change = "set it aside; the device that answers next is learnt"
        yield Kept("device known", path, "it is damaged", "warn", change, path.unlink)
    except OSError as error:
        yield Kept("device known", path, reason_of(error), "fail")
    else:
        if devices:
            last = devices[-1]
            day = datetime.fromtimestamp(last.t_ns / 1e9, UTC).strftime("%Y-%m-%d")
            how = f"accepted by {last.user}" if last.user else "as first met"
            told = repr(last.identity) if last.identity else "tells no identification"
            yield Kept("device known", path, f"{told}, {how} on {day}")


def _recordings(root: Path, rig: str) -> Iterator[Kept]:
    folders = sorted(sessions_of(root, rig)) if root.is_dir() else []
    sound = 0
    for folder in folders:
        wrong = [*_positions(folder), *_segments(folder, is_last=folder == folders[-1])]
        yield from wrong
        sound += not wrong
    yield Kept("sessions", root, f"{sound} of {len(folders)} sessions of {rig} need nothing")


def _positions(folder: Path) -> Iterator[Kept]:
    files = [file for name in POSITIONS if (file := folder / name).is_file()]
    if files and not load_positions(folder):
        yield Kept("positions", files[0], "it is damaged", "warn", _ASIDE, files[0].unlink)


def _segments(folder: Path, *, is_last: bool) -> Iterator[Kept]:
    """Segments that were never closed, without that which a recorder goes on from."""
    segments = tuple(sorted(folder.glob(f"*{SUFFIX}")))
    for path in Session(folder, segments).unclosed:
        if is_last and path == segments[-1]:
            continue
        try:
            session = open_session(path)
        except RigwatchError as error:
            text = str(error).removeprefix(f"{path}: ")
            yield Kept("session", path, text, "warn", "set it aside", path.unlink)
            continue
        change = "write all that is intact, with an index"
        yield Kept("session", path, "it was never closed", "warn", change, partial(_close, session))


def _unfinished(config: RigConfig, path: Path) -> Iterator[Kept]:
    """Files that a killed process has begun beside those of the rig."""
    for folder, names in _places(config, path):
        for part in left_behind(folder, f"{names}*{PART}"):
            size = part.stat().st_size / 1e6
            text = f"{size:.1f} MB that a process wrote which is gone; its file is as it was before"
            yield Kept("unfinished", part, text, "warn", "remove it", part.unlink, backup=False)


def _places(config: RigConfig, path: Path) -> Iterator[tuple[Path, str]]:
    """Folders in which the processes write, and how the names of their files begin there."""
    files = [path]
    if config.monitor is not None:
        files += [Path(config.monitor.model).with_suffix(""), Path(config.monitor.journal)]
    if config.witness is not None:
        files.append(Path(config.witness.heartbeat_file))
    yield from ((file.parent, escape(file.name)) for file in files if file.name)
    if config.recorder is not None:
        yield from (
            (folder, "") for folder in sessions_of(Path(config.recorder.folder), config.rig.id)
        )


def _close(session: Session) -> None:
    written = session.path.stat()
    with new_file(session.path, replace=True) as part:
        recover(session, part)
        # By its time a recording is the newest, or has expired.
        os.utime(part, ns=(written.st_atime_ns, written.st_mtime_ns))
