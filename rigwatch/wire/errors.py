"""All errors that rigwatch shows to its users, as a tree.

RigwatchError             one plain line, shown by the command line without a traceback
├── ConfigError           a configuration, scenario or model file is wrong
├── WireError             bytes from outside are malformed
│   ├── FrameError        a serial frame: framing, length or checksum
│   ├── ModbusError       a Modbus reply: short, late, an exception code, a wrong register map
│   └── MessageError      a message on the bus or in a file
├── DeviceError           a device cannot be opened or is gone
├── KeysError             keys or certificates are missing
├── BusError              the bus cannot be reached
│   └── NoRouterError     no router has answered yet
├── HeldError             another process keeps it; callers say what it is
├── SessionError          a session file cannot be read or written
├── ImportDataError       foreign data cannot be imported as a session (column, unit, rate)
├── ModelError            a model cannot be fitted or does not match the data
├── BatchError            work over many recordings cannot begin or continue
├── ArchiveError          an archive cannot be read, written or queried
└── MissingExtraError     an optional package is not installed
"""

import difflib
import errno
from collections.abc import Mapping
from pathlib import Path

_KNOWN = {errno.ENOSPC: "no space left on the disk", errno.EROFS: "the disk is read-only"}


LONGEST_TEXT, END_TEXT = 4000, 400
"""Characters of an error's text, and of them those at its end: a file may hold long names."""


class RigwatchError(Exception):
    """Base of all errors whose message is one plain line for the user."""

    def __str__(self) -> str:
        text = super().__str__()
        if len(text) <= LONGEST_TEXT:
            return text
        return f"{text[: LONGEST_TEXT - END_TEXT]} … {text[-END_TEXT:]}"


def one_line(error: BaseException) -> str:
    """What an error of another library says, on one line; its kind if it says nothing."""
    return " ".join(str(error).split()) or type(error).__name__


def line_about(file: Path | str, error: BaseException) -> str:
    """An error on one line that begins with the file that it is about."""
    text = one_line(error)
    return text if text.startswith(str(file)) else f"{file}: {text}"


def reason_of(error: BaseException) -> str:
    """Why, without the file, where the caller's sentence names it."""
    if known := _KNOWN.get(getattr(error, "errno", None) or 0):
        return known
    why = getattr(error, "strerror", None)
    return f"{why[0].lower()}{why[1:]}" if why else one_line(error)


class ConfigError(RigwatchError):
    """A configuration, scenario or model file is wrong.

    Args:
        file: the file that was read.
        key: dotted path of the key, empty for the whole file.
        found: the value found.
        expected: the value expected.
        line: line number in the file, starting at 1, if known.
    """

    def __init__(
        self, file: Path | str, key: str, found: str, expected: str, line: int | None = None
    ) -> None:
        self.file, self.key, self.found, self.expected, self.line = file, key, found, expected, line
        place = f"{file}:{line}" if line else f"{file}"
        where = f"{place}: {key}" if key else place
        super().__init__(f"{where}: found {found}, expected {expected}")


class WireError(RigwatchError):
    """Bytes from outside are malformed."""


class FrameError(WireError):
    """A serial frame with wrong framing, length or checksum."""


class ModbusError(WireError):
    """A Modbus reply that is short, late, an exception, or of another register map."""


class MessageError(WireError):
    """A message on the bus or in a file that cannot be decoded."""


class DeviceError(RigwatchError):
    """A device cannot be opened or is gone."""


class KeysError(RigwatchError):
    """Keys or certificates are missing, or cannot be created."""


class BusError(RigwatchError):
    """The bus cannot be reached or has been closed."""


class NoRouterError(BusError):
    """No router has answered yet; one may later."""


class HeldError(RigwatchError):
    """Another process keeps what only one may keep; the text names that process."""


class SessionError(RigwatchError):
    """A session file cannot be read or written."""


class ImportDataError(RigwatchError):
    """Foreign data cannot be imported as a session."""


class ModelError(RigwatchError):
    """A model cannot be fitted or does not match the data."""


class BatchError(RigwatchError):
    """Work over many recordings that cannot begin or continue."""


class ArchiveError(RigwatchError):
    """An archive that cannot be read, written or queried."""


class MissingExtraError(RigwatchError):
    """A required optional package is not installed.

    Args:
        package: the missing package.
        extra: the extra of rigwatch that includes it.
        purpose: the feature that needs it.
    """

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs the package {package}:"
            f" install it with pip install 'rigwatch[{extra}]'"
        )


def nearest(name: str, known: Mapping[str, object]) -> str:
    """Ending of an error message about `name`: the likely intended name, or all known names."""
    close = " or ".join(map(repr, difflib.get_close_matches(name, known, 3, 0.5)))
    return f"; did you mean {close}?" if close else f", expected one of {', '.join(sorted(known))}"
