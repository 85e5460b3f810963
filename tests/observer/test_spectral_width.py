"""How broad a motion's spectrum is; the healthy residual at motions known by it."""

from itertools import pairwise

import numpy as np
import pytest
from msgspec import structs

from monitor.model import BANDS, HealthyLimits, RigModel
from monitor.observer import Extremes, SpectralWidth, Spectrum, UsualError, steady_motion
from monitor.observer.lagged_motion import FIRST, WHOLE
from monitor.pipeline.rig_monitor import RigMonitor
from sim_plant.excitation import Sine
from sim_plant.scenario import Event
from tests.monitor.observed_rig import FAULTS, FREE, RATE, SINE, block, model, raised, run, watched

SLOW = 0.003


def states(n: int) -> np.ndarray:
    code = np.full(n, WHOLE, np.int64)
    code[0] = FIRST
    return code


def noise(n: int) -> np.ndarray:
    """Speed of equal power at all frequencies from 1.5 to 20 Hz [m/s]."""
    rng = np.random.default_rng(1)
    t = np.arange(n) / RATE
    tones = np.linspace(1.5, 20.0, 60)
    phases = rng.uniform(0.0, 2.0 * np.pi, tones.size)
    return 0.02 * np.sin(2.0 * np.pi * tones * t[:, None] + phases).sum(axis=1)


def settled(speed: np.ndarray) -> np.ndarray:
    return SpectralWidth(SLOW, RATE).update(speed, states(speed.size)).narrow[512:]


@pytest.mark.parametrize("frequency", [4.0, 8.0, 16.0])
def test_a_tone_is_narrow(frequency: float) -> None:
    found = settled(0.2 * np.sin(2.0 * np.pi * frequency * np.arange(2048) / RATE))

    assert found.min() > 0.9
    assert found.max() < 1.15


def test_noise_is_broad() -> None:
    assert np.percentile(settled(noise(4096)), 90) < 0.75


def test_rest_is_not_broad() -> None:
    rng = np.random.default_rng(2)

    assert np.all(settled(0.3 * SLOW * rng.standard_normal(2048)) == 1.0)


@pytest.mark.parametrize("frequency", [4.0, 9.6])
def test_pace_of_a_tone_is_its_frequency(frequency: float) -> None:
    speed = 0.2 * np.sin(2.0 * np.pi * frequency * np.arange(2048) / RATE)
    found = SpectralWidth(SLOW, RATE).update(speed, states(speed.size))

    assert found.pace[512:] == pytest.approx(frequency, rel=0.06)
    assert found.size[1024:] == pytest.approx(0.2 * 2.0 * np.pi * frequency / 2**0.5, rel=0.1)


def test_any_cut_gives_the_same_spectrum() -> None:
    speed, code = noise(1000), states(1000)
    whole = SpectralWidth(SLOW, RATE).update(speed, code)
    cut = SpectralWidth(SLOW, RATE)

    parts = [cut.update(speed[a:b], code[a:b]) for a, b in ((0, 1), (1, 300), (300, 1000))]

    for name in whole._fields:
        pieces = [getattr(part, name) for part in parts]
        assert np.array_equal(np.concatenate(pieces), getattr(whole, name)), name


KNOWN, SINE_PACE, TRIANGLE_PACE = 1.5, 0.765, 0.791
SETTLED = 1024


def spectrum(frequency: np.ndarray | float, size: float = 0.2, n: int = 3072) -> Spectrum:
    """Spectrum of a tone; its frequency may change."""
    phase = 2.0 * np.pi * np.cumsum(np.broadcast_to(frequency, n)) / RATE
    return SpectralWidth(SLOW, RATE).update(size * np.sin(phase), states(n))


def limits() -> HealthyLimits:
    """With one steady motion, a tone of 8 Hz."""
    after = Spectrum(*(figure[512:] for figure in spectrum(8.0)))
    known = steady_motion(after, driven(after), Extremes(KNOWN), RATE)
    assert known is not None
    return HealthyLimits(
        noise=1.0, growth=(0.0,), short=1.0, medium=1.0, friction=1.0, sensor_noise=1.0,
        sensor_growth=0.0, sensor=1.0, speed_noise=SLOW,
        steady_paces=(known.pace,), steady_sizes=(known.size,), steady_narrow=(known.narrow,),
        steady_drives=(known.drive,), steady_energies=(known.extremes.lasting,),
    )  # fmt: skip


def driven(seen: Spectrum, pace: float = SINE_PACE) -> np.ndarray:
    return np.full(seen.pace.size, pace)


def usual(seen: Spectrum, pace: float = SINE_PACE) -> np.ndarray:
    return UsualError(limits(), RATE).update(seen, driven(seen, pace), no_drive(seen)).extremes[0]


def no_drive(seen: Spectrum) -> np.ndarray:
    return np.zeros((seen.pace.size, BANDS))


@pytest.mark.parametrize("frequency", [8.0, 8.1])
def test_a_known_motion_has_its_own_limit(frequency: float) -> None:
    assert np.all(usual(spectrum(frequency))[SETTLED:] == KNOWN)


@pytest.mark.parametrize(("frequency", "size"), [(9.0, 0.2), (7.0, 0.2), (8.0, 0.3), (8.0, 0.1)])
def test_another_motion_has_none(frequency: float, size: float) -> None:
    assert np.isinf(usual(spectrum(frequency, size))[SETTLED:]).all()


@pytest.mark.parametrize("ratio", [0.7, 0.85])
def test_a_smaller_motion_of_the_same_kind_leaves_no_more(ratio: float) -> None:
    seen = spectrum(8.0, 0.2 * ratio)
    known = structs.replace(
        limits(), steady_shorts=(3.0,), steady_mediums=(2.0,), steady_frictions=(4.0,),
        steady_onsets=(5.0,),
    )  # fmt: skip

    found = UsualError(known, RATE).update(seen, driven(seen), no_drive(seen)).extremes[:, SETTLED:]

    assert np.isinf(found[0]).all()
    energy = ratio**-2
    np.testing.assert_allclose(found[1], 3.0 * energy, rtol=0.1)
    np.testing.assert_allclose(found[2], 2.0 * energy, rtol=0.1)
    np.testing.assert_allclose(found[3], 4.0 / ratio, rtol=0.1)
    np.testing.assert_allclose(found[4], 5.0 / ratio, rtol=0.1)


def test_a_motion_recorded_at_its_own_size_is_compared_with_that() -> None:
    seen, known = spectrum(8.0), limits()
    larger = {"steady_sizes": (known.steady_sizes[0], 1.3 * known.steady_sizes[0])}
    for name in ("steady_paces", "steady_narrow", "steady_drives", "steady_energies"):
        larger[name] = 2 * getattr(known, name)
    both = structs.replace(known, **larger)

    found = UsualError(both, RATE).update(seen, driven(seen), no_drive(seen)).extremes[0]
    assert np.all(found[SETTLED:] == KNOWN)


@pytest.mark.parametrize(("volts", "expected"), [(1.0, KNOWN), (1.5, np.inf)])
def test_a_larger_motion_leaves_no_more_under_the_drive_that_was_recorded(volts, expected) -> None:
    seen = spectrum(8.0, 0.3)
    bands = np.tile([0.0, 0.1, 0.3, 0.1, 0.0, 0.0, 0.0], (seen.pace.size, 1))
    known = structs.replace(limits(), steady_motion_bands=tuple(bands[0].tolist()))

    found = UsualError(known, RATE).update(seen, driven(seen), volts**2 * bands).extremes[0]

    assert np.all(found[SETTLED:] == expected)


@pytest.mark.parametrize(
    ("size", "volts", "deviates"),
    [(0.2, 1.0, False), (0.185, 1.0, False), (0.17, 1.0, True), (0.24, 1.0, True),
     (0.17, 1.5, False)],
    ids=["same", "nearly", "smaller", "larger", "another drive"],
)  # fmt: skip
def test_a_motion_of_another_size_under_the_recorded_drive_deviates(size, volts, deviates) -> None:
    seen = spectrum(8.0, size)
    bands = np.tile([0.0, 0.1, 0.3, 0.1, 0.0, 0.0, 0.0], (seen.pace.size, 1))
    known = structs.replace(limits(), steady_motion_bands=tuple(bands[0].tolist()))

    found = UsualError(known, RATE).update(seen, driven(seen), volts**2 * bands).response

    assert np.all((found[SETTLED:] > 1.0) == deviates)


DRIFT = np.linspace(0.75, 0.95, 3072)
BANDS_OF_8_HZ = (0.0, 0.1, 0.3, 0.1, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("drift", "volts", "expected"),
    [(DRIFT, 1.0, KNOWN), (DRIFT[::-1], 1.0, KNOWN), (DRIFT, 1.5, np.inf)],
    ids=["same", "otherwise", "another drive"],
)
def test_a_motion_that_drifts_is_known_by_its_drive(drift, volts, expected) -> None:
    seen = spectrum(8.0)
    recorded = Spectrum(DRIFT[512:], 8.5 * DRIFT[512:], *(each[512:] for each in seen[2:]))
    bands = BANDS_OF_8_HZ
    motion = steady_motion(recorded, driven(recorded), Extremes(KNOWN), RATE, bands)
    assert motion is not None
    known = structs.replace(
        limits(), steady_narrow=(motion.narrow,), steady_motion_bands=motion.bands
    )

    energies = volts**2 * np.tile(bands, (seen.pace.size, 1))
    now = seen._replace(narrow=drift, pace=8.5 * drift)
    found = UsualError(known, RATE).update(now, driven(now), energies).extremes[0]

    assert np.all(found[SETTLED:] == expected)


def test_a_motion_that_drifts_under_a_drive_that_is_not_steady_is_none() -> None:
    seen = spectrum(8.0)._replace(narrow=DRIFT)

    assert steady_motion(seen, driven(seen), Extremes(KNOWN), RATE) is None


def test_a_size_may_differ_by_more_where_the_drive_is_faster() -> None:
    seen = spectrum(8.0, 0.175)
    bands = np.tile([0.0, 0.1, 0.3, 0.1, 0.0, 0.0, 0.0], (seen.pace.size, 1))
    known = structs.replace(limits(), steady_motion_bands=tuple(bands[0].tolist()))

    paces = (driven(seen, times * SINE_PACE) for times in (1.0, 1.02))
    same, faster = (UsualError(known, RATE).update(seen, pace, bands).response for pace in paces)

    assert np.all(same[SETTLED:] > 1.0)
    assert np.all(faster[SETTLED:] < 1.0)


def test_a_motion_by_another_drive_has_none() -> None:
    assert np.isinf(usual(spectrum(8.0), TRIANGLE_PACE)[SETTLED:]).all()


def test_a_model_file_without_drives_knows_the_motion_by_any() -> None:
    seen, older = spectrum(8.0), structs.replace(limits(), steady_drives=())

    pace = driven(seen, TRIANGLE_PACE)
    found = UsualError(older, RATE).update(seen, pace, no_drive(seen)).extremes[0]

    assert np.all(found[SETTLED:] == KNOWN)


def test_a_motion_that_changes_has_none() -> None:
    change = 1536
    found = usual(spectrum(np.where(np.arange(3072) < change, 8.0, 11.0)))

    assert np.all(found[SETTLED:change] == KNOWN)
    assert np.isinf(found[change + 64 :]).all()


def test_a_sweep_is_no_steady_motion() -> None:
    seen = spectrum(np.linspace(2.0, 14.0, 3072))

    assert steady_motion(seen, driven(seen), Extremes(KNOWN), RATE) is None


def test_any_cut_gives_the_same_limit() -> None:
    seen = spectrum(np.where(np.arange(3072) < 1536, 8.0, 11.0))
    cut, whole = UsualError(limits(), RATE), usual(seen)

    drive = driven(seen), no_drive(seen)
    parts = [
        cut.update(
            Spectrum(*(figure[a:b] for figure in seen)), *(each[a:b] for each in drive)
        ).extremes[0]
        for a, b in pairwise((0, 1, 9, 1500, 1540, 3072))
    ]

    assert np.array_equal(np.concatenate(parts), whole)


def without_lasting() -> RigModel:
    """The commissioned model as a file of an earlier version gives it."""
    healthy = model().healthy
    assert healthy is not None
    bare = structs.replace(
        healthy, steady_paces=(), steady_sizes=(), steady_narrow=(), steady_drives=(),
        steady_energies=(), steady_motion_bands=(),
        steady_shorts=(), steady_mediums=(), steady_frictions=(), steady_onsets=(),
        steady_skews=(),
    )  # fmt: skip
    return structs.replace(model(), healthy=bare)


@pytest.mark.long
def test_a_small_lasting_fault_is_noticed_at_a_known_motion() -> None:
    drop = run(SINE, 12.0, (Event(at_s=6.0, effect="supply_drop", value=0.008),), seed=31)

    assert not FAULTS & raised(watched(drop, without_lasting())).keys()
    times = raised(watched(drop))
    assert 6.0 <= times["departure"] < 9.0
    assert not times.keys() & {"dry_friction", "stiction"}


@pytest.mark.long
@pytest.mark.parametrize("drive", [SINE, FREE], ids=["locked", "free"])
def test_a_healthy_rig_stays_quiet(drive: Sine) -> None:
    assert not FAULTS & raised(watched(run(drive, 20.0, seed=33))).keys()


@pytest.mark.kernels
@pytest.mark.long
def test_block_sizes_change_no_bit_of_a_small_fault() -> None:
    drop = run(SINE, 9.0, (Event(at_s=5.0, effect="supply_drop", value=0.008),), seed=31)
    whole = watched(drop).estimates.column("deviation").values
    monitor, parts = RigMonitor(model()), []
    for a, b in pairwise((0, 7, 600, 1501, len(drop["voltage"]))):
        found = monitor.update(block(drop, a, b))
        if found is not None:
            parts.append(found.estimates.column("deviation").values)

    assert np.array_equal(np.concatenate(parts), whole)
