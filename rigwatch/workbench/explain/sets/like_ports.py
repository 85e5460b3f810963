"""The same effect at every port of one kind, as where two sensors of one make lag alike.

Of like parts each causes a share of the error. One effect at one port leaves the shares of the
others, and a search that adds port by port may turn to something else first. Where no effect is
named, those that explain most at one of like ports are therefore put at all of them, one effect
after the other, and judged as any set is: each has to be supported beside the others. What holds is
told with the command that adds it; the verdict's word stands. Where each shows at too few changes
to be determined by itself, one parameter for all of them may be, which only the model's author can
know to be one.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from rigwatch.physics.engine.equations import Model, Port
from rigwatch.physics.engine.score import ALIKE
from rigwatch.wire.errors import ModelError
from rigwatch.workbench.compare import Bench
from rigwatch.workbench.explain.sets.set_gain import SetGain, set_gain
from rigwatch.workbench.explain.sets.several_effects import UNNAMED
from rigwatch.workbench.explain.verdict import Verdict
from rigwatch.workbench.ranking import Progress, Ranked
from rigwatch.workbench.study import told

MOST_PORTS = 4
"""Largest number of like ports; of more, as in a structure, parts seldom change alike."""
MOST_TRIED = 3
"""Largest number of effects that are put at all of their like ports."""
BY_CHANCE = 0.05
"""Probability below which an effect's score at one of the ports is more than chance."""
SAID = (
    "{effect} at {ports} alike takes the held-out error from {before:.4g} to {after:.4g} {unit},"
    " {how}"
)
SUPPORTED = (
    "and each is supported beside the others: rigwatch add {folder} {effect} --port {port} --with"
    " {others}"
)
VAGUE = (
    "but the training determines none by itself: if these parts are of one kind, give the model one"
    " parameter for all of them (docs/models.md, Parts of one kind)"
)


def with_like_ports(
    bench: Bench, rows: Sequence[Ranked], verdict: Verdict, progress: Progress
) -> Verdict:
    """The verdict, with the same effect at like ports in its text if the recordings support that.

    Args:
        bench: the study.
        rows: the ranking of single effects.
        verdict: the verdict on effects and sets of them; one that names an effect is unchanged.
        progress: called with the effects about to be tried.
    """
    found = []
    for alike in _most_alike(bench.study.model, rows) if verdict.word in UNNAMED else []:
        labels = [row.label for row in alike]
        progress(f"fitting {' and '.join(labels)} alike")
        try:
            gain = set_gain(bench, labels[0], labels[1:])
        except ModelError:
            continue
        if not gain.reason or gain.vague:
            found.append((alike, gain))
    if not found:
        return verdict
    alike, gain = min(found, key=lambda each: each[1].held_out_error)
    return replace(verdict, text=f"{verdict.text}; {_text(bench, alike, gain)}")


def like_ports(model: Model) -> list[tuple[str, ...]]:
    """Groups of ports where the same physics may act alike: of one kind, unit and variables."""
    groups: dict[tuple[object, ...], list[str]] = defaultdict(list)
    for name, port in model.ports.items():
        variables = tuple(sorted((key, own.unit) for key, own in port.variables.items()))
        kind = (port.kind, _unit(model, port), variables, port.passive, port.described)
        groups[kind].append(name)
    return [tuple(names) for names in groups.values() if 1 < len(names) <= MOST_PORTS]


def _unit(model: Model, port: Port) -> str:
    """Unit of what enters at a port: its own, or that of its signal."""
    name = port.signal
    signal = model.inputs.get(name) or model.outputs.get(name) or model.quantities.get(name)
    return port.unit or (signal.unit if signal else "")


def _most_alike(model: Model, rows: Sequence[Ranked]) -> list[list[Ranked]]:
    """Effects that explain most at one of like ports, each at all of them.

    A fit at one port orders them, and first-order shares where there is none. Of effects that look
    alike at the port where one shows most, one that acts in continuous time is taken before one
    that acts on samples, and then the one with the fewest parameters.
    """
    left = [each for ports in like_ports(model) for each in _at_each(ports, rows)]
    chosen: list[list[Ranked]] = []
    while left and len(chosen) < MOST_TRIED:
        most = min(left, key=lambda each: _rank_of(each[0]))
        similar = [each for each in left if each is most or _resembles(each, most)]
        chosen.append(min(similar, key=lambda each: (
            each[0].placement.effect.sampled, each[0].free, _rank_of(each[0])
        )))  # fmt: skip
        left = [each for each in left if each not in similar]
    return chosen


def _at_each(ports: Sequence[str], rows: Sequence[Ranked]) -> list[list[Ranked]]:
    """Each effect that is ranked at all of the ports and shows at one: its rows, the best first."""
    found: dict[str, list[Ranked]] = defaultdict(list)
    for row in rows:
        if row.port in ports and not row.failure:
            found[row.effect].append(row)
    whole = [each for each in found.values() if {row.port for row in each} == set(ports)]
    shown = [each for each in whole if min(row.p_value for row in each) < BY_CHANCE]
    return [sorted(each, key=_rank_of) for each in shown]


def _resembles(one: Sequence[Ranked], other: Sequence[Ranked]) -> bool:
    """Whether two effects are at the same ports and look alike where each shows most."""
    same = {row.port for row in one} == {row.port for row in other}
    return same and other[0].cosines.get(one[0].label, 0.0) > ALIKE


def _rank_of(row: Ranked) -> tuple[float, float]:
    """Training error with the effect at its port, then what it explains to first order."""
    return (row.fitted.train_error if row.fitted else math.inf, -row.explained)


def _text(bench: Bench, alike: Sequence[Ranked], gain: SetGain) -> str:
    """The evidence in a sentence, with what to do."""
    unit, first = bench.base.told_in, alike[0]
    how = VAGUE if gain.vague else SUPPORTED.format(
        folder=bench.study.folder, effect=first.effect, port=first.port,
        others=" ".join(gain.others),
    )  # fmt: skip
    return SAID.format(
        effect=first.effect, ports=" and ".join(row.port for row in alike),
        before=bench.base.told_error, after=told(gain.held_out_error, unit), unit=unit, how=how,
    )  # fmt: skip
