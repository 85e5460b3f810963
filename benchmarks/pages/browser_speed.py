"""The pages in a headless Chromium: paint, five million samples, zooms, memory, previews, axe.

Chromium draws without a graphics processor here, as on a virtual machine.
"""

import queue
import shutil
import statistics
import tempfile
import threading
import time
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np

from benchmarks.pages.long_study import SAMPLES, make_long, show_first
from rigwatch.browser.recordings import begin_story
from rigwatch.browser.work import RESULTS
from rigwatch.browser.work.tasks import RANKED
from rigwatch.workbench.study import open_study
from tools.benchmark_table import Row

DRAWN = "return Number(document.body.dataset.count || 0)"
ZOOMS = 500
HOVERS = 40


def run(quick: bool) -> list[Row]:
    """The rows of this benchmark; none without a browser."""
    from tests.browser.page import CHROMIUM, DRIVER, Page, Served, browser

    if not (CHROMIUM and DRIVER):
        return []
    root = Path(tempfile.mkdtemp(prefix="rigwatch-pages-"))
    begin_story(root, "rubbing")
    served = Served(root)
    try:
        with browser() as driver:
            driver.set_script_timeout(600)
            page = Page(driver, served)
            page.enter()
            rows = _first_paint(page)
            page.open("/study/rubbing")
            page.until(lambda: page.run(DRAWN), "the first fit")
            rows += [_cancel(page, root / "rubbing"), _explain(page, "rubbing")]
            rows += [_preview(page), *_judged(page)]
            return rows + _long(page, root, SAMPLES // 10 if quick else SAMPLES, quick=quick)
    finally:
        served.end()
        shutil.rmtree(root, ignore_errors=True)


def _first_paint(page: Any) -> list[Row]:
    painted = "return performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? 0"
    paints = []
    for path in ("/", "/new") * 5:
        page.driver.execute_cdp_cmd("Network.clearBrowserCache", {})
        page.open(path)
        page.until(lambda: page.run(painted), "a paint")
        paints.append(float(page.run(painted)))
    page.driver.execute_cdp_cmd("Network.clearBrowserCache", {})
    page.open("/study/rubbing")
    sizes = "return performance.getEntriesByType('resource').concat(performance.getEntriesByType("
    sizes += "'navigation')).reduce((sum, one) => sum + (one.transferSize || 0), 0)"
    page.until(lambda: page.run(DRAWN) >= 2, "the signals")
    moved = float(page.run(sizes)) / 1000
    worst = max(paints)
    note = f"median {statistics.median(paints):.0f} ms, {len(paints)} times with an empty cache"
    return [
        Row("first contentful paint, slowest", f"{worst:.0f} ms", "500 ms", "", note, worst < 500),
        Row("transferred with an empty cache, a study", f"{moved:.0f} kB", "400 kB", "",
            "the page, scripts, styles and signals", moved < 400),
    ]  # fmt: skip


def _files(study: Path) -> dict[Path, bytes]:
    whole = (p for p in study.rglob("*") if p.is_file() and RESULTS not in p.parts)
    return {path: path.read_bytes() for path in whole}


def _cancel(page: Any, study: Path, times: int = 5) -> Row:
    before, took = _files(study), []
    for number in range(times):
        page.run("delete document.body.dataset.ended")
        page.press("e")
        page.until(lambda: "fitting" in page.text("#job-text"), "a fit")
        time.sleep(0.3 * number)
        begun = time.perf_counter()
        page.press("\ue00c")
        page.until(lambda: page.run("return document.body.dataset.ended ?? ''"), "the end")
        took.append(time.perf_counter() - begun)
    same = before == _files(study)
    return Row(
        "Cancel to idle, slowest; files", f"{max(took):.2f} s; {'same' if same else 'changed'}",
        "1 s; same", "", f"{times} times within Explain", max(took) < 1 and same,
    )  # fmt: skip


SHOWN = """
const done = arguments[0], begun = Date.now();
const watch = new MutationObserver(() => {
  if (!document.querySelector("#ranking tbody tr")) return;
  watch.disconnect();
  requestAnimationFrame(() => requestAnimationFrame(() => done([begun, Date.now()])));
});
watch.observe(document.body, { subtree: true, childList: true });
document.getElementById("explain").click();
"""


def _explain(page: Any, study: str) -> Row:
    """What the page takes in addition to the engine, whose end the study's events tell."""
    told: queue.Queue[float] = queue.Queue()
    threading.Thread(target=_ranked, args=(page.served, study, told), daemon=True).start()
    begun, shown = (ms / 1e3 for ms in page.driver.execute_async_script(SHOWN))
    ended = told.get(timeout=60)
    rest = shown - ended
    return Row(
        "Explain to the ranked list, beyond the engine's time", f"{rest:.2f} s", "0.3 s", "",
        f"engine {ended - begun:.1f} s, with the start of the task", rest < 0.3,
    )  # fmt: skip


def _ranked(served: Any, study: str, told: "queue.Queue[float]") -> None:
    """Hear when the engine has its ranking."""
    head = {"Authorization": served.bearer}
    with urlopen(Request(f"{served.address}/api/events/{study}", headers=head)) as events:
        for line in events:
            if RANKED.encode() in line:
                told.put(time.time())
                return


HOVER = """
const done = arguments[1], row = document.querySelectorAll("#ranking tr.candidate")[arguments[0]];
const begun = performance.now();
const watch = new MutationObserver(() => {
  if (!document.body.dataset.drawn.startsWith("residual")) return;
  watch.disconnect();
  requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - begun)));
});
watch.observe(document.body, { attributeFilter: ["data-drawn"] });
row.dispatchEvent(new PointerEvent("pointerover", { bubbles: true }));
"""


def _preview(page: Any) -> Row:
    rows = int(page.run("return document.querySelectorAll('#ranking tr.candidate').length"))
    few = min(rows, 6)
    for number in range(few):
        page.driver.execute_async_script(HOVER, number)
    took = [page.driver.execute_async_script(HOVER, k % few) for k in range(HOVERS)]
    p95 = float(np.quantile(took, 0.95))
    return Row(
        "preview after hover, warm, p95", f"{p95:.0f} ms", "150 ms", "",
        f"median {statistics.median(took):.0f} ms, {len(took)} times, until the frame after it",
        p95 < 150,
    )  # fmt: skip


def _judged(page: Any) -> list[Row]:
    from tests.browser.everywhere import violations

    page.errors(), page.requests()
    found = violations(page, "rubbing")
    errors = [told for told in page.errors() if "404" not in told]
    foreign = page.requests() - {page.served.address}
    return [
        Row("axe, WCAG A and AA, every page in light and dark",
            f"{sum(map(len, found.values()))} violations", "0", "", "; ".join(found), not found),
        Row("console errors; foreign requests", f"{len(errors)}; {len(foreign)}", "0; 0", "",
            "pages of what is not there answer 404 and are left out", not errors and not foreign),
    ]  # fmt: skip


def _long(page: Any, root: Path, samples: int, *, quick: bool) -> list[Row]:
    from benchmarks.pages.zooming import zoomed

    made = make_long(root, "long", samples)
    first = show_first(page, "long")
    shown = []
    for _ in range(5):
        begun = time.perf_counter()
        page.open("/study/long")
        page.until(lambda: page.run(DRAWN) >= 2, "the signals")
        shown.append(time.perf_counter() - begun)
    asked = _asked(page, open_study(root / "long").folder)
    range95, million = float(np.quantile(asked, 0.95)), f"{samples / 1e6:g} M"
    note = f"median {statistics.median(shown):.2f} s; simulated in {made:.0f} s, first fit and"
    note += f" judgement {first:.0f} s"
    return [
        Row(f"study of {million} samples shown, cached fit, slowest", f"{max(shown):.2f} s",
            "1.5 s", "", note, max(shown) < 1.5),
        Row(f"range request at {million}, p95", f"{range95:.0f} ms", "50 ms", "",
            f"median {statistics.median(asked):.0f} ms, {len(asked)} spans", range95 < 50),
        *zoomed(page, million, 100 if quick else ZOOMS),
    ]  # fmt: skip


def _asked(page: Any, study: Path, spans: int = 200) -> list[float]:
    """Times of range requests, as a client has them [ms]."""
    kept = max((study / RESULTS).iterdir(), key=lambda path: path.stat().st_mtime)
    head = {"Authorization": page.served.bearer}
    rng, took = np.random.default_rng(1), []
    for _ in range(spans):
        start = rng.uniform(0, 15_000)
        end = start + 10 ** rng.uniform(-1, 4.2)
        path = "/api/signals/long?use=held_out&channel=position&chart=signals"
        url = f"{page.served.address}{path}&key={kept.name}&from={start}&to={end}&width=1100"
        begun = time.perf_counter()
        with urlopen(Request(url, headers=head)) as answer:
            answer.read()
        took.append(1e3 * (time.perf_counter() - begun))
    return took
