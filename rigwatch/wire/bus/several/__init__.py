"""The messages of a process of several rigs, sent together and those of a topic as one.

    daq of many rigs ──┬── joined/daq/samples ──▶ monitor, recorder of many rigs
                       └── rig/a/daq/samples ───▶ dashboard of rig a, if there is one
    daq of rig b ──────┬── rig/b/daq/samples ───▶ monitor, recorder of rig b
                       └── rig/b/daq/samples/alone ▶ monitor of many rigs, if there is one

A message costs sender, router and receiver far more than its bytes. So a process of several rigs
sends those of a moment as one, which only processes of several rigs receive. Whoever follows one
rig listens at the rig's own key, where such a process sends as long as somebody is there.

Blocks of samples that simply follow are taken out of a joined message for all rigs at once
by open rows, and their estimates written into one (`rigwatch.wire.rows`).
"""

from rigwatch.wire.bus.several.joint_link import JointLink
from rigwatch.wire.bus.several.joint_message import MOST_PARTS, Part, join, split
from rigwatch.wire.bus.several.joint_receiver import (
    WAITING,
    Following,
    JointReceiver,
    Received,
    Share,
)
from rigwatch.wire.bus.several.joint_sender import LARGEST, Alone, Among, alone_key
from rigwatch.wire.bus.several.open_rows import Source

__all__ = [
    "LARGEST",
    "MOST_PARTS",
    "WAITING",
    "Alone",
    "Among",
    "Following",
    "JointLink",
    "JointReceiver",
    "Part",
    "Received",
    "Share",
    "Source",
    "alone_key",
    "join",
    "split",
]
