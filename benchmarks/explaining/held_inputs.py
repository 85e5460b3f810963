"""Hidden effects where the force is held between samples, as any DAC does, and nobody says so.

The plant and the workbench's task are those of `hidden_effects`. The hold is found from the data.
Digital smoothing and moving averages are hidden, which a sensor's converter or a drive's command
may contain and which at a drive need a held input, the other effects of the plant, and none.

    python -m benchmarks held_inputs --quick
    python -m benchmarks.explaining.held_inputs --results held.jsonl --seed 30
"""

import sys
from collections.abc import Iterator, Sequence

from benchmarks.explaining.hidden import asked, collected, confusion, counted, share_row, wanted
from benchmarks.explaining.hidden_effects import ANALOG, STRONG, Case, Outcome, solve
from sim_plant.oscillator import DIGITAL
from tools.benchmark_table import Row, as_text

SEEDS = range(30, 34)
"""A drive's delay on the first led to a change of the rule for rivals; the others were not run."""
SHARES = (0.02, 0.05, 0.1, 0.01)
SMOOTHED = 0.02
"""Smallest share of an output at which smoothing is to be named."""
HEALTHY = 30
"""Healthy plants for each seed."""


def cases(quick: bool) -> Iterator[Case]:
    """The cases, digital filters first."""
    seeds = SEEDS[:1] if quick else SEEDS
    shares = (0.05,) if quick else SHARES
    for seed in seeds:
        for share in shares:
            yield from (Case((name,), share, seed, held=True) for name in DIGITAL)
        for share in shares:
            yield from (Case((name,), share, seed, held=True) for name in ANALOG)
        for number in range(2 if quick else HEALTHY):
            yield Case((), 0.0, 100 * seed + number, held=True)


def run(quick: bool) -> list[Row]:
    """The benchmark's rows."""
    return rows_of([solve(case) for case in cases(quick)])


def rows_of(outcomes: Sequence[Outcome]) -> list[Row]:
    """Rows from outcomes."""
    hidden = [o for o in outcomes if o.case.hidden]
    digital = [o for o in hidden if o.case.hidden[0] in DIGITAL and o.case.share >= SMOOTHED]
    seen = [o for o in hidden if o.case.hidden[0] not in DIGITAL and o.before >= STRONG]
    healthy = [o for o in outcomes if not o.case.hidden]
    return [
        share_row("force held, hold not given: digital smoothing and moving averages from 2 %, "
                  "named first or in the class", [o.right for o in digital], 0.95,
                  _mistaken(digital)),
        share_row("the same: other effects from 1 % and twice the floor",
                  [o.right for o in seen], 0.97, _mistaken(seen)),
        share_row("the same: healthy not called missing_effect",
                  [o.word != "missing_effect" for o in healthy], 0.99, _mistaken(healthy)),
    ]  # fmt: skip


def _mistaken(outcomes: Sequence[Outcome]) -> str:
    """Wrong names by hidden effect, the most frequent first."""
    return counted(
        f"{'+'.join(o.case.hidden) or 'healthy'} as {o.called}" for o in outcomes if o.wrong
    )


def main() -> int:
    """Run cases into a file, one line each; print their table."""
    chosen = asked(__doc__).parse_args()
    tried = (case for case in cases(quick=False) if wanted(case, chosen))
    found = collected(chosen.results, Outcome, tried, solve, said=_line, minutes=chosen.minutes)
    print(as_text(rows_of(found)))
    print(confusion((o.case.hidden, o.called) for o in found))
    return 0


def _line(o: Outcome) -> str:
    mark = "" if o.right or not o.case.hidden else "MISSED "
    return (
        f"{mark}{'+'.join(o.case.hidden) or 'healthy'} {o.case.share:g} {o.case.seed}: {o.called}"
    )


if __name__ == "__main__":
    sys.exit(main())
