"""The device of a rig, known by what it tells of itself: the first one met, until a person says so.

    first connection ──identity──▶ learnt      later: the same ─▶ taken, another ─▶ refused
                                                       └── a person accepts it ─▶ learnt

It is kept in a file beside the alarm journal, as the monitor's position is, with all devices before
it and who accepted each. A file that is damaged is set aside, and the device is learnt anew.
"""

import contextlib
import threading
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import msgspec

from rigwatch.wire.errors import reason_of
from rigwatch.wire.host import replace_file
from rigwatch.wire.messages import Event, Severity
from rigwatch.wire.rig_config import RigConfig
from rigwatch.wire.typed_files import JsonError, json_value

MOST = 100
"""Devices that the file remembers."""
SET_ASIDE = ".set-aside"


class Met(msgspec.Struct, frozen=True):
    """A device that was the rig's from a moment on.

    Attributes:
        identity: what it tells of itself; empty if it tells nothing.
        t_ns: when it was learnt or accepted, Unix time [ns].
        user: who accepted it; empty for the first one, which was learnt.
        why: the reason that this person gave.
        proved: whether the user is proved, as in the alarm journal.
    """

    identity: str
    t_ns: int
    user: str = ""
    why: str = ""
    proved: str = ""


class _Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file: the devices in order, and the CRC-32 of the bytes that describe them."""

    crc: int
    devices: msgspec.Raw


class DamagedError(ValueError):
    """The file is not as it was written."""


def read_devices(path: Path) -> tuple[Met, ...]:
    """The devices in a file, the present one last; none if there is no file.

    Raises:
        DamagedError: it is damaged.
        OSError: it cannot be read.
    """
    try:
        kept = json_value(path.read_bytes(), _Kept)
        devices = json_value(bytes(kept.devices), tuple[Met, ...])
    except FileNotFoundError:
        return ()
    except JsonError as error:
        raise DamagedError(str(error)) from None
    if kept.crc != zlib.crc32(kept.devices) or not devices:
        raise DamagedError("its checksum does not match")
    return devices


def device_file(config: RigConfig) -> Path | None:
    """The file of a rig, beside its alarm journal; None without a journal."""
    journal = config.monitor.journal if config.monitor else ""
    return Path(f"{journal}.device") if journal else None


class KnownDevice:
    """Says whether the device that answers is the rig's; called by several threads.

    Args:
        source: of the events.
        path: the file; None remembers the device for this run only.
        now_ns: Unix time [ns].

    Attributes:
        refused: identity of the device that was refused last, None once the rig's has answered.
    """

    def __init__(
        self, source: str, path: Path | None, now_ns: Callable[[], int] = time.time_ns
    ) -> None:
        self.refused: str | None = None
        self._source, self._path, self._now_ns = source, path, now_ns
        self._lock = threading.Lock()
        self._events: list[Event] = []
        self._devices = self._read()
        self._unkept, self._failure = False, ""

    @property
    def expected(self) -> str:
        """Identity of the rig's device; empty if none is known, or it tells nothing."""
        return self._devices[-1].identity if self._devices else ""

    def admits(self, identity: str) -> bool:
        """Whether a device with this identity is the rig's; the first one that tells one is.

        Args:
            identity: what it tells of itself; empty if it tells nothing.
        """
        with self._lock:
            if not self._devices or (identity and not self.expected):
                self._learn(identity)
            self.refused = None if identity == self.expected else identity
            if self._unkept:
                self._keep_learnt()
            return self.refused is None

    def accept(self, identity: str, user: str, why: str, proved: str) -> str:
        """Take the device that is refused for the rig's, because a person says so.

        Args:
            identity: of the device that is meant.
            user, why, proved: as in `Met`.

        Returns:
            why nothing changes; empty if it is accepted.
        """
        with self._lock:
            if self.refused is None:
                return "no device is refused"
            if self.refused != identity:
                return f"another device answers by now, {named(self.refused)}"
            before, met = self.expected, Met(identity, self._now_ns(), user, why, proved)
            if failure := self._write((*self._devices, met)):
                return failure
            self.refused = None
            text = f"{named(identity)} is the rig's device in place of {named(before)}: "
            text += f"accepted by {user} ({proved})" + (f", {why}" if why else "")
            self._say("warning", "device_accepted", text)
            return ""

    def events(self) -> list[Event]:
        """What has happened since the last call."""
        if not self._events:
            return []
        with self._lock:
            said, self._events = self._events, []
        return said

    def _learn(self, identity: str) -> None:
        self._devices = (*self._devices, Met(identity, self._now_ns()))
        self._unkept = True
        if identity:
            text = f"the rig's device is {named(identity)}; another one in its place is refused"
            self._say("info", "device_learnt", text)

    def _keep_learnt(self) -> None:
        """Write what was learnt; without a file it is known until the process ends."""
        before, self._failure = self._failure, self._write(self._devices)
        self._unkept = bool(self._failure)
        if self._failure not in ("", before):
            text = f"{self._failure}; known until this process ends"
            self._say("warning", "device_not_kept", text)

    def _write(self, devices: tuple[Met, ...]) -> str:
        """Why the devices cannot be kept; empty if they are, and in force."""
        devices = devices[-MOST:]
        if self._path is not None:
            try:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                replace_file(self._path, _content(devices))
            except OSError as error:
                return f"{self._path}: cannot be written: {reason_of(error)}"
        self._devices = devices
        return ""

    def _read(self) -> tuple[Met, ...]:
        if self._path is None:
            return ()
        try:
            return read_devices(self._path)
        except DamagedError as error:
            with contextlib.suppress(OSError):
                self._path.replace(self._path.with_name(self._path.name + SET_ASIDE))
            text = f"{self._path}: damaged and set aside ({error}); the device is learnt anew"
        except OSError as error:
            text = f"{self._path}: cannot be read: {reason_of(error)}; the device is learnt anew"
        self._say("warning", "device_forgotten", text)
        return ()

    def _say(self, severity: Severity, code: str, text: str) -> None:
        self._events.append(Event(self._source, self._now_ns(), severity, code, text))


def named(identity: str) -> str:
    """An identity in a sentence."""
    return repr(identity) if identity else "one that tells no identification"


def _content(devices: tuple[Met, ...]) -> bytes:
    """The bytes of a file."""
    raw = msgspec.json.encode(devices)
    return msgspec.json.encode(_Kept(zlib.crc32(raw), msgspec.Raw(raw)))
