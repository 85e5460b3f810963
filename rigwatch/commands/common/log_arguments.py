"""Options of every command that reads a foreign log."""

import argparse

from rigwatch.commands.common.numbers import POSITIVE


def add_log_columns(parser: argparse.ArgumentParser) -> None:
    """How columns of a log become channels: `map`, `time`, `rate` and `columns`."""
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="CHANNEL=COLUMN[UNIT]",
        help=(
            "a channel, its column and the column's unit, [1] if it has none; a header with a"
            " unit as it stands, 'force=F [kN]'; also COLUMN*FACTOR+OFFSET[UNIT], with the unit of"
            " the result"
        ),
    )
    parser.add_argument("--time", metavar="COLUMN[UNIT]", help="time column")
    parser.add_argument("--rate", type=POSITIVE, metavar="HZ", help="sample rate, without a time")
    parser.add_argument(
        "--columns", metavar="A,B,…", help="column names, if there is no header line"
    )
