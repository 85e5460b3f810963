"""The fast lane of a process of several rigs: what simply follows, done for many rigs at once.

    joined samples ─▶ rows ─▶ judged ─▶ joined estimates, rings ─▶ what a ranking needs, positions
                       └▶ anything else: the rig leaves the table, and its own objects go on

A rig is in the table while its samples simply follow, no condition holds at them, and nothing else
happens to it. Its own objects are told what the rows have done when it leaves; until then they are
as they were when it came. All rules are in these objects: the table only knows that nothing that
they decide on has changed.
"""

from monitor.process.table.compiling import compile_table
from monitor.process.table.table import Left, Table, Tables

__all__ = ["Left", "Table", "Tables", "compile_table"]
