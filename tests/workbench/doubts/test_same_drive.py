"""A sensor's fault is no explanation where another sensor shows another motion."""

from dataclasses import replace

import numpy as np
import pytest

from rigwatch.physics.engine.fit.recording import Recording
from rigwatch.wire.arrays import FloatArray
from rigwatch.workbench.compare.preparation import bench_of
from rigwatch.workbench.data.motion import along_motion
from rigwatch.workbench.data.signals import Data
from rigwatch.workbench.ranking.rank import rank
from rigwatch.workbench.ranking.ranked import Ranked
from rigwatch.workbench.ranking.same_drive import denied_sensors
from rigwatch.workbench.study.study_file import Accepted
from sim_plant.oscillator import RATE, Hidden
from tests.workbench.simulated import (
    COMMON,
    HORIZON,
    knowing,
    multisine,
    recorded,
    size_of,
    study,
)

DRIVE = multisine(np.arange(0.25, 8, 0.25), 4.0, 12.0)
STRONG = (Hidden("coulomb", 4.0),)
SENSORS = {"position_sensor", "acceleration_sensor"}


def data(hidden: tuple[Hidden, ...] = (), drive: FloatArray = DRIVE, gain: float = 1.0) -> Data:
    """The healthy plant under `DRIVE`, and beside it one with a fault under `drive`."""
    noise = 2e-3 * size_of(DRIVE)
    test, held_out = (recorded(drive, hidden, noise, seed) for seed in (1, 2))
    test, held_out = (replace(r, outputs=r.outputs * [gain, 1.0]) for r in (test, held_out))
    return Data(test, held_out, recorded(DRIVE, (), noise, 3), HORIZON, ())


def ranked(of: Data) -> dict[str, Ranked]:
    few = knowing(study(), *COMMON)
    bench = bench_of(few, of, 2e-3 * np.std(of.train.outputs, axis=0))
    return {row.label: row for row in rank(bench.study, bench.data, bench.base, bench.floor)}


def in_loop(gain: float) -> Recording:
    """A drive that holds the position as it is read, with gain, on a mass on a spring."""
    time = np.arange(12 * round(RATE)) / RATE
    wanted = 0.05 * np.sin(2 * np.pi * 0.5 * time) + 0.02 * np.sin(2 * np.pi * 1.25 * time)
    x, v, steps, rows = 0.0, 0.0, 32, []
    for target in wanted:
        force = 400 * (target - gain * x) - 20 * gain * v
        rows.append((force, gain * x, (force - 60 * x - 1.5 * v) / 0.8))
        for _ in range(steps):
            v += (force - 60 * x - 1.5 * v) / 0.8 / (RATE * steps)
            x += v / (RATE * steps)
    table = np.array(rows)
    return Recording(1 / RATE, table[:, :1], table[:, 1:])


@pytest.mark.nightly
def test_faults_of_sensors_that_another_denies_are_not_fitted_and_say_why() -> None:
    rows = ranked(data(STRONG))

    at_sensors = [row for row in rows.values() if row.port in SENSORS]
    assert at_sensors
    assert not any(row.fitted for row in at_sensors)
    assert all("under the same drive" in row.reason for row in at_sensors)
    assert rows["gain@position_sensor"].reason.startswith("acceleration_sensor reads 0.")
    assert rows["coulomb@load"].accepted


@pytest.mark.nightly
@pytest.mark.long
def test_a_sensors_fault_stays_where_the_other_sensor_reads_as_before() -> None:
    of = data(gain=1.7)
    assert set(denied_sensors(study(), of)) == {"acceleration_sensor"}
    assert ranked(of)["gain@position_sensor"].accepted


def test_a_loop_closed_over_the_sensor_changes_the_motion_and_denies_nothing() -> None:
    healthy, faulty = in_loop(1.0), in_loop(1.8)
    ratio = faulty.outputs[:, 1].std() / healthy.outputs[:, 1].std()
    assert ratio < 1 / 1.5
    assert not denied_sensors(study(), Data(faulty, faulty, healthy, HORIZON, ()))


def test_nothing_is_denied_without_the_same_drive_or_beside_other_effects() -> None:
    known = data(STRONG)
    assert set(denied_sensors(study(), known)) == SENSORS
    assert not denied_sensors(study(), replace(known, healthy=None))
    assert not denied_sensors(
        study(), data(STRONG, multisine(np.arange(0.25, 8, 0.25), 4.0, seed=9))
    )
    assert not denied_sensors(study(), data(STRONG, 0.5 * DRIVE))
    assert not denied_sensors(study((Accepted(effect="coulomb", port="load"),)), known)


def test_the_same_drive_is_found_where_it_begins_later() -> None:
    known = data(STRONG)
    assert known.healthy is not None
    begin = 700
    late = Recording(known.healthy.dt, known.healthy.inputs[begin:], known.healthy.outputs[begin:])
    assert set(denied_sensors(study(), replace(known, healthy=late))) == SENSORS


def test_the_sensor_that_drives_a_model_along_the_motion_is_denied_too() -> None:
    of, known = along_motion(study(), data(STRONG))
    assert set(denied_sensors(of, known)) == SENSORS
