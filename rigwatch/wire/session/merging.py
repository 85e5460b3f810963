"""Joins consecutive blocks of pending messages, so that a chunk has few and long ones."""

from collections.abc import Iterable

from rigwatch.wire.messages import (
    AlarmCommand,
    EstimateBlock,
    Message,
    SampleBlock,
    blocks,
    is_of_structure,
)

LARGEST_BLOCK = 4096
"""Most samples per message, which bounds a reader's memory."""
_Runs = dict[tuple[type[Message], str, bool], tuple[list[Message], int]]


def merge_pending(messages: Iterable[Message], largest: int = LARGEST_BLOCK) -> list[Message]:
    """The messages, with consecutive blocks joined up to `largest` samples.

    A joined block takes the position of its first part. Nothing is joined across an operator's
    command, so that the command keeps its position between the samples.
    """
    slots: list[list[Message]] = []
    runs: _Runs = {}
    for message in messages:
        if isinstance(message, SampleBlock | EstimateBlock):
            if len(message):
                _append_block(slots, runs, message, largest)
            continue
        if isinstance(message, AlarmCommand):
            runs.clear()
        slots.append([message])
    return [joined for slot in slots for joined in _joined(slot)]


def by_chunk(messages: list[Message]) -> list[list[Message]]:
    """The messages of a flush by the chunks they are written to.

    Samples stand apart from estimates, which are three times as many bytes, so that who reads only
    samples need not unpack the estimates. Where a command stands between them, all stay together
    and keep their order.
    """
    samples: list[Message] = [item for item in messages if isinstance(item, SampleBlock)]
    rest: list[Message] = [item for item in messages if not isinstance(item, SampleBlock)]
    mixed = samples and any(isinstance(item, EstimateBlock) for item in rest)
    if not mixed or any(isinstance(item, AlarmCommand) for item in rest):
        return [messages]
    return [samples, rest]


def _append_block(
    slots: list[list[Message]],
    runs: _Runs,
    block: SampleBlock | EstimateBlock,
    largest: int,
) -> None:
    # The estimates of a monitor and of a structure stand one after the other, not in turns.
    beside = isinstance(block, EstimateBlock) and is_of_structure(block)
    key = (type(block), block.device, beside)
    slot, length = runs.get(key, ([], 0))
    tail = slot[-1] if slot else None
    fits = length + len(block) <= largest
    if fits and isinstance(tail, SampleBlock | EstimateBlock) and blocks.continues(tail, block):
        slot.append(block)
        runs[key] = (slot, length + len(block))
        return
    slot = [block]
    slots.append(slot)
    runs[key] = (slot, len(block))


def _joined(slot: list[Message]) -> list[Message]:
    head = slot[0]
    if isinstance(head, SampleBlock):
        return list(blocks.pieces(blocks.concatenate(slot), LARGEST_BLOCK))  # type: ignore[type-var]
    if isinstance(head, EstimateBlock):
        return list(blocks.pieces(blocks.concatenate(slot), LARGEST_BLOCK))  # type: ignore[type-var]
    return slot
