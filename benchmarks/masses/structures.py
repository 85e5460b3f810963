"""Identification of structures compared with the published tables of W. B. Dunbar's 1999 thesis.

Records of the rows "best method" are made by `sim_plant`, with other equations and finer steps.
Those of the rows "as published" have the thesis's own integrator and step
(`tests/structures/thesis_record.py`).
"""

import resource
import time
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from rigwatch.structures.identification.identify import Identification, identify, solved
from rigwatch.structures.identification.problem import problem_of
from rigwatch.structures.model.checks import load_structure
from rigwatch.structures.model.description import Load, Structure
from rigwatch.structures.model.edit import with_values
from rigwatch.structures.model.matrices import mass_matrix, stiffness_matrix
from rigwatch.structures.records.record import Record
from sim_plant.structure import simulate, with_noise
from tests.structures.extreme import Extreme
from tests.structures.published import NAMES, NOISE, ROWS, Published
from tests.structures.thesis_record import thesis_record
from tools.benchmark_table import Row

FILE = Path(__file__).parents[2] / "configs" / "structures" / "kabe_antenna.toml"
DURATION = 10.0
POSITIONS = [f"x{node}" for node in range(1, 9)]
FOUR_DIGITS = 5e-5


def run(quick: bool) -> list[Row]:
    """Every bar of identification; `quick` takes fewer seeds."""
    rows = [row for published in ROWS for row in _both(published)]
    rows += _noise(5 if quick else 50)
    rows += [*_extreme()]
    return [*rows, *_speed(5 if quick else 30)]


def _both(published: Published) -> list[Row]:
    return [_as_published(published), _best(published)]


def _subject(published: Published) -> Structure:
    loads = {"push": msgspec.convert(published.load, Load)}
    return msgspec.structs.replace(load_structure(FILE), loads=loads)


def _fine(published: Published) -> Record:
    made = simulate(
        FILE, published.h, DURATION, loads={"push": published.load},
        values={"springs.k1_6.cubic": published.true[2]},
    )  # fmt: skip
    return Record(published.h, {name: made.columns[name] for name in POSITIONS})


def _figures(values: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"


def _as_published(published: Published) -> Row:
    subject = _subject(published)
    what = f"{published.where}, quasilinearization as published"
    told = " then ".join(_figures(row) for row in (*published.iterations[:1], *published.end))
    told = told + (" fails" if published.fails else "")
    guess = dict(zip(NAMES, published.guess, strict=True))
    bar = "" if published.fails else "converges; first iteration as published to 2, 2, 10 %"
    record = thesis_record(subject, published)
    try:
        found = identify(
            "quasilinearization", subject, record, NAMES, guess, integrator="dormand-prince"
        )
    except Exception as error:
        return Row(what, "refused", bar, told, str(error), None if published.fails else False)
    note, close = _beside_first(found, published)
    state = "" if found.converged else " no convergence"
    shown = _figures(found.iterations[0]) + " then " + _figures(found.iterations[-1]) + state
    return Row(what, shown, bar, told, note, None if published.fails else found.converged and close)


def _beside_first(found: Identification, published: Published) -> tuple[str, bool]:
    """Difference of the first iteration from the published one, and whether it is small enough."""
    if not published.iterations:
        return "", True
    first = np.array(published.iterations[0])
    off = np.abs(found.iterations[0] - first) / np.abs(first)
    note = "first iteration off by at most {:.2f} %"
    if published.misprint is not None:
        place, why = published.misprint
        off[place], note = 0.0, note + f"; not judged: {why}"
    return note.format(100 * off.max()), bool(np.all(off <= [0.02, 0.02, 0.10]))


def _best(published: Published) -> Row:
    guess = dict(zip(NAMES, published.guess, strict=True))
    found = identify("shooting", _subject(published), _fine(published), NAMES, guess)
    worst = float(np.max(np.abs(found.iterations[-1] / np.array(published.true) - 1.0)))
    return Row(
        f"{published.where}, multiple shooting",
        f"{_figures(found.iterations[-1])}, off by {worst:.0e}, {found.seconds:.1f} s",
        "4 digits",
        "fails" if published.fails else _figures(published.end[-1]),
        "record of sim_plant",
        found.converged and worst < FOUR_DIGITS,
    )


def _noise(seeds: int) -> list[Row]:
    rows = [
        _noisy(share, ("x3", "x6", "x8"), 1, told) for share, told in NOISE.items() if share < 0.5
    ]
    rows.append(
        _noisy(0.5, ("x3", "x6", "x8"), seeds, NOISE[0.5], bar="3 %, 95 % intervals honest")
    )
    rows.append(_noisy(0.5, tuple(POSITIONS), seeds, None))
    return rows


def _noisy(share: float, noisy: tuple[str, ...], seeds: int, told: Any, bar: str = "") -> Row:
    structure, truth = load_structure(FILE), np.array([100.0, 1000.0, 100.0])
    clean = simulate(FILE, 0.01, DURATION)
    errors, covered = [], 0
    for seed in range(seeds):
        made = with_noise(clean, dict.fromkeys(noisy, share), seed)
        found = identify("shooting", structure, Record(0.01, made.columns))
        errors.append(found.iterations[-1] / truth - 1.0)
        intervals = np.array([found.intervals[name] for name in found.names])
        covered += int(((intervals[:, 0] <= truth) & (truth <= intervals[:, 1])).sum())
    worst, held = 100 * np.abs(errors).max(axis=0), covered / (3 * seeds)
    signals = "x3, x6, x8" if len(noisy) == 3 else "all eight positions"
    passed = bool(worst.max() <= 3.0 and held >= 0.9) if bar else None
    return Row(
        f"Table 4.7, {100 * share:.0f} % noise on {signals}, seeds: {seeds}",
        f"worst errors {_figures(worst)} %; {100 * held:.0f} % of intervals hold the truth",
        bar,
        _figures(told) if told else "",
        "five signals without noise are counted by what they are worth" if len(noisy) == 3 else
        "an information limit: the standard deviations say so, too",
        passed,
    )  # fmt: skip


def _extreme() -> list[Row]:
    rows = []
    for noise in (0.0, 0.001):
        case = Extreme(noise=noise)
        found = identify(
            "shooting", case.structure(), case.record(), list(case.truth), case.guesses(),
            partial=True,
        )  # fmt: skip
        errors = {
            name: abs(found.parameters[name] / value - 1) for name, value in case.truth.items()
        }
        seen = {name: e for name, e in errors.items() if name not in found.undetermined}
        worst = max(seen, key=lambda name: seen[name])
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        rows.append(
            Row(
                f"extreme case, {len(case.truth)} unknowns, {100 * noise:g} % noise",
                f"{len(seen)} identified, worst {worst} off by {100 * seen[worst]:.2g} %,"
                f" {found.seconds:.0f} s, {memory:.0f} MB",
                "1 % of each identifiable unknown",
                "given up (48 unknowns, 784 equations)",
                f"not determined: {', '.join(found.undetermined) or 'none'}."
                f" {' '.join(found.remarks)}",
                found.converged and seen[worst] <= 0.01,
            )
        )
    return rows


def _speed(turns: int) -> list[Row]:
    made = simulate(FILE, 0.01, DURATION)
    structure, record = load_structure(FILE), Record(0.01, made.columns)
    problem = problem_of(structure, record)
    best = np.inf
    for _ in range(turns):
        found = solved("quasilinearization", problem)
        best = min(best, found.seconds / len(found.iterations))
    shooting = min(solved("shooting", problem).seconds for _ in range(3))
    seconds, calls, answer = _scipy(structure, record)
    return [
        Row(
            "one iteration, three unknowns, h = 0.01 s, 10 s",
            f"{1e3 * best:.1f} ms",
            "< 10 ms",
            "2.5 s (1999)",
            f"best of {turns}, a whole run shared among its iterations; record prepared before",
            best < 0.010,
        ),
        Row(
            "the same unknowns, whole identification",
            f"{shooting:.2f} s; scipy {seconds:.1f} s",
            "",
            "",
            "multiple shooting beside scipy's least_squares with solve_ivp (RK45, rtol 1e-6) from"
            f" the same guess, which ends at {_figures(answer)} after {calls} simulations",
            None,
        ),
    ]


def _scipy(structure: Structure, record: Record) -> tuple[float, int, Any]:
    """What one would write with SciPy alone."""
    plain = with_values(structure, {"k4_46": 0.0, "k1_6": 0.0})
    base, inverse = stiffness_matrix(plain), 1.0 / np.diag(mass_matrix(structure))
    force, time_ = np.zeros(8), np.arange(len(record)) * record.dt
    force[4] = 1000.0
    between = np.zeros(8)
    between[[3, 5]] = 1.0, -1.0
    measured = np.stack([record.columns[name] for name in POSITIONS])
    calls = 0

    def errors(theta: Any) -> Any:
        nonlocal calls
        calls += 1
        k = base + theta[0] * np.outer(between, between)

        def rates(_: float, state: Any) -> Any:
            x = state[:8]
            pull = k @ x
            pull[5] += theta[1] * x[5] + theta[2] * x[5] ** 3
            return np.concatenate([state[8:], (force - pull) * inverse])

        ran = solve_ivp(rates, (0, time_[-1]), np.zeros(16), t_eval=time_, rtol=1e-6, atol=1e-8)
        return (ran.y[:8] - measured).ravel()

    started = time.perf_counter()
    found = least_squares(
        errors, [50.0, 1300.0, 145.0], x_scale=[100.0, 1000.0, 100.0], max_nfev=20
    )
    return time.perf_counter() - started, calls, found.x
