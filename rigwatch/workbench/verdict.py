"""The verdict: what the ranking means, in one of four words.

`nothing_missing`, `missing_effect`, `undetermined` (rivals of different physics that this recording
cannot tell apart) or `unknown_effect` (the error stays above the noise floor, and no known effect
brings it down). All four are results.

Of effects that do equally well on the recordings held out, the one with the fewest parameters is
named first; the others of its kind form its class.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rigwatch.physics.engine.effect import Effect
from rigwatch.physics.engine.score import ALIKE
from rigwatch.workbench.fitted import Fitted, block_errors
from rigwatch.workbench.noise_floor import NoiseFloor
from rigwatch.workbench.rank import Ranked

Word = Literal["nothing_missing", "missing_effect", "undetermined", "unknown_effect"]
ALLOWED = {"periods": 1.1, "healthy": 1.1, "quiet band": 1.25}
"""Error over noise floor up to which nothing is missing, by how the floor is known."""
EQUAL = 2.0
"""Standard deviations of a paired difference below which two effects do equally well."""
SAME = 0.9995
"""Cosine above which two effects are one, whatever they are called."""
SIMILAR = 0.8
"""Cosine below which two effects that do equally well explain different parts of the error."""
MOST_OF_IT = 0.75
"""Share of a gain that an effect of lower order must have to go first."""
EXPLAINED = 0.9
"""Share of the energy above the floor that known effects must explain, or it is unknown."""


@dataclass(frozen=True)
class Verdict:
    """What is missing.

    Attributes:
        word: one of four.
        best: what is named, None where nothing is.
        members: labels that the best cannot be told from, itself first.
        rivals: labels of other physics that this recording cannot tell from it.
        text: a sentence for people.
        second: labels of what is missing as well, where two effects hide at once.
    """

    word: Word
    best: Ranked | None
    members: tuple[str, ...]
    rivals: tuple[str, ...]
    text: str
    second: tuple[str, ...] = ()


def judge(
    base: Fitted, rows: Sequence[Ranked], effects: Mapping[str, Effect], floor: NoiseFloor
) -> Verdict:
    """The verdict on a ranking; `floor` is of the held-out recordings."""
    accepted = [row for row in rows if row.accepted]
    if not accepted:
        return _nothing_found(base, floor)
    best = _named(accepted, effects)
    equals = [row for row in accepted if row is not best and _equal(best, row)]
    same = {row.label for row in rows if _same_words(best, row, effects)}
    members = [best.label, *(row.label for row in equals if row.label in same)]
    members += [name for name in best.alike if name in same and name not in members]
    rivals = [
        row.label
        for row in rows
        if (row in equals or row.fitted is None)
        and best.cosines.get(row.label, 0.0) > (SIMILAR if row in equals else ALIKE)
        and row.label not in same
        and effects[row.effect].free <= effects[best.effect].free
    ]
    assert best.fitted is not None
    if floor.method != "quiet band" and left_over(base, best.fitted, floor) > 1 - EXPLAINED:
        text = (
            f"the best known effect, {best.label}, leaves much of the error above the noise floor"
        )
        return Verdict("unknown_effect", best, tuple(members), tuple(rivals), text)
    if rivals:
        text = f"{best.label} and {', '.join(rivals)} explain this recording equally well"
        return Verdict("undetermined", best, tuple(members), tuple(rivals), text)
    text = f"{best.label} is missing: the held-out error falls from {base.held_out_error:.3g} to"
    return Verdict("missing_effect", best, tuple(members), (), f"{text} {best.held_out_error:.3g}")


def _same_words(best: Ranked, row: Ranked, effects: Mapping[str, Effect]) -> bool:
    """Whether two effects say the same: of one family, or without any difference to be seen."""
    if row is best or best.cosines.get(row.label, 0.0) > SAME:
        return True
    return bool(effects[best.effect].family) and (
        effects[row.effect].family == effects[best.effect].family
    )


def _nothing_found(base: Fitted, floor: NoiseFloor) -> Verdict:
    ratio = above_floor(base, floor)
    if ratio <= ALLOWED[floor.method]:
        text = f"the held-out error is {ratio:.2f} times the noise floor, and no effect lowers it"
        return Verdict("nothing_missing", None, (), (), text)
    text = f"the held-out error is {ratio:.2f} times the noise floor, and no known effect lowers it"
    return Verdict("unknown_effect", None, (), (), text)


def above_floor(fitted: Fitted, floor: NoiseFloor) -> float:
    """Held-out error over the noise floor, over all channels."""
    return float(np.sqrt(np.mean((fitted.held_out.rms / floor.rms) ** 2)))


def left_over(base: Fitted, best: Fitted, floor: NoiseFloor) -> float:
    """Share of the energy above the floor that is left with better effects."""
    allowed = ALLOWED[floor.method] ** 2
    before, after = above_floor(base, floor) ** 2 - 1, above_floor(best, floor) ** 2
    return max(after - allowed, 0.0) / max(before, 1e-12)


def _named(accepted: Sequence[Ranked], effects: Mapping[str, Effect]) -> Ranked:
    top = min(accepted, key=lambda row: row.held_out_error)
    equals = [row for row in accepted if row is top or _equal(top, row)]
    best = min(equals, key=lambda row: (effects[row.effect].free, row.held_out_error))
    lower = effects[best.effect].refines
    for row in accepted:
        if row.effect == lower and row.gain and best.gain and row.gain > MOST_OF_IT * best.gain:
            return row
    return best


def _equal(one: Ranked, other: Ranked) -> bool:
    assert one.fitted is not None
    assert other.fitted is not None
    difference = block_errors(other.fitted.held_out) - block_errors(one.fitted.held_out)
    spread = difference.std(ddof=1) / np.sqrt(len(difference))
    same = abs(other.held_out_error / one.held_out_error - 1) < 0.005
    return bool(same or abs(difference.mean()) < EQUAL * spread)
