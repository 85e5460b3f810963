"""Every error that rigwatch shows to its users, drawn as a tree.

RigwatchError             one plain line, shown by the command line without a traceback
├── ConfigError           a configuration, scenario or model file is wrong
├── WireError             bytes that came from outside do not mean what they should
│   ├── FrameError        a serial frame: framing, length or checksum
│   ├── ModbusError       a Modbus reply: short, late, an exception code, a wrong map
│   └── MessageError      a message on the bus or in a file
├── DeviceError           a device cannot be opened or has gone away
├── BusError              the bus cannot be reached
├── SessionError          a session file cannot be read or written
├── ImportDataError       foreign data cannot be turned into a session (column, unit, rate)
├── ModelError            a model cannot be fitted or does not suit the data
└── MissingExtraError     an optional package is not installed
"""

from pathlib import Path


class RigwatchError(Exception):
    """Base of all errors with a message made for the user: one plain line."""


class ConfigError(RigwatchError):
    """A configuration, scenario or model file is wrong.

    Args:
        file: the file that was read.
        key: dotted path of the key, empty where the whole file is meant.
        found: what stands there.
        expected: what should stand there.
        line: line number in the file, 1 is the first, where it is known.
    """

    def __init__(
        self, file: Path | str, key: str, found: str, expected: str, line: int | None = None
    ) -> None:
        self.file, self.key, self.found, self.expected, self.line = file, key, found, expected, line
        place = f"{file}:{line}" if line else f"{file}"
        where = f"{place}: {key}" if key else place
        super().__init__(f"{where}: found {found}, expected {expected}")


class WireError(RigwatchError):
    """Bytes from outside do not mean what they should."""


class FrameError(WireError):
    """A serial frame with wrong framing, length or checksum."""


class ModbusError(WireError):
    """A Modbus reply that is short, late, an exception, or from another map."""


class MessageError(WireError):
    """A message on the bus or in a file that cannot be decoded."""


class DeviceError(RigwatchError):
    """A device cannot be opened or has gone away."""


class BusError(RigwatchError):
    """The bus cannot be reached or has been closed."""


class SessionError(RigwatchError):
    """A session file cannot be read or written."""


class ImportDataError(RigwatchError):
    """Foreign data cannot be turned into a session."""


class ModelError(RigwatchError):
    """A model cannot be fitted or does not suit the data."""


class MissingExtraError(RigwatchError):
    """An optional package is needed and not installed.

    Args:
        package: the package that is missing.
        extra: the extra of rigwatch that brings it.
        purpose: what it is needed for.
    """

    def __init__(self, package: str, extra: str, purpose: str) -> None:
        super().__init__(
            f"{purpose} needs the package {package}:"
            f" install it with pip install 'rigwatch[{extra}]'"
        )
