"""Recordings that do not suit a model: one plain line, and nothing is lost."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigwatch.commands import main
from rigwatch.physics.engine.compile.compiled_system import compile_system
from rigwatch.physics.engine.equations.model import Model
from rigwatch.physics.engine.equations.system import compose
from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.physics.engine.fit.windowed_fit import fit
from rigwatch.wire.errors import ConfigError, ModelError
from rigwatch.wire.exchange.importing import import_file
from rigwatch.wire.exchange.mapping import ImportMapping, parse_map_option
from rigwatch.wire.session import SessionWriter, open_session, run_info, summarise
from rigwatch.wire.typed_files.loading import parse
from rigwatch.workbench.compare.compare import compare
from rigwatch.workbench.data.recorded_columns import read_columns
from rigwatch.workbench.fit.intervals import identifiability
from rigwatch.workbench.study.creation import create
from rigwatch.workbench.study.study import Study, open_study
from rigwatch.workbench.study.study_file import Span
from tests.bus.samples import block
from tests.workbench.machine import studied

MODEL = """
name = "line"
summary = "A force that grows with position."
inputs.position = { unit = "m" }
parameters.k = { value = 1.0, unit = "N/m" }
outputs.force = { unit = "N", expression = "k*position + load" }
ports.load = { kind = "force", unit = "N", variables.x = { expression = "position", unit = "m" } }
"""
LAG = """
name = "lagging"
summary = "A first-order lag."
hold = "zero"
inputs.u = { unit = "V" }
states.x = { unit = "m", derivative = "a*(k*drive - x)", measured = "y" }
parameters.a = { value = 8.0, unit = "1/s" }
parameters.k = { value = 0.8, unit = "m/V" }
outputs.y = { unit = "m", expression = "x" }
ports.drive = { kind = "actuator", signal = "u" }
"""
Table = dict[str, np.ndarray]
Made = Callable[..., Study]


def good(samples: int = 400) -> Table:
    position = np.sin(np.arange(samples) / 9)
    noise = np.random.default_rng(1).normal(size=samples)
    return {"position": position, "force": 3 * position + 0.01 * noise}


@pytest.fixture
def made(tmp_path: Path) -> Made:
    """A study of two recordings."""

    def make(train: Table, held_out: Table, rates: tuple[float, float] = (100.0, 100.0)) -> Study:
        for name, table, rate in zip(("a", "b"), (train, held_out), rates, strict=True):
            session(tmp_path / name, table, rate)
        (tmp_path / "line.toml").write_text(MODEL)
        template = tmp_path / "template.toml"
        template.write_text(
            'model = "line.toml"\n[[train]]\nsession = "a.mcap"\n[[held_out]]\nsession = "b.mcap"\n'
        )
        return create(tmp_path / "study", template)

    return make


def session(path: Path, table: Table, rate: float) -> None:
    lines = [",".join(table)]
    lines += [",".join(f"{v:.9g}" for v in row) for row in zip(*table.values(), strict=True)]
    path.with_suffix(".csv").write_text("\n".join(lines) + "\n")
    units = {"position": "m", "force": "N"}
    channels = dict(parse_map_option(f"{name}={name}[{units[name]}]") for name in table)
    mapping = ImportMapping(channels=channels, rate=rate, flag_missing=True)
    import_file(path.with_suffix(".csv"), path.with_suffix(".mcap"), mapping)


def test_a_good_recording_is_fitted(made: Made) -> None:
    found = compare(made(good(), good()))
    k = found.parameters["k"]
    assert k.interval is not None
    assert k.interval[0] < 3.0 < k.interval[1]
    assert found.held_out_error == pytest.approx(0.01, rel=0.2)


def test_a_profile_agrees_with_the_interval_of_a_straight_line(made: Made) -> None:
    study = made(good(), good())
    plain, profiled = (compare(study, profiled=p).parameters["k"].interval for p in (False, True))
    assert plain is not None
    assert profiled is not None
    assert profiled == pytest.approx(plain, rel=1e-3)


def test_samples_that_are_missing_are_reported_and_left_out(made: Made) -> None:
    broken = good()
    broken["position"][50:60] = np.nan
    broken["force"][200:210] = np.nan
    found = compare(made(broken, good()))
    assert "train: 10 samples without a valid input are not counted" in found.remarks
    assert found.parameters["k"].value == pytest.approx(3.0, rel=0.01)


def test_what_is_simulated_from_an_invented_input_does_not_count(tmp_path: Path) -> None:
    whole = [lagging(seed) for seed in (1, 2)]
    broken = [dict(table, u=np.where(lost(table["u"]), np.nan, table["u"])) for table in whole]
    found = compare(studied(tmp_path, LAG, broken[:1], broken[1:], {"u": "V", "y": "m"}))
    assert found.held_out_error == pytest.approx(1e-3, rel=0.1)
    assert any("nor" in remark and "next initialisation" in remark for remark in found.remarks)


def test_a_recording_of_which_no_window_counts_is_refused(tmp_path: Path) -> None:
    broken = lagging(1)
    broken["u"][::25] = np.nan
    given = (LAG, [broken], [lagging(2)], {"u": "V", "y": "m"})
    with pytest.raises(ModelError, match="train: found 80 samples without a valid input"):
        compare(studied(tmp_path, *given))


def lagging(seed: int, samples: int = 2000) -> Table:
    """A first-order lag of 0.1 s behind a voltage that changes at random, at 100 Hz."""
    generator = np.random.default_rng(seed)
    u = np.repeat(generator.uniform(-1, 1, samples // 10), 10)
    x = np.zeros(samples)
    for k in range(samples - 1):
        x[k + 1] = u[k] + (x[k] - u[k]) * np.exp(-0.1)
    return {"u": u, "y": x + 1e-3 * generator.normal(size=samples)}


def lost(signal: np.ndarray) -> np.ndarray:
    """Three samples of every 200, around a step of the signal."""
    return np.abs(np.arange(len(signal)) % 200 - 110) <= 1


def test_an_input_that_is_mostly_missing_is_refused(made: Made) -> None:
    broken = good()
    broken["position"][:200] = np.nan
    with pytest.raises(ModelError, match="50% of input 'position' missing"):
        compare(made(broken, good()))


def test_a_recording_without_excitation_is_refused(made: Made) -> None:
    still = good() | {"position": np.full(400, 0.3)}
    with pytest.raises(ModelError, match="never change, expected a recording with excitation"):
        compare(made(still, good()))


def test_a_held_out_part_after_the_only_step_says_what_to_record(made: Made) -> None:
    still = good() | {"position": np.ones(400)}
    with pytest.raises(ModelError, match=r"held_out: .* a further log, or one in which"):
        compare(made(good(), still))


def test_rates_that_differ_are_refused(made: Made) -> None:
    with pytest.raises(ModelError, match=r"b.mcap: found 50 Hz, expected 100 Hz"):
        compare(made(good(), good(), (100.0, 50.0)))


def test_a_channel_that_is_not_there_is_named(made: Made) -> None:
    nameless = {"position": good()["position"]}
    with pytest.raises(ModelError, match="found no channel 'force'"):
        compare(made(nameless, good()))


def test_a_study_is_not_written_over(made: Made, tmp_path: Path) -> None:
    study = made(good(), good())
    before = (study.folder / "study.toml").read_bytes()
    with pytest.raises(ConfigError, match="expected a folder without one"):
        create(study.folder, tmp_path / "template.toml")
    assert (study.folder / "study.toml").read_bytes() == before


def test_a_study_is_also_found_by_its_file(made: Made) -> None:
    study = made(good(), good())
    assert open_study(study.folder / "study.toml").folder == study.folder


def test_parameters_that_cannot_be_distinguished_are_named() -> None:
    text = MODEL.replace("k*position", "(k + k2)*position").replace(
        "parameters.k =", 'parameters.k2 = { value = 1.0, unit = "N/m" }\nparameters.k ='
    )
    system = compose(parse(text, Model, "line"))
    table = good()
    recording = Recording(0.01, table["position"][:, None], table["force"][:, None])
    notes = identifiability(fit(compile_system(system), recording, 100))
    assert set(notes) == {"k", "k2"}
    assert "tied to" in notes["k"]


def test_a_parameter_without_influence_is_tied_to_none() -> None:
    text = MODEL.replace("k*position", "k*position + 0*(idle + idler)").replace(
        "parameters.k =",
        'parameters.idle = { value = 1.0, unit = "N" }\n'
        'parameters.idler = { value = 1.0, unit = "N" }\nparameters.k =',
    )
    system = compose(parse(text, Model, "line"))
    table = good()
    recording = Recording(0.01, table["position"][:, None], table["force"][:, None])
    notes = identifiability(fit(compile_system(system), recording, 100))
    assert set(notes) == {"idle", "idler"}
    assert set(notes.values()) == {"has no influence on this recording"}


@pytest.mark.parametrize(
    ("times", "missing"),
    [
        pytest.param([k for k in range(200) if k not in {50, 120, 121}], [50, 120, 121], id="lost"),
        pytest.param([k + 0.2 * np.sin(k) for k in range(200)], [], id="jittered"),
    ],
)
def test_rows_that_are_lost_are_missing_and_jittered_ones_are_not(
    tmp_path: Path, times: list[float], missing: list[int]
) -> None:
    table = "t,y\n" + "".join(f"{10 * t},{t % 7}\n" for t in times)
    (tmp_path / "log.csv").write_text(table)
    given = ["--time", "t[ms]", "--map", "y=y[m]", "--rate", "100"]
    assert main(["import", str(tmp_path / "log.csv"), str(tmp_path / "log.mcap"), *given]) == 0
    found = read_columns(tmp_path, Span(session="log.mcap"))
    assert np.flatnonzero(np.isnan(found.values["y"])).tolist() == missing
    assert bool(found.altered) == (not missing)


@pytest.mark.parametrize("set_by", [-3600.0, 3600.0, 0.7, 0.0])
@pytest.mark.parametrize("lost", [0, 100])
def test_a_clock_that_was_set_in_a_recording_changes_no_rate(
    tmp_path: Path, set_by: float, lost: int
) -> None:
    numbers = [*range(300), *range(300 + lost, 900)]
    with SessionWriter(tmp_path / "log.mcap", run_info("bench", 256.0)) as writer:
        for first in range(0, len(numbers), 100):
            seq = numbers[first]
            was_set = set_by * 1e9 if seq >= 500 else 0.0
            part = block(seq, 100, start_ns=10**18 + round(was_set))
            writer.write(replace(part, channels=part.channels[:1]))
    session = open_session(tmp_path / "log.mcap")
    blocks = list(session.samples())
    assert all((np.diff(one.t_ns) > 0).all() for one in blocks)
    assert len(blocks) == 1 + (lost > 0) + (set_by < 0)
    assert [n for one in blocks for n in range(one.seq, one.seq + len(one))] == numbers
    assert read_columns(tmp_path, Span(session="log.mcap")).dt == pytest.approx(1 / 256, rel=1e-6)
    (device,) = summarise(session).devices
    assert set_by > 0 or device.rate_hz == pytest.approx(256.0, rel=1e-6)
