"""Size of a block of samples as a message, known before it is encoded."""

from dataclasses import dataclass

from rigwatch.wire.messages.blocks import cut
from rigwatch.wire.messages.codec import encode
from rigwatch.wire.messages.message_types import SampleBlock

_NUMBER = 10
"""Longest integer [bytes]: the time of a sample, or a length."""
_READING = 9
"""A value and its quality [bytes]."""


@dataclass(frozen=True, slots=True)
class BlockSize:
    """Largest size of a block: `frame` bytes, and `sample` more for each of its samples."""

    frame: int
    sample: int

    @classmethod
    def of(cls, block: SampleBlock) -> "BlockSize":
        """The size of blocks with the same device and channels."""
        channels = len(block.channels)
        lengths = _NUMBER * (3 * channels + 4)
        return cls(len(encode(cut(block, 0, 0))) + lengths, 2 * _NUMBER + _READING * channels)

    def samples_in(self, size: int) -> int:
        """Number of samples in a message of `size` bytes; at least one."""
        return max(1, (size - self.frame) // self.sample)
