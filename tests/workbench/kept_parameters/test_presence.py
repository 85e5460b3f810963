"""Effects act in recordings in which they are present, and nowhere else."""

import numpy as np
import pytest
from msgspec import structs

from rigwatch.physics.engine.compile.compiled_system import CompiledSystem, compile_system
from rigwatch.physics.engine.equations import PRESENT, Input, Placement, compose, parse_model
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.fit import Recording, with_effects
from rigwatch.physics.engine.score import Candidate, directions, trajectory
from rigwatch.wire.arrays import FloatArray
from tests.workbench.kept_parameters.test_beside_healthy import MODEL

OWN = parse_model(
    MODEL.replace(
        "[ports.load]", 'ports.read = { kind = "sensor", signal = "acceleration" }\n[ports.load]'
    ),
    "slide",
)
SHARED = structs.replace(OWN, inputs=OWN.inputs | {PRESENT: Input(unit="1", constant=True)})
PLACES = (
    ("coulomb", "load"),
    ("maxwell_element", "load"),
    ("dead_band", "drive"),
    ("gain", "drive"),
    ("lag", "read"),
    ("offset", "read"),
)
SAMPLES, SPACING = 200, 1 / 256


def placed(effect: str, port: str) -> Placement:
    return Placement(effect, library()[effect], port)


def drive(present: float | None) -> FloatArray:
    u = 3.0 * np.sin(np.arange(SAMPLES) / 7)[:, None]
    return u if present is None else np.hstack([u, np.full_like(u, present)])


def outputs(model: object, placements: list[Placement], present: float | None) -> FloatArray:
    compiled: CompiledSystem = compile_system(compose(model, placements))
    values = {
        placement.prefix + name: 0.3 if p.role == "strength" else p.value
        for placement in placements
        for name, p in placement.effect.parameters.items()
    }
    run = compiled.simulate(
        drive(present), SPACING, np.zeros(1, np.int64), SAMPLES,
        initial=np.zeros((1, len(compiled.system.states))), parameters=compiled.vector(values),
    )  # fmt: skip
    return run.outputs


@pytest.mark.parametrize("place", [*((one,) for one in PLACES), PLACES], ids=str)
def test_an_effect_acts_where_it_is_present(place: tuple[tuple[str, str], ...]) -> None:
    placements = [placed(*one) for one in place]
    without, acting = (outputs(OWN, some, None) for some in ([], placements))
    assert np.max(np.abs(acting - without)) > 1e-3
    assert outputs(SHARED, placements, 0.0) == pytest.approx(without, abs=1e-9)
    assert outputs(SHARED, placements, 1.0) == pytest.approx(acting, abs=1e-9)


@pytest.mark.parametrize("place", PLACES, ids=str)
def test_a_direction_is_zero_where_the_effect_is_absent(place: tuple[str, str]) -> None:
    effect = library()[place[0]]
    shape = {n: p.value for n, p in effect.parameters.items() if n != effect.strength}
    candidate = Candidate(place[0], effect, place[1], shape)

    def direction(model: object, present: float | None) -> FloatArray:
        compiled = compile_system(compose(model))
        at = trajectory(
            compiled, drive(present), SPACING, np.zeros(1, np.int64), SAMPLES,
            initial=np.zeros((1, 4)), parameters=compiled.parameters,
        )  # fmt: skip
        return directions(at, [candidate])

    everywhere = direction(OWN, None)
    assert np.max(np.abs(everywhere)) > 1e-3
    assert direction(SHARED, 1.0) == pytest.approx(everywhere, abs=1e-12)
    assert not np.any(direction(SHARED, 0.0))


def test_the_part_with_effects_comes_first() -> None:
    inputs = np.vstack([drive(1.0), drive(0.0)])
    both = Recording(SPACING, inputs, np.zeros((2 * SAMPLES, 2)), parts=(SAMPLES, SAMPLES))
    assert np.array_equal(with_effects(SHARED, both).inputs, drive(1.0))
    alone = Recording(SPACING, drive(None), np.zeros((SAMPLES, 2)))
    assert with_effects(OWN, alone) is alone
