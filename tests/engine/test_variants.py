"""Variants of a model: what they replace, what excludes what, and those that ship."""

import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.measured_motion import along_measured_motion
from rigwatch.physics.engine.equations.model import Model, Parameter, Variant, shipped_models
from rigwatch.physics.engine.equations.model_check import check_variants
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.equations.variants import excludes, with_variants
from rigwatch.wire.errors import ModelError

SHIPPED = [(m.name, v) for m in shipped_models().values() for v in m.variants]
RIG = shipped_models()["servo-pneumatic"]


@pytest.mark.parametrize("name", sorted({name for name, _ in SHIPPED}))
def test_every_variant_makes_a_model_that_holds_together(name: str) -> None:
    check_variants(shipped_models()[name])


@pytest.mark.parametrize("variant", RIG.variants)
def test_every_variant_changes_what_is_simulated_along_the_motion(variant: str) -> None:
    plain, other = (
        compose(along_measured_motion(with_variants(RIG, names))) for names in ((), (variant,))
    )
    values = {n: p.value for n, p in other.parameters.items()}
    changed = plain.derivatives != other.derivatives or plain.outputs != other.outputs
    free = [p for p in with_variants(RIG, (variant,)).parameters.values() if p.kept]
    known = [p for p in RIG.parameters.values() if p.kept]
    assert changed or len(free) != len(known)
    assert compile_system(other).vector(values).size == len(values)


def test_variants_of_one_group_or_of_one_part_exclude_each_other() -> None:
    assert excludes(RIG, "isothermal", "adiabatic")
    assert not excludes(RIG, "isothermal", "coupled_twice")
    with pytest.raises(ModelError, match="found variants isothermal and warm_walls, expected one"):
        with_variants(RIG, ("isothermal", "warm_walls"))
    with pytest.raises(ModelError, match="found variant 'none', expected choked_lines"):
        with_variants(RIG, ("none",))


def test_what_a_variant_takes_away_is_gone() -> None:
    found = with_variants(RIG, ("first_order_valve",))
    assert "r" not in found.states
    assert "zeta" not in found.parameters
    assert "r" in RIG.states


def test_a_slip_in_a_variant_is_reported_with_its_name() -> None:
    slip = Variant(physics="None.", parameters={"n": Parameter(value=1.0, unit="Pa", fixed=True)})
    model: Model = replace(RIG, variants={"slip": slip})
    with pytest.raises(ModelError, match=r"variants\.slip: .*"):
        check_variants(model)
