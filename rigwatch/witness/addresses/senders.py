"""Sends notices to a recipient: a command for each, or Apprise for one or many."""

import contextlib
import json
import logging
import os
import signal
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigwatch.wire.errors import ConfigError, MissingExtraError
from rigwatch.wire.messages import json_fields
from rigwatch.witness.addresses.bounded import Bounded
from rigwatch.witness.addresses.texts import text_of_all
from rigwatch.witness.notices import Notice
from rigwatch.witness.people import RecipientSection

COMMAND_S = 60.0
"""Longest run of a command [s]."""
ADDRESS_S = 30.0
"""Longest attempt to reach an address; its server may send its answer byte by byte for ever [s]."""
Notices = Sequence[Notice]


@dataclass(frozen=True, slots=True)
class Sender:
    """Reaches one recipient.

    Attributes:
        send: sends notices and returns whether they were delivered.
        together: whether it sends several notices as one message.
    """

    send: Callable[[Notices], bool]
    together: bool


def sender_of(recipient: RecipientSection, rig: str, file: Path) -> Sender:
    """The sender for a recipient.

    Args:
        recipient: its entry in the file of people.
        rig: id of the rig, named in messages.
        file: the file of people, for errors.

    Raises:
        ConfigError: the address cannot be used.
        MissingExtraError: it has an address, and apprise is not installed.
    """
    if recipient.command:
        return Sender(lambda some: _run_command(recipient.command, some[0], rig), together=False)
    return Sender(_apprise_sender(recipient, rig, file), together=True)


def _run_command(command: Sequence[str], notice: Notice, rig: str) -> bool:
    alarm = notice.alarm
    with subprocess.Popen(
        [*command, alarm.name, alarm.severity, alarm.cause],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "RIGWATCH_RIG": rig},
        process_group=0,
    ) as process:
        try:
            process.communicate(json.dumps(json_fields(alarm)).encode(), COMMAND_S)
        finally:
            # What hangs is often not the command but what it has started.
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
    return process.returncode == 0


def _apprise_sender(recipient: RecipientSection, rig: str, file: Path) -> Callable[[Notices], bool]:
    try:
        import apprise
    except ImportError:
        raise MissingExtraError("apprise", "notify", "notification by address") from None
    logging.getLogger("apprise").setLevel(logging.CRITICAL)
    # One service alone is called on this thread. Apprise's own are waited for when a process ends.
    service = apprise.Apprise.instantiate(recipient.url)
    if service is None:
        scheme = recipient.url.partition(":")[0]
        found = f"an address {scheme}:… that Apprise cannot use"
        raise ConfigError(
            file, f"recipients.{recipient.name}.url", found, "one such as mailtos://…"
        )
    kinds = {"info": apprise.NotifyType.INFO, "warning": apprise.NotifyType.WARNING}

    def send(notices: Notices) -> bool:
        title, body = text_of_all(notices, rig)
        kind = kinds.get(notices[0].alarm.severity, apprise.NotifyType.FAILURE)
        return bool(service.notify(body, title=title, notify_type=kind))

    return _bounded(send)


def _bounded(send: Callable[[Notices], bool]) -> Callable[[Notices], bool]:
    """The same, ended after a while."""
    bounded = Bounded("notify")

    def within(notices: Notices) -> bool:
        reached: list[bool] = []

        def attempt() -> None:
            with contextlib.suppress(Exception):  # as the plugins of Apprise raise
                reached.append(send(notices))

        bounded.call(attempt, ADDRESS_S)
        return bool(reached and reached[0])

    return within
