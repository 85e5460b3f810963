"""A command that is held from row to row keeps its effect when uneven rows are put on a grid."""

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.wire.session import open_session
from rigwatch.workbench.steps.from_logs import study_from_logs
from rigwatch.workbench.steps.imported_logs import Logs

RATE, STEP, ROWS = 4.0, 0.05, 900
"""Of a motor that follows its voltage: 1/s, mean step of the log's loop [s], rows."""


@pytest.fixture(scope="module")
def uneven(tmp_path_factory) -> Path:
    """The exact answer y' = 4 (u - y) to voltages that a loop with an uneven clock gives."""
    random = np.random.default_rng(3)
    times = np.concatenate([[0.0], np.cumsum(STEP * (1 + random.uniform(-0.4, 0.4, ROWS - 1)))])
    voltage = np.repeat(random.uniform(-9, 9, ROWS // 6), 6)
    speed = np.zeros(ROWS)
    for row, (u, dt) in enumerate(zip(voltage[:-1], np.diff(times), strict=True)):
        speed[row + 1] = u + (speed[row] - u) * np.exp(-RATE * dt)
    path = tmp_path_factory.mktemp("uneven") / "run.csv"
    table = np.stack([times, voltage, speed], axis=1)
    np.savetxt(path, table, delimiter=",", header="t,voltage (V),speed (rad/s)", comments="")
    return path


def columns(session: Path) -> tuple[np.ndarray, np.ndarray, float]:
    """Voltage, speed and the time between samples."""
    (block,) = open_session(session).samples(size=1 << 30)
    dt = float(block.t_ns[-1] - block.t_ns[0]) * 1e-9 / (len(block) - 1)
    return block.channel("voltage").values, block.channel("speed").values, dt


def error_of(session: Path) -> float:
    """Rms error of the machine's own equation with the voltage held on the grid."""
    voltage, speed, dt = columns(session)
    model = np.zeros(len(speed))
    for k in range(len(speed) - 1):
        model[k + 1] = voltage[k] + (model[k] - voltage[k]) * np.exp(-RATE * dt)
    return float(np.sqrt(np.mean((model - speed) ** 2)))


def test_the_mean_while_held_keeps_the_effect_of_a_command(uneven, tmp_path):
    channels = {"voltage": "voltage (V)[V]", "speed": "speed (rad/s)[rad/s]"}
    mapping = ImportMapping(channels=channels, time="t[s]", any_unit=True)
    import_file(uneven, tmp_path / "line.mcap", mapping)
    import_file(uneven, tmp_path / "held.mcap", structs.replace(mapping, held=("voltage",)))
    by_line = error_of(tmp_path / "line.mcap")
    assert error_of(tmp_path / "held.mcap") < 0.3 * by_line
    study_from_logs(tmp_path / "study", Logs((uneven,), "motor"))
    assert error_of(tmp_path / "study" / "run.mcap") < 0.3 * by_line


def test_a_command_that_stays_is_the_same_number(uneven, tmp_path):
    study_from_logs(tmp_path / "study", Logs((uneven,), "motor"))
    voltage, _, _ = columns(tmp_path / "study" / "run.mcap")
    given = np.unique(np.loadtxt(uneven, delimiter=",", skiprows=1)[:, 1])
    assert 0.5 < np.mean(np.isin(voltage, given)) < 1


@pytest.mark.parametrize(("missing", "told"), [(False, True), (True, False)])
def test_it_is_told_by_what_a_command_is_resampled(tmp_path, missing, told):
    """Of a log that only lacks samples, the others stay as they are, and those are interpolated."""
    times = np.arange(400) * STEP
    times = np.delete(times, [100, 101]) if missing else times + 0.4 * STEP * (np.arange(400) % 2)
    path = tmp_path / "run.csv"
    np.savetxt(path, np.stack([times, times], axis=1), delimiter=",", header="t,u", comments="")
    mapping = ImportMapping(channels={"u": "u[V]"}, time="t[s]", held=("u",))
    notes = open_session(import_file(path, tmp_path / "run.mcap", mapping).path).info.notes
    assert "by linear interpolation" in notes
    assert ("u by means over each step" in notes) == told
