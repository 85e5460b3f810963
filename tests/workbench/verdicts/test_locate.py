"""Where a model fails is where the hidden effect acts."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from rigwatch.workbench.compare.location import Region, locate
from rigwatch.workbench.compare.preparation import Bench
from tests.workbench.simulated import multisine, opened

MANY = np.arange(0.25, 6.0, 0.25)
ODD = np.arange(0.5, 6.0, 1.0)
"""Odd multiples of 0.5 Hz: an even nonlinearity answers on even ones, an odd one on odd ones."""


def regions(bench: Bench, view: str, channel: str) -> list[Region]:
    return [r for r in locate(bench) if (r.view, r.channel) == (view, channel)]


def worst(found: list[Region]) -> Region:
    return max(found, key=lambda region: region.rms)


def test_a_dead_band_shows_where_the_force_is_small_or_turns() -> None:
    bench = opened(multisine(MANY, 4.0), "dead_band")
    found = regions(bench, "input", "acceleration")
    assert len(found) == 5
    force = bench.data.train.inputs[:, 0]
    # The fitted gain makes up for large forces; what is lost at small ones stays.
    by_force = sorted(found, key=lambda r: np.abs(force[r.samples]).mean())
    assert by_force[0].rms > by_force[1].rms
    assert worst(found) in (by_force[0], by_force[-1])


def test_a_hard_stop_shows_at_the_ends_of_the_travel() -> None:
    bench = opened(multisine(MANY, 5.0), "hard_stop")
    found = regions(bench, "amplitude", "acceleration")
    place = bench.data.train.outputs[:, 0]
    assert np.abs(place[worst(found).samples]).min() > 0.5 * np.abs(place).max()
    assert worst(found).p_value < 0.05
    inner = min(found, key=lambda r: np.abs(place[r.samples]).mean())
    assert worst(found).rms > 2 * inner.rms


@pytest.mark.parametrize(
    ("hidden", "lines"), [("cubic_stiffness", "odd"), ("quadratic_stiffness", "even")]
)
def test_a_nonlinearity_answers_on_its_own_kind_of_lines(hidden: str, lines: str) -> None:
    bench = opened(multisine(ODD, 5.0), hidden, 0.03)
    found = {r.name: r for r in regions(bench, "lines", "position")}
    assert found[f"{lines} multiples"].share > 0.8


@pytest.mark.kernels
def test_dry_friction_changes_sides_with_the_direction() -> None:
    bench = opened(multisine(MANY, 4.0), "coulomb")
    found = {r.name: r for r in regions(bench, "direction", "acceleration")}
    assert found["forward"].mean * found["backward"].mean < 0


def test_a_healthy_plant_fails_nowhere() -> None:
    found = locate(opened(multisine(MANY, 4.0)))
    assert all(r.p_value > 1e-4 for r in found if r.view in ("time", "motion", "amplitude"))


def test_pieces_of_a_part_hours_behind_the_beginning_stay_apart() -> None:
    bench = opened(multisine(MANY, 4.0))
    file = bench.study.file
    late = structs.replace(file, train=(structs.replace(file.train[0], start=40000.0),))
    at_first, found = (
        regions(one, "time", "position")
        for one in (bench, replace(bench, study=replace(bench.study, file=late)))
    )
    assert [len(r.samples) for r in found] == [len(r.samples) for r in at_first]
    assert {r.name.partition(" to ")[0] for r in found} >= {"40000", "40005"}
