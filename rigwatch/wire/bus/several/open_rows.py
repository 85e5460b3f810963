"""Rows that take what simply follows out of joined messages, as their receiver knows them.

They are compiled (`rigwatch.wire.rows`), and only a process that has tables loads the compiler.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from rigwatch.wire.bus.several.joint_message import Part
from rigwatch.wire.messages import Form


@dataclass(frozen=True, eq=False)
class Source:
    """Whose blocks a row takes.

    Attributes:
        sender: identity of the process that sends them.
        device, boot: of which they are.
        suits: whether blocks of such a form can be taken; asked once for each form.
    """

    sender: str
    device: str
    boot: int
    suits: Callable[[Form], bool]

    def is_of(self, form: Form) -> bool:
        """Whether blocks of a form are of this source, and can be taken."""
        return form.device == self.device and form.boot == self.boot and self.suits(form)


class OpenRows(Protocol):
    """All is called under the lock of the receiver that has them."""

    def name(self, row: int, rig: str) -> bool:
        """Give a row to a rig; False if it can have none, or has another one."""

    def open(
        self, rig: str, source: Source, following: int, message: tuple[int, int] | None
    ) -> bool:
        """Take what follows of a rig from now on, if it has a row.

        Args:
            rig: its id.
            source: of its blocks.
            following: number of the next sample.
            message: run and number of the next message, None in a topic that is not numbered.
        """

    def close(self, rig: str) -> None:
        """Take no more of a rig."""

    def take(self, data: bytes, sender: str) -> list[Part]:
        """Take what follows out of a joined message; what is left of it, in order.

        Raises:
            MessageError: these are not the bytes of such a message.
        """
