"""The blocks of many rigs of a process at once, as tables with a row for each rig.

    lines ──bytes──▶ frames, numbers, stamps ─▶ calibrated, kept, written ─▶ messages
                     one compiled call for all      one for all

The calls around a block of some samples cost ten times what its samples do. A block that simply
follows the last one of its rig passes here through the same compiled functions that serve one rig
alone, called for all rigs together; its bytes on the bus and in the ring are the same. Any other
one is left to the rig's own chain, with nothing of it taken (`lane.py`).
"""

from daq.together.lane import Lane

__all__ = ["Lane"]
