"""Which sets of effects the search extends."""

from types import SimpleNamespace
from typing import Any

import pytest

from rigwatch.physics.engine.equations.system import Placement
from rigwatch.workbench.explain.combinations import Combination, _best_in_training, _substitutes
from rigwatch.workbench.ranking.ranked import Ranked


def effect(label: str, alike: tuple[str, ...] = (), family: str = "") -> Ranked:
    name, port = label.split("@")
    unused: Any = SimpleNamespace(family=family)
    return Ranked(Placement(name, unused, port), "force", 0.0, 0.5, {}, list(alike), {}, {})


LAG = effect("lag@pump", ("smoothing@pump", "lag@level"))
SMOOTHING = effect("smoothing@pump", ("lag@pump",))
LEVEL = effect("lag@level", ("lag@pump",))
LIMIT, LEAK = effect("saturation@pump"), effect("leak@tank")


@pytest.mark.parametrize(
    ("level", "extended"),
    [
        ([(LAG,), (SMOOTHING,), (LEVEL,), (LIMIT,)], [(LAG,), (LEVEL,), (LIMIT,)]),
        ([(SMOOTHING, LIMIT), (LIMIT, LAG), (LAG, LEAK)], [(SMOOTHING, LIMIT), (LAG, LEAK)]),
    ],
    ids=["at another port it is another place", "in any order beside the same effect"],
)
def test_of_effects_that_look_alike_at_one_port_the_better_is_extended(
    level: list[tuple[Ranked, ...]], extended: list[tuple[Ranked, ...]]
) -> None:
    sets = [Combination(rows, float(place)) for place, rows in enumerate(level)]
    found = _best_in_training(list(reversed(sets)))
    assert [each.rows for each in found] == extended


def test_an_effect_is_exchanged_for_what_resembles_it_at_any_port_or_is_of_its_family() -> None:
    offset = effect("offset@angle", ("force@shaft", "smoothing@angle"))
    presliding = effect("bliman_sorine@shaft", (), "dry friction")
    coulomb, force = effect("coulomb@shaft", (), "dry friction"), effect("force@shaft")
    smoothing, other = effect("smoothing@angle"), effect("leak@tank")
    every = [other, offset, force, presliding, smoothing, coulomb]
    assert _substitutes(offset, every) == [smoothing, force]
    assert _substitutes(presliding, every) == [coulomb]
    assert _substitutes(other, every) == []
