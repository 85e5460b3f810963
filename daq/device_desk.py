"""Answers operators which device the rig has, and takes another one when one of them says so."""

import msgspec

from daq.known_device import KnownDevice, named
from rigwatch.wire.bus import (
    DEVICE_KEY,
    DEVICE_RUN_KEY,
    Bus,
    CommandCheck,
    DeviceReply,
    DeviceRequest,
)
from rigwatch.wire.messages import LONGEST_NAME, LONGEST_TEXT
from rigwatch.wire.rig_config import SecuritySection
from rigwatch.wire.typed_files import JsonError, json_value


class DeviceDesk:
    """The requests about one rig's device, answered in threads of the bus.

    Args:
        bus: source of requests.
        known: the rig's device.
        security: section [bus.security].
    """

    def __init__(self, bus: Bus, known: KnownDevice, security: SecuritySection) -> None:
        self._known = known
        self._check = CommandCheck(bus, security, DEVICE_RUN_KEY)
        bus.serve(DEVICE_KEY, self._answer)

    @property
    def counters(self) -> dict[str, float]:
        """Number of requests refused because of their sender or form."""
        return {"commands_refused": float(self._check.refused)}

    def _answer(self, question: bytes) -> list[bytes]:
        reply = self._decided(question) if question else self._reply("")
        return [msgspec.json.encode(reply)]

    def _decided(self, question: bytes) -> DeviceReply:
        try:
            request = json_value(question, DeviceRequest)
        except JsonError as error:
            self._check.refuse()
            return self._reply(f"not a request for a device: {error}")
        verdict = self._check.judge(request)
        if verdict.refusal:
            return self._reply(f"refused: {verdict.refusal}")
        user, why = request.user[:LONGEST_NAME], request.text[:LONGEST_TEXT]
        if failure := self._known.accept(request.identity, user, why, verdict.identity):
            return self._reply(f"nothing changes: {failure}")
        expected = self._known.expected
        return DeviceReply(True, f"the rig's device is {named(expected)} from now on", expected)

    def _reply(self, text: str) -> DeviceReply:
        """How it stands, with a reason why nothing has changed."""
        expected, refused = self._known.expected, self._known.refused
        state = f"the rig's device is {named(expected)}"
        if refused is not None:
            state = f"{named(refused)} is refused, {state}"
        return DeviceReply(False, text or state, expected, refused is not None, refused or "")
