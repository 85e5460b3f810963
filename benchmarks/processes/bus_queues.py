"""Rigs, routers and processes as queues: what waits where, at 10 000 rigs, with measured costs.

    rig ─30 ms─▶ daq ─▶ router ─▶ monitor ─▶ router ─▶ subscriber
                           └──▶ recorder ◀────┘

Every station takes one thing at a time, in the order of arrival, and needs the processor time that
`Costs` states; a monitor takes turns as the real one does: all that has come from a rig is one
block. Nothing else delays: neither other load on the machine nor the network. The smallest case is
one that was measured on a real bus. `python -m benchmarks.processes.bus_queues FILE.png` also draws
the answers.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numba import njit

from benchmarks.archives.recordings import RATE
from rigwatch.wire.arrays import FloatArray, IntArray
from tools.benchmark_table import Row, as_text

BLOCK = 0.03
"""Time from one block of a rig to the next, of daq of several rigs [s]."""
TURN = 0.005
"""Time from one turn of the monitor to the next, unless it takes longer [s]."""
LIMIT = 0.05
"""Bar of the 99 % of the time from a sample's sending to its estimate's receipt [s]."""
SECONDS, SETTLE = 6.0, 2.0
"""Simulated time, and what of it is not counted [s]."""
BYTES = 53 + 203
"""Of a sample and of its estimates on the bus, in blocks of eight [bytes]."""


@dataclass(frozen=True, slots=True)
class Costs:
    """Processor time [s] of each station: `python -m benchmarks.processes.many_rigs_chain 16 30`.

    Attributes:
        daq: a block read, conditioned and published.
        router: a message handed to its subscribers.
        turn: a block judged, apart from its samples.
        sample: a sample judged.
        recorder: a block of samples and its estimates written.
        spread: deviation of each, as a share.
    """

    daq: float = 0.63e-3
    router: float = 0.24e-3
    turn: float = 1.08e-3
    sample: float = 2e-6
    recorder: float = 0.45e-3
    spread: float = 0.5


@dataclass(frozen=True, slots=True)
class Plan:
    """How many rigs share what.

    Attributes:
        rigs: in all.
        together: rigs of one daq, monitor and recorder.
        site: rigs of one router.
        threads: of a router that work at the same time.
    """

    rigs: int
    together: int
    site: int
    threads: int = 2


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of a plan.

    Attributes:
        p50, p99: from a sample's sending to the receipt of its estimate [s].
        busy: share of time that the stations of each kind work.
    """

    p50: float
    p99: float
    busy: dict[str, float]


def simulate(plan: Plan, costs: Costs, seed: int = 0) -> Answer:
    """Simulate a plan; one site, since sites do not wait for each other."""
    rng = np.random.default_rng(seed)
    rigs = min(plan.site, plan.rigs)
    blocks = round(SECONDS / BLOCK)
    began = rng.uniform(0.0, BLOCK, rigs)
    due = (began[:, None] + BLOCK * np.arange(1, blocks + 1)).ravel()
    rig = np.repeat(np.arange(rigs), blocks)
    process = rig // plan.together
    sent = _each(due, process, _drawn(rng, costs.daq, due.size, costs.spread))
    passed = _served(sent, _drawn(rng, costs.router / plan.threads, sent.size, costs.spread))
    judged, work = _monitors(passed, rig, process, costs, rng)
    # Samples and estimates meet in one router: what it does for the former delays the latter.
    both = np.concatenate([sent, judged])
    served = _served(both, _drawn(rng, costs.router / plan.threads, both.size, costs.spread))
    back = served[due.size :]
    age = rng.uniform(0.0, BLOCK, due.size)
    late = (back - due + age)[due > SETTLE]
    span = float(due.max() - due.min())
    processes = process[-1] + 1
    busy = {
        "daq": costs.daq * due.size / span / processes,
        "monitor": work / span / processes,
        "recorder": costs.recorder * due.size / span / processes,
        "router": 2 * costs.router * due.size / span / plan.threads,
    }
    p50, p99 = np.percentile(late, [50, 99])
    return Answer(float(p50), float(p99), busy)


def _drawn(rng: np.random.Generator, mean: float, count: int, spread: float) -> FloatArray:
    """Times of work around a mean, all positive."""
    return rng.gamma(1 / spread**2, mean * spread**2, count)


def _served(arrived: FloatArray, work: FloatArray) -> FloatArray:
    """When a station is done with each, in the order of arrival (Lindley's recursion)."""
    order = np.argsort(arrived, kind="stable")
    total = np.cumsum(work)
    free = np.maximum.accumulate(arrived[order] - (total - work))
    done = np.empty(arrived.size)
    done[order] = free + total
    return done


def _each(arrived: FloatArray, station: IntArray, work: FloatArray) -> FloatArray:
    """The same for several stations of a kind."""
    done = np.empty(arrived.size)
    for number in range(station[-1] + 1):
        own = station == number
        done[own] = _served(arrived[own], work[own])
    return done


def _monitors(
    arrived: FloatArray,
    rig: IntArray,
    process: IntArray,
    costs: Costs,
    rng: np.random.Generator,
) -> tuple[FloatArray, float]:
    """When each block's estimates are sent, and the work of all monitors [s]."""
    done, total = np.empty(arrived.size), 0.0
    factor = _drawn(rng, 1.0, arrived.size, costs.spread)
    for number in range(process[-1] + 1):
        own = np.flatnonzero(process == number)
        own = own[np.argsort(arrived[own], kind="stable")]
        seats = rig[own] - rig[own].min()
        work = (costs.turn, costs.sample * RATE * BLOCK)
        done[own], spent = _turns(arrived[own], seats, factor[own], *work)
        total += spent
    return done, total


@njit(cache=False)
def _turns(
    arrived: FloatArray, seats: IntArray, factor: FloatArray, turn: float, block: float
) -> tuple[FloatArray, float]:
    """A monitor's turns over its rigs: what has come of one is judged together.

    Args:
        arrived: when each block came, in order [s].
        seats: the rig of each.
        factor: of the work that it takes.
        turn, block: fixed work of a judgement, and that of a block's samples [s].
    """
    count = seats.max() + 1
    waiting = [[-1] for _ in range(count)]
    done, spent, now, at = np.zeros(arrived.size), 0.0, 0.0, 0
    while at < arrived.size or now < arrived[-1] or max([len(w) for w in waiting]) > 1:
        began = now
        for seat in range(count):
            while at < arrived.size and arrived[at] <= now:
                waiting[seats[at]].append(at)
                at += 1
            mine = waiting[seat]
            if len(mine) > 1:
                took = turn * factor[mine[1]] + block * (len(mine) - 1)
                now += took
                spent += took
                for one in mine[1:]:
                    done[one] = now
                waiting[seat] = [-1]
        now = max(now, began + TURN)
    return done, spent


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark."""
    plans = [Plan(16, 16, 16), Plan(10_000, 16, 160), Plan(10_000, 24, 120)]
    if not quick:
        plans += [Plan(10_000, 20, site) for site in (100, 120, 140, 160)]
    return [_row(plan) for plan in plans]


def _row(plan: Plan) -> Row:
    found = simulate(plan, Costs())
    sites = -(-plan.rigs // plan.site)
    processes = sites * -(-plan.site // plan.together)
    busy = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found.busy.items())
    rate = plan.rigs * BYTES * RATE / 1e6
    return Row(
        f"simulated: {plan.rigs} rigs, {plan.together} a process, {plan.site} a router",
        f"p50 {1e3 * found.p50:.0f} ms, p99 {1e3 * found.p99:.0f} ms",
        "p99 < 50 ms",
        "",
        f"busy: {busy}; {sites} routers, {processes} of each process, {rate:.0f} MB/s sent",
        found.p99 < LIMIT,
    )


def largest(costs: Costs, plan: Plan, key: str, tried: range) -> int:
    """The most rigs that share a process (`together`) or a router (`site`) below the limit; 0 for
    none.
    """
    most = 0
    for number in tried:
        changed = {"together": Plan(plan.rigs, number, number), "site": replace(plan, site=number)}
        if simulate(changed[key], costs).p99 >= LIMIT:
            break
        most = number
    return most


def draw(path: Path) -> None:
    """The 99 % by rigs of a process, for today's costs and for parts of them."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 3.6), layout="constrained")
    for share in (1.0, 0.5, 0.2, 0.1):
        costs, rigs, late = _scaled(share), [], []
        for number in sorted(
            {round(x / share) for x in (2, 4, 8, 12, 16, 20, 22, 24, 26, 28, 29, 30, 31)}
        ):
            found = simulate(Plan(number, number, number, threads=64), costs)
            rigs.append(number)
            late.append(1e3 * found.p99)
        axes.semilogx(rigs, late, "o-", ms=3, label=f"{share:.0%} of the measured costs")
    axes.axhline(1e3 * LIMIT, color="0.5", lw=0.8)
    axes.set(
        xlabel="rigs of one daq, monitor and recorder",
        ylabel="p99 [ms]",
        ylim=(0, 100),
        title="Sample sent to estimate received, simulated",
    )
    axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


def _scaled(share: float) -> Costs:
    now = Costs()
    names = ("daq", "router", "turn", "sample", "recorder")
    return replace(now, **{name: share * getattr(now, name) for name in names})


if __name__ == "__main__":
    print(as_text(run(quick=False)))
    for key, tried in (("together", range(2, 64, 2)), ("site", range(20, 400, 20))):
        print(f"most rigs of a {key}:", largest(Costs(), Plan(10_000, 16, 16, 2), key, tried))
    if len(sys.argv) > 1:
        draw(Path(sys.argv[1]))
