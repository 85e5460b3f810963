import numpy as np
import pytest

from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import load_model
from rigwatch.physics.engine.equations.system import compose
from rigwatch.structures.model.checks import check, load_structure
from rigwatch.structures.model.description import Structure
from rigwatch.structures.model.edit import Change, changed, with_unknowns, with_values
from rigwatch.structures.model.matrices import modes, stiffness_matrix
from rigwatch.structures.model.structure_model import port_of, to_model
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.wire.typed_files.loading import parse
from sim_plant.structure import simulate
from tests.structures.antenna import FILE, FOLDER, antenna

TWO = """
name = "two"
summary = "Two masses."
[nodes.a]
mass = {mass}
[nodes.b]
mass = 2.0
[springs.wall]
between = ["{end}"]
stiffness = 30.0
{law}
[springs.link]
between = ["a", "b"]
stiffness = 10.0
quadratic = 3.0
cubic = 4.0
[dampers.oil]
between = ["b"]
damping = 0.5
quadratic = 0.2
cubic = 0.1
[loads.push]
node = "b"
step = 3.0
start = 0.333
[[loads.push.sines]]
amplitude = 2.0
omega = 3.0
phase = 0.5
[loads.shake]
base = true
step = 1.5
"""


def two(mass=1.0, end="a", law=""):
    text = TWO.format(mass=mass, end=end, law=law)
    structure = parse(text, Structure, "two.toml")
    check(structure, "two.toml")
    return structure, text


def test_the_antennas_stiffness_matrix_is_the_published_one():
    k1, k2, k3, k4, k5, k6 = 1000.0, 10.0, 900.0, 100.0, 1.5, 2.0
    published = np.array([
        [k5, -k5, 0, 0, 0, 0, 0, 0],
        [-k5, k1 + k2 + k5, -k2, 0, 0, 0, 0, 0],
        [0, -k2, k1 + k2 + k4, 0, -k4, 0, 0, 0],
        [0, 0, 0, k3 + 2 * k4, -k4, -k4, 0, 0],
        [0, 0, -k4, -k4, k3 + 2 * k4, 0, 0, 0],
        [0, 0, 0, -k4, 0, k1 + k2 + k4 + k6, -k2, -k6],
        [0, 0, 0, 0, 0, -k2, k1 + k2 + k5, -k5],
        [0, 0, 0, 0, 0, -k6, -k5, k5 + k6],
    ])  # fmt: skip
    np.testing.assert_array_equal(stiffness_matrix(antenna()), published)
    assert len(antenna().springs) == 14


@pytest.mark.parametrize(
    "law",
    ["", 'law = "hardening"\nlength = 0.2', 'law = "softening"\nlength = 0.2',
     'law = "gap"\nlength = 0.02'],
)  # fmt: skip
def test_model_and_simulated_structure_move_alike_under_every_law(law, tmp_path):
    structure, text = two(law=law)
    file = tmp_path / "two.toml"
    file.write_text(text)
    made = simulate(file, 0.01, 4.0)
    compiled = compile_system(compose(to_model(structure)))
    run = compiled.simulate(
        np.zeros((401, 0)), 0.01, np.array([0]), 401, initial=np.zeros((1, 4)),
        parameters=compiled.parameters, substeps=20,
    )  # fmt: skip
    for index, name in enumerate(("x_a", "x_b")):
        # The step's start falls between two steps of the model, and a gap closes there.
        np.testing.assert_allclose(run.outputs[0, :, index], made.columns[name], atol=2e-4)


def test_every_spring_is_a_port_with_the_springs_own_signs():
    system = compose(to_model(antenna()))
    compiled = compile_system(system)
    inputs, initial = np.zeros((2, 0)), np.linspace(-0.3, 0.4, 16)[None]
    there = compiled.linearise(
        inputs, 0.01, np.array([0]), 1, initial=initial, parameters=compiled.parameters
    )
    at = list(system.probes).index(f"probe_{port_of('k4_46')}") + compiled.columns
    slope = there.rate_slopes[0, 0, :, at]
    assert slope[list(system.states).index("v4")] == 1.0
    assert slope[list(system.states).index("v6")] == -1.0
    assert np.count_nonzero(slope) == 2


def test_all_shipped_files_load_and_compose():
    for path in sorted(FOLDER.glob("*.toml")):
        has_equations = "[states" in path.read_text()
        model = load_model(path) if has_equations else to_model(load_structure(path))
        assert compose(model).derivatives


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"mass": -1.0}, "nodes.a.mass: found -1 kg, expected a positive mass"),
        ({"mass": 0.0}, "a positive mass"),
        ({"end": "c"}, "springs.wall.between: found node 'c', expected one of a, b"),
        ({"law": 'law = "gap"'}, "springs.wall.length: found 0, expected a positive length"),
    ],
)
def test_what_cannot_stand_is_refused_with_its_key(options, expected):
    with pytest.raises(ConfigError, match=expected.replace("(", r"\(")):
        two(**options)


def test_a_free_rigid_mode_and_a_loose_node_are_named():
    _, text = two()
    free = text.replace('between = ["a"]', 'between = ["b", "a"]')
    with pytest.raises(ConfigError, match="free rigid mode: nodes a, b can drift off together"):
        check(parse(free, Structure, "f"), "f")
    alone = text + "\n[nodes.c]\nmass = 1.0\n"
    with pytest.raises(ConfigError, match=r"nodes\.c: found no spring at this node"):
        check(parse(alone, Structure, "f"), "f")


def test_a_misspelt_key_is_an_error_with_its_line(tmp_path):
    file = tmp_path / "s.toml"
    file.write_text(FILE.read_text().replace("cubic =", "cubical ="))
    with pytest.raises(ConfigError, match="cubical"):
        load_structure(file)


def test_edits_change_what_they_name_and_nothing_else():
    structure = antenna()
    assert with_values(structure, {"k3_4": 850.0}).springs["k3_4"].stiffness.value == 850.0
    assert with_values(structure, {"k3_4": 850.0}).springs["k3_5"] == structure.springs["k3_5"]
    free = compose(
        to_model(with_unknowns(structure, ["m4", "k2_23_cubic"], {"m4": 1.3}), ports=False)
    )
    assert free.free == ("m4", "k2_23_cubic")
    assert free.parameters["m4"].value == 1.3
    with pytest.raises(ModelError, match="found the unknown 'k9_9'"):
        changed(structure, {"k9_9": Change(value=1.0)})


def test_the_slowest_mode_is_below_the_fastest():
    assert modes(antenna()).omega[0] == pytest.approx(30.665, abs=1e-3)
