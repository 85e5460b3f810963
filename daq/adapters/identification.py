"""Which device answers on Modbus, by its identification (function 43/14).

A text in the configuration decides; without one, what the device told when it was met first. Many
devices have no identification, and some do not even refuse the question: they are taken as they
are, until one that has told its identity is known.
"""

from collections.abc import Callable, Mapping

from daq.adapter import Known
from daq.adapters.modbus_poll import RefusedError
from rigwatch.wire.errors import ModbusError

Objects = Mapping[int, str]
"""Texts of an identification by the number of their object."""
_REVISION = 2
"""The object with the revision of the firmware, by which a device is not another one."""
LONGEST = 500
"""Characters of an identity."""
_TRIES = 3
"""Questions in a row without an answer after which a device counts as one that tells nothing."""


class NoIdentificationError(RefusedError):
    """The device answers that it has no identification."""


class Identification:
    """Checks which device answers.

    Args:
        ask: asks the device; raises `NoIdentificationError`, or `ModbusError` without an answer.
        wanted: text that it must tell; empty for none.
        where: names the place of the device in errors.

    Attributes:
        known: the rig's device, if it is checked and the configuration names none.
    """

    def __init__(self, ask: Callable[[], Objects], wanted: str, where: str) -> None:
        self.known: Known | None = None
        self._ask, self._wanted, self._where = ask, wanted, where
        self._unanswered = 0

    def check(self) -> None:
        """Check the device that answers now.

        Raises:
            RefusedError: it is another one.
            ModbusError: it does not answer, and one that does is known.
        """
        if self._wanted:
            found = joined(self._ask())
            if self._wanted not in found:
                raise RefusedError(self._another(found, self._wanted))
        elif self.known is not None:
            self._check_known(self.known)

    def _check_known(self, known: Known) -> None:
        try:
            found = self._told()
        except ModbusError:
            self._unanswered += 1
            if not known.expected:
                return
            if self._unanswered < _TRIES:
                raise
            found = ""
        if not known.admits(found):
            raise RefusedError(self._another(found, known.expected))

    def _told(self) -> str:
        """What the device tells; empty if it answers that it has nothing to tell."""
        try:
            objects = self._ask()
        except NoIdentificationError:
            objects = {}
        self._unanswered = 0
        return joined({number: text for number, text in objects.items() if number != _REVISION})

    def _another(self, found: str, wanted: str) -> str:
        told = repr(found) if found else "without identification"
        return f"{self._where}: another device, {told}, expected {wanted!r}"


def joined(objects: Objects) -> str:
    """The texts of an identification on one line, in the order of their numbers."""
    texts = (" ".join(objects[number].split()) for number in sorted(objects))
    whole = ", ".join(text for text in texts if text)
    return "".join(letter if letter.isprintable() else "?" for letter in whole)[:LONGEST]
