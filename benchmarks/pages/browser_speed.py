"""The pages in a headless Chromium: first paint, five million samples, zooms, memory, kills."""

import json
import random
import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np

from rigwatch.browser.signals import write_trace
from rigwatch.browser.work import RESULTS, signal_key
from rigwatch.workbench.study import append_effect, commit, drop_effect, open_study
from rigwatch.workbench.study.study import Study
from rigwatch.workbench.study.study_file import Accepted
from tools.benchmark_table import Row

SAMPLES = 5_000_000
CHANNELS = ("position", "acceleration")
SETTLED = "return Number(document.body.dataset.count || 0)"
ZOOMS = 500


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark; without a browser only that of the kills."""
    folder = Path(tempfile.mkdtemp(prefix="rigwatch-pages-"))
    try:
        rows = [_kills(folder / "kills", 20 if quick else 200)]
        return rows + _pages(folder / "pages", quick=quick)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _rig_study(folder: Path) -> Study:
    """A study of the simulated rig, as the story of it has."""
    from rigwatch.browser.recordings import begin_story

    folder.mkdir(parents=True)
    return open_study(folder / begin_story(folder, "rubbing"))


def _kills(folder: Path, count: int) -> Row:
    """Kill -9 at random moments of add and undo."""
    import multiprocessing

    study = _rig_study(folder)
    effect = Accepted(effect="coulomb", port="load", parameters={"Fc": 0.1})
    moments, lost, steps = random.Random(1), 0, 0
    context = multiprocessing.get_context("fork")
    for number in range(count):
        done = folder / f"done{number}"
        begun = len(_ledger(study))
        process = context.Process(target=_change_for_ever, args=(study.folder, done, effect))
        process.start()
        while not (done.exists() and done.stat().st_size):
            time.sleep(0.001)
        time.sleep(moments.uniform(0, 0.02))
        process.kill()
        process.join()
        again = open_study(study.folder)
        whole, ended = _ledger(again)[begun:], len(done.read_bytes())
        effects = [f"{a.effect}@{a.port}" for a in again.file.effects]
        agree = whole and whole[-1]["effects"] == effects
        lost += not (agree and ended <= len(whole) <= ended + 1)
        steps += len(whole)
    return Row(
        f"pages: kill -9 at {count} random moments of add and undo", f"{lost} disagree or lose",
        "0", "", f"{steps} steps written by processes that were killed", passed=lost == 0,
    )  # fmt: skip


def _ledger(study: Study) -> list[dict[str, Any]]:
    return [json.loads(line) for line in study.ledger.read_bytes().splitlines()]


def _change_for_ever(folder: Path, done: Path, effect: Accepted) -> None:
    study = open_study(folder)
    other = drop_effect(study) if study.file.effects else append_effect(study, effect)
    with done.open("ab", buffering=0) as file:
        while True:
            commit(study, other, "add" if other.file.effects else "undo")
            file.write(b"*")
            study, other = other, study


def _pages(folder: Path, *, quick: bool) -> list[Row]:
    from tests.browser.page import CHROMIUM, DRIVER, Page, Served, browser

    if not (CHROMIUM and DRIVER):
        return []
    study = _rig_study(folder)
    served = Served(folder)
    try:
        with browser() as driver:
            page = Page(driver, served)
            page.enter()
            rows = _first_paint(page)
            page.open("/study/rubbing")
            page.until(lambda: page.run(SETTLED), "the first fit")
            rows.append(_cancel(page, study))
            _make_long(study)
            rows += _long(page, study, 60 if quick else ZOOMS)
            return rows
    finally:
        served.end()


def _first_paint(page: Any) -> list[Row]:
    page.open("/")
    page.open("/new")
    painted = "return performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"
    page.until(lambda: page.run(painted), "a paint")
    page.driver.execute_cdp_cmd("Network.clearBrowserCache", {})
    page.open("/")
    page.until(lambda: page.run(painted), "a paint")
    paint = float(page.run(painted))
    page.driver.execute_cdp_cmd("Network.clearBrowserCache", {})
    page.open("/study/rubbing")
    sizes = "return performance.getEntriesByType('resource').concat(performance.getEntriesByType("
    sizes += "'navigation')).reduce((sum, one) => sum + (one.transferSize || 0), 0)"
    page.until(lambda: page.run(SETTLED), "the signals")
    moved = float(page.run(sizes)) / 1000
    return [
        Row("pages: first contentful paint", f"{paint:.0f} ms", "500 ms", "", "", paint < 500),
        Row("pages: transferred cold, a study", f"{moved:.0f} kB", "400 kB", "", "", moved < 400),
    ]


def _cancel(page: Any, study: Study) -> Row:
    before = {p: p.read_bytes() for p in study.folder.glob("*.*") if p.is_file()}
    page.run("delete document.body.dataset.ended")
    page.press("e")
    page.until(lambda: "fitting" in page.text("#job-text"), "a fit")
    begun = time.perf_counter()
    page.press("\ue00c")
    page.until(lambda: page.run("return document.body.dataset.ended ?? ''"), "the end")
    took = time.perf_counter() - begun
    same = before == {p: p.read_bytes() for p in study.folder.glob("*.*") if p.is_file()}
    return Row(
        "pages: cancel to idle, files the same", f"{took:.2f} s, {'same' if same else 'changed'}",
        "1 s, same", "", "", took < 1 and same,
    )  # fmt: skip


def _make_long(study: Study) -> None:
    """Five million samples in place of what was fitted: what is measured is showing them."""
    kept = max((study.folder / RESULTS).iterdir(), key=lambda path: path.stat().st_mtime)
    rng = np.random.default_rng(0)
    for use in ("train", "held_out"):
        for channel in CHANNELS:
            for line in ("measured", "modelled", "residual"):
                noise = rng.normal(size=SAMPLES)
                values = noise if line == "residual" else noise.cumsum()
                write_trace(kept / "signals", signal_key(use, line, channel), values, 1 / 256)


def _long(page: Any, study: Study, zooms: int) -> list[Row]:
    begun = time.perf_counter()
    page.open("/study/rubbing")
    page.until(lambda: page.run(SETTLED) >= 2, "the signals")
    shown = time.perf_counter() - begun
    frames = _frames(page, zooms)
    asked = _asked(page, study)
    p95 = float(np.quantile(frames["frames"], 0.95))
    range95 = float(np.quantile(asked, 0.95))
    note = f"{SAMPLES} samples, {len(frames['frames'])} frames over {zooms} zooms and pans"
    return [
        Row("pages: 5 M samples shown, cached fit", f"{shown:.2f} s", "1.5 s", "", "", shown < 1.5),
        Row("pages: range request at 5 M, p95", f"{range95:.0f} ms", "50 ms", "",
            f"median {statistics.median(asked):.0f} ms, {len(asked)} spans", range95 < 50),
        Row("pages: frame at 5 M while zooming, p95", f"{p95:.0f} ms", "33 ms", "", note, p95 < 33),
        Row("pages: longest task while zooming", f"{frames['longest']:.0f} ms", "100 ms", "", note,
            frames["longest"] < 100),
        Row("pages: heap; growth over the zooms",
            f"{frames['heap']:.0f} MB; {frames['growth']:.1f} MB", "80 MB; 5 MB", "", note,
            frames["heap"] < 80 and frames["growth"] < 5),
    ]  # fmt: skip


FRAMES = """
const done = arguments[1], zooms = arguments[0];
const frames = []; let longest = 0, last = performance.now(), left = zooms;
const watch = new PerformanceObserver((list) => {
  for (const one of list.getEntries()) longest = Math.max(longest, one.duration);
});
watch.observe({ entryTypes: ["longtask"] });
const keys = ["+", "ArrowRight", "-", "ArrowLeft", "+", "+", "ArrowRight", "-", "-", "0"];
function frame(now) {
  frames.push(now - last); last = now;
  if (left-- > 0) {
    const key = keys[left % keys.length];
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
    requestAnimationFrame(frame);
  } else setTimeout(() => done({ frames, longest }), 300);
}
requestAnimationFrame(frame);
"""


def _frames(page: Any, zooms: int) -> dict[str, Any]:
    page.driver.set_script_timeout(300)
    heap = _heap(page)
    page.driver.execute_async_script(FRAMES, 50)
    before = _heap(page)
    found: dict[str, Any] = page.driver.execute_async_script(FRAMES, zooms)
    after = _heap(page)
    return found | {"heap": max(heap, after), "growth": after - before}


def _heap(page: Any) -> float:
    """What the page holds once nothing is left to be collected [MB]."""
    page.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    usage = page.driver.execute_cdp_cmd("Runtime.getHeapUsage", {})
    return float(usage["usedSize"]) / 1e6


def _asked(page: Any, study: Study, spans: int = 100) -> list[float]:
    """Times of range requests, as a client has them [ms]."""
    kept = max((study.folder / RESULTS).iterdir(), key=lambda path: path.stat().st_mtime)
    head = {"Cookie": f"rigwatch={page.served.token}"}
    rng, took = np.random.default_rng(1), []
    for _ in range(spans):
        start = rng.uniform(0, 15_000)
        end = start + 10 ** rng.uniform(-1, 4.2)
        path = f"/api/signals/rubbing?key={kept.name}&use=held_out&channel=position&chart=signals"
        url = f"{page.served.address}{path}&from={start}&to={end}&width=1100"
        begun = time.perf_counter()
        with urlopen(Request(url, headers=head)) as answer:
            answer.read()
        took.append(1e3 * (time.perf_counter() - begun))
    return took
