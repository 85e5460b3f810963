"""Every model that ships: it can be read, simulated and takes the effects that suit it."""

import numpy as np
import pytest
from msgspec.structs import replace

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.effect_files import library
from rigwatch.physics.engine.equations.model import shipped_models
from rigwatch.physics.engine.equations.system import Placement, compose
from rigwatch.physics.engine.score.compatibility import suits


@pytest.mark.parametrize("name", sorted(shipped_models()))
def test_a_model_takes_every_effect_that_suits_its_ports(name):
    model = shipped_models()[name]
    places = [
        Placement(effect_name, effect, port)
        for port, place in model.ports.items()
        for effect_name, effect in library().items()
        if suits(effect, place, model)
    ]
    assert places
    for placement in places:
        compose(model, [placement])


def test_every_effect_suits_some_model():
    models = shipped_models().values()
    for name, effect in library().items():
        assert any(suits(effect, p, m) for m in models for p in m.ports.values()), name


def test_the_pneumatic_rig_oscillates_as_its_air_spring_says_and_a_leak_shows():
    model = shipped_models()["servo-pneumatic"]
    whole = compile_system(compose(model, [Placement("leakage", library()["leakage"], "between")]))
    time = np.arange(200) / 256
    voltage = 0.3 * np.sin(2 * np.pi * 3 * time)[:, None]
    balance = 3e5 * 6.788e-5 - 1.01e5 * (6.788e-5 - 5.996e-5)
    first = np.array([[0.0, 0.0, 3e5, balance / 5.996e-5, 0.0, 0.0, 0.0]])
    values = whole.vector({"s0": 0.0})
    run = whole.simulate(
        voltage, 1 / 256, np.array([0]), 200, initial=first, parameters=values, substeps=8
    )
    position, leak = run.outputs[0, :, 0], whole.system.free.index("between_leakage_C")
    assert np.isfinite(run.slopes).all()
    assert 1e-4 < np.ptp(position) < 0.1
    step = 1e-4
    values[list(whole.system.parameters).index("between_leakage_C")] = step
    other = whole.simulate(
        voltage, 1 / 256, np.array([0]), 200, initial=first, parameters=values, substeps=8
    )
    moved = (other.outputs[0, :, 0] - position) / step
    expected = run.slopes[0, :, 0, leak]
    assert np.abs(moved - expected).max() < 0.05 * np.abs(expected).max()


def test_what_the_equations_hold_already_is_no_candidate_there():
    model = shipped_models()["servo-pneumatic"]
    ac_coupled = library()["ac_coupling"]
    assert not suits(ac_coupled, model.ports["acceleration_sensor"], model)
    assert suits(ac_coupled, model.ports["position_sensor"], model)


@pytest.mark.parametrize(
    ("unit", "slides"),
    [("rad/s", True), ("rpm", True), ("mm/s", True), ("V", False), ("K", False), ("m", False)],
)
def test_a_path_follows_from_a_speed_and_from_no_other_variable(unit, slides):
    model = shipped_models()["motor"]
    shaft = model.ports["shaft"]
    port = replace(shaft, variables={"v": replace(shaft.variables["v"], unit=unit)})
    assert suits(library()["bliman_sorine_2"], port, model) == slides
    assert suits(library()["viscous"], port, model)
