"""Which kinds of drive and motion are judged."""

import tracemalloc

import numpy as np
import pytest
from msgspec import structs

from monitor.model import RangeSection
from monitor.observer.drives_seen import DRIVE, FARTHEST, MOTION, DrivesSeen, kinds_of
from monitor.observer.spectral_width import Spectrum

N = 64
SINE, SQUARE = 0.77, 1.0
"""Paces of drives at 8 Hz."""
CHIRP = np.geomspace(2.0, 16.0, 10 * N)


def moved(pace: float | np.ndarray, size: float = 3.0, narrow: float = 0.95) -> Spectrum:
    ones = np.ones(np.size(pace)) if np.ndim(pace) else np.ones(N)
    return Spectrum(narrow * ones, pace * ones, size * ones, 0.0 * ones, 0.0 * ones)


def known() -> RangeSection:
    motions = [moved(8.0), moved(8.0, 4.0), moved(CHIRP, 1.0)]
    drives = [np.full(N, SQUARE), np.full(N, SINE), SINE * CHIRP / 8.0]
    paces, frequencies = kinds_of(motions, drives)
    return RangeSection(
        names=("a",), low=(0.0,), high=(1.0,), drive_paces=tuple(paces),
        motion_paces=tuple(frequencies),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("drive", "motion", "judged"),
    [
        (SINE, moved(8.0, 4.5), True),
        (SINE, moved(8.0, 9.0), True),
        (SQUARE, moved(8.0), True),
        (SQUARE, moved(7.2), True),
        (SQUARE, moved(4.0), False),
        (SQUARE, moved(5.5), False),
        (SINE * 5.0 / 8.0, moved(5.0, 1.0), True),
        (SINE * 1.0 / 8.0, moved(1.0), False),
        (SINE * 4.0 / 8.0 * 1.27, moved(4.0, 1.0), True),
        (SQUARE, moved(4.0, narrow=0.5), True),
        (0.0, moved(4.0), True),
    ],
)
def test_motion_is_judged_if_its_kind_was_seen(drive, motion, judged) -> None:
    distance = DrivesSeen(known()).distance(motion, np.full(N, drive))

    assert ((distance <= 1.0) == judged).all()


def test_every_healthy_motion_is_judged() -> None:
    distance = DrivesSeen(known()).distance(moved(CHIRP, 1.0), SINE * CHIRP / 8.0)

    assert (distance < 1.0).all()


def test_model_files_of_earlier_versions_judge_every_kind() -> None:
    old = structs.replace(known(), drive_paces=(), motion_paces=())

    assert not DrivesSeen(old).distance(moved(4.0), np.full(N, SQUARE)).any()


def test_a_long_recording_is_compared_in_little_memory() -> None:
    random = np.random.default_rng(1)
    n, kinds = 50_000, 400
    paces, frequencies = random.uniform(1.0, 20.0, (2, kinds))
    seen = structs.replace(
        known(), drive_paces=tuple(paces.tolist()), motion_paces=tuple(frequencies.tolist())
    )
    drive, pace = random.uniform(0.5, 40.0, (2, n))
    motion = Spectrum(np.ones(n), pace, np.ones(n), np.zeros(n), np.zeros(n))
    tracemalloc.start()
    try:
        found = DrivesSeen(seen).distance(motion, drive)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 40e6  # all pairs at once are 640 MB
    some = slice(0, n, 997)
    own = np.log(np.column_stack([drive, pace]))[some, None]
    away = np.abs(own - np.log(np.column_stack([paces, frequencies])))
    nearest = (away / (DRIVE, MOTION)).max(axis=2).min(axis=1)
    assert found[some].tolist() == np.minimum(nearest, FARTHEST).tolist()
