"""Which command a refusal answers: two operators may ask for the same at the same moment."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TypeVar

from rigwatch.wire.bus.commands.command_check import command_mark
from rigwatch.wire.messages import AlarmCommand, Event

REFUSED = "alarm_command_refused"
_MARK = re.compile(r" [(\[]command [0-9a-f]{16}[)\]]$")
T = TypeVar("T")


def marked(said: Iterable[T], command: AlarmCommand) -> Iterator[T | Event]:
    """The answers to a command as received; a refusal says which one it answers.

    In brackets: a replay refuses it as the monitor did, and skips those with a mark in parentheses,
    whose senders were refused.
    """
    for one in said:
        if isinstance(one, Event) and one.code == REFUSED and not _MARK.search(one.text):
            yield replace(one, text=f"{one.text} [{command_mark(command)}]")
        else:
            yield one


def refusal_of(command: AlarmCommand, said: Iterable[Event]) -> str:
    """Why this command, as it was sent, is refused, without the mark; "" if nothing says so.

    Monitors of earlier versions marked only some refusals: one without a mark may be of any.
    """
    for event in said:
        mark = _MARK.search(event.text)
        if event.code == REFUSED and (mark is None or command_mark(command) in mark[0]):
            return _MARK.sub("", event.text)
    return ""
