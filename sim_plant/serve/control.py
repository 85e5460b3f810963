"""Controls the running plant over a UNIX socket: one line in, one line back.

    set friction=0.4        set an effect at once
    set friction=0.4 over 5 ramp it over 5 seconds
    clear                   remove all effects
    effects                 show the value of every effect
    fault flip 20           a fault of the line for 20 frames (0: until `heal`)
    heal                    end all faults of the line
    restart                 restart the device: new boot, counter 0
    clock +0.5              make the device's clock jump

The answer begins with "ok" or "error".
"""

import contextlib
import os
import socket
import struct
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

from rigwatch.wire.errors import DeviceError, RigwatchError, reason_of

_TIMEOUT = 5.0
_CREDENTIALS = struct.Struct("3i")
"""Process, user and group at the other end of a socket."""
_LONGEST_COMMAND = 200
_IN_MEMORY = "/dev/shm"
Answer = Callable[[str], str]


def control_path(rig: str) -> Path:
    """The socket of the plant of the rig `rig`."""
    return Path(os.environ.get("XDG_RUNTIME_DIR") or _temporary()) / f"rigwatch-{rig}.plant"


def _temporary() -> str:
    try:
        return tempfile.gettempdir()
    except FileNotFoundError:  # the disk is full
        return _IN_MEMORY


def holder(path: Path) -> str:
    """The process that answers at `path`, in words; empty if none does."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(str(path))
        except BlockingIOError:
            return "a process that hangs"  # its queue of connections is full
        except OSError:
            return ""
        found = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    process, _, _ = _CREDENTIALS.unpack(found)
    return f"process {process}{_command(process)}"


def _command(process: int) -> str:
    """Its command line, in brackets; empty if it is not to be seen."""
    with contextlib.suppress(OSError):
        words = Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
        line = " ".join(word.decode(errors="replace") for word in words if word)
        return f" ({line[:_LONGEST_COMMAND]})"
    return ""


def ask(path: Path, line: str) -> str:
    """The running plant's answer to `line`, without its "ok".

    Raises:
        DeviceError: no plant runs there, or it refuses the command.
    """
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as talk:
            talk.settimeout(_TIMEOUT)
            talk.connect(str(path))
            with talk.makefile("rw", encoding="utf-8", newline="\n") as stream:
                stream.write(line + "\n")
                stream.flush()
                answer = stream.readline().strip()
    except OSError as error:
        raise DeviceError(f"no simulated rig answers at {path}: {reason_of(error)}") from error
    status, _, text = answer.partition(" ")
    if status != "ok":
        raise DeviceError(text or "the simulated rig did not answer")
    return text


class ControlServer:
    """Answers lines on a UNIX socket, in a separate thread.

    Args:
        path: the socket; a stale one is replaced.
        answer: the reply to a line; a `RigwatchError` becomes an "error" line.

    Raises:
        DeviceError: another process answers there, or the socket cannot be made.
    """

    def __init__(self, path: Path, answer: Answer) -> None:
        self._path = path
        self._answer = answer
        self._socket: socket.socket | None = None

    def __enter__(self) -> "ControlServer":
        if other := holder(self._path):
            raise DeviceError(
                f"a simulated rig of this name runs already: {other} answers at {self._path};"
                " stop it, or give this rig another rig.id"
            )
        try:
            self._listen()
        except OSError as error:
            self.__exit__()
            raise DeviceError(f"{self._path}: cannot listen here: {reason_of(error)}") from error
        threading.Thread(target=self._serve, name="plant-control", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._socket is not None:
            # Closing alone does not wake a thread blocked in accept().
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()
        with contextlib.suppress(OSError):
            self._path.unlink()

    def _listen(self) -> None:
        self._path.unlink(missing_ok=True)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.bind(str(self._path))
        self._path.chmod(0o600)
        self._socket.listen(4)

    def _serve(self) -> None:
        listener = self._socket
        while listener is not None and listener.fileno() >= 0:
            try:
                talk, _ = listener.accept()
            except OSError:
                return
            threading.Thread(target=self._talk, args=(talk,), daemon=True).start()

    def _talk(self, talk: socket.socket) -> None:
        with contextlib.suppress(OSError), talk, talk.makefile("rw", encoding="utf-8") as stream:
            for line in stream:
                stream.write(self._reply(line.strip()) + "\n")
                stream.flush()

    def _reply(self, line: str) -> str:
        try:
            return f"ok {self._answer(line)}".strip()
        except RigwatchError as error:
            return f"error {error}"
