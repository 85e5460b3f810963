"""Signed commands: an operator's side asks for the receivers' runs, a receiver's side verifies.

Without keys the secret of the account signs, and the user's name is not proved.
"""

import contextlib
import hashlib
import threading
from dataclasses import dataclass, fields, replace
from typing import TypeVar

from rigwatch.wire.access import signer_of, verifier_of
from rigwatch.wire.bus.bus import Bus
from rigwatch.wire.bus.commands.device_request import DeviceRequest
from rigwatch.wire.bus.commands.model_request import ModelRequest
from rigwatch.wire.errors import BusError, KeysError
from rigwatch.wire.messages import NOT_PROVED, PROVED, AlarmCommand, Identity, encode
from rigwatch.wire.rig_config import BusSection, SecuritySection

RUN_KEY = "monitor/receiver"
"""Key at which the receivers of commands for monitor and witness tell their runs."""
TIMEOUT = 3.0
"""Longest wait for the receivers' runs [s]."""
AnyCommand = AlarmCommand | ModelRequest | DeviceRequest
Command = TypeVar("Command", AlarmCommand, ModelRequest, DeviceRequest)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a command may be executed.

    Attributes:
        identity: whether its user is proved.
        refusal: why it may not be executed, "" if it may.
    """

    identity: Identity
    refusal: str = ""


class CommandCheck:
    """Verifies the commands that one process receives.

    Args:
        bus: of the process.
        security: section [bus.security].
        run_key: key at which the process tells its run to those who sign.

    Attributes:
        refused: number of commands refused, those included that could not be read.
    """

    def __init__(self, bus: Bus, security: SecuritySection, run_key: str = RUN_KEY) -> None:
        self.refused = 0
        self._counting = threading.Lock()
        self._verifier = verifier_of(security, bus.rig)
        run = self._verifier.run.encode()
        bus.serve(run_key, lambda _: [run])

    def judge(self, command: AnyCommand) -> Verdict:
        """Whether `command` may be executed."""
        try:
            self._verifier.check(command.user, command.proof, _said(command))
        except KeysError as error:
            self.refuse()
            return Verdict(NOT_PROVED, str(error))
        return Verdict(PROVED if self._verifier.proves_user else NOT_PROVED)

    def refuse(self) -> None:
        """Count a refusal; commands come in several threads."""
        with self._counting:
            self.refused += 1


def signed(bus: Bus, command: Command, run_key: str = RUN_KEY) -> Command:
    """The command with the operator's proof; unchanged on a bus without a signer.

    Args:
        bus: of the operator's side.
        command: without a proof.
        run_key: key at which its receivers tell their runs.

    Raises:
        BusError: no receiver answers.
        KeysError: the operator's key or the account's secret cannot be read.
    """
    if bus.signer is None:
        return command
    runs = []
    for reply in bus.query(run_key, timeout=TIMEOUT):
        with contextlib.suppress(UnicodeDecodeError):
            runs.append(reply.decode("ascii"))
    if not runs:
        process = run_key.partition("/")[0]
        raise BusError(f"no {process} of rig {bus.rig} answers: start `rigwatch {process}`")
    return replace(command, proof=bus.signer.sign(bus.rig, tuple(runs), _said(command)))


def command_mark(command: AlarmCommand) -> str:
    """Identifies a recorded command, so that a replay skips those that were refused."""
    return f"command {hashlib.sha256(encode(command)).hexdigest()[:16]}"


def proved_here(bus: BusSection, rig: str, command: AnyCommand) -> Identity:
    """Prove the operator of this machine without a monitor, for a change of files.

    Without keys the permissions of the files decide.

    Raises:
        KeysError: why the operator may not act.
    """
    if not bus.security.keys:
        return NOT_PROVED
    verifier, said = verifier_of(bus.security, rig), _said(command)
    proof = signer_of(bus.security, bus.security.operator).sign(rig, (verifier.run,), said)
    verifier.check(command.user, proof, said)
    return PROVED


def _said(command: AnyCommand) -> tuple[str, ...]:
    """What is signed: the class of the command, then all its fields except the proof."""
    names = [one.name for one in fields(command) if one.name != "proof"]
    return type(command).__name__, *(str(getattr(command, name)) for name in names)
