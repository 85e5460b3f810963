"""Frames, tasks and memory of a page while its charts are zoomed and panned at every frame."""

from typing import Any

import numpy as np

from tools.benchmark_table import Row

FRAMES = """
const [zooms, act] = arguments, done = arguments[2];
const frames = []; let longest = 0, last = performance.now(), left = zooms;
const watch = new PerformanceObserver((list) => {
  for (const one of list.getEntries()) longest = Math.max(longest, one.duration);
});
watch.observe({ entryTypes: ["longtask"] });
const keys = ["+", "ArrowRight", "-", "ArrowLeft", "+", "+", "ArrowRight", "-", "-", "0"];
const typed = (key) => new KeyboardEvent("keydown", { key, bubbles: true });
const plain = (key) => document.body.dispatchEvent(typed(key));
const move = act ? window[act] : plain;
function frame(now) {
  frames.push(now - last); last = now;
  if (left-- > 0) { move(keys[left % keys.length]); requestAnimationFrame(frame); }
  else setTimeout(() => { watch.disconnect(); done({ frames, longest }); }, 500);
}
requestAnimationFrame(frame);
"""
THREE = """
const done = arguments[1], query = new URLSearchParams(arguments[0]);
import("/static/charts.js").then(async ({ Charts }) => {
  const main = document.getElementById("charts");
  main.style.height = "900px";
  for (const one of main.querySelectorAll(".plot")) one.remove();
  const all = [];
  for (const channel of ["position", "acceleration", "position"]) {
    const places = {};
    for (const name of ["signals", "residual"]) {
      places[name] = document.createElement("div");
      places[name].className = "plot";
      places[name].style.minHeight = "120px";
      main.append(places[name]);
    }
    const charts = new Charts(places, () => {});
    query.set("channel", channel);
    await charts.show(new URLSearchParams(query), { unit: "1", floor: 1 });
    all.push(charts);
  }
  const act = {
    "+": (c) => c.zoom(0.5), "-": (c) => c.zoom(2), 0: (c) => c.look(null),
    ArrowLeft: (c) => c.pan(-0.2), ArrowRight: (c) => c.pan(0.2),
  };
  window.moveThree = (key) => all.forEach(act[key]);
  const plots = all.flatMap((charts) => Object.values(charts.plots));
  done(plots.reduce((sum, plot) => sum + plot.series.length - 1, 0));
}, (error) => done(String(error)));
"""


def zoomed(page: Any, million: str, zooms: int) -> list[Row]:
    """Rows of the study's own charts, and of three pairs of them with three lines each."""
    heap = _heap(page)
    page.driver.execute_async_script(FRAMES, 50, "")
    before = _heap(page)
    own = page.driver.execute_async_script(FRAMES, zooms, "")
    after = _heap(page)
    most, growth = max(heap, before, after), after - before
    query = page.run(
        "return document.getElementById('export-signals-csv').getAttribute('href')"
    ).split("?")[1]
    lines = page.driver.execute_async_script(THREE, f"{query}&use=held_out&path=/api/signals/long")
    assert lines == 9, lines
    three = page.driver.execute_async_script(FRAMES, zooms, "moveThree")
    return [
        _frames(f"frame at {million}, the page's charts, p95", own),
        _frames(f"frame at {million}, three charts of three lines, p95", three),
        _longest(f"longest task at {million}", own, three),
        Row(f"heap; growth over {zooms} zooms", f"{most:.1f} MB; {growth:.2f} MB", "80 MB; 5 MB",
            "", "after collecting garbage", most < 80 and growth < 5),
    ]  # fmt: skip


def _frames(what: str, found: dict[str, Any]) -> Row:
    p50, p95 = np.quantile(found["frames"], [0.5, 0.95])
    note = f"median {p50:.1f} ms, {len(found['frames'])} frames, a zoom or pan at each"
    return Row(what, f"{p95:.1f} ms", "33 ms", "", note, bool(p95 < 33))


def _longest(what: str, *found: dict[str, Any]) -> Row:
    most = max(one["longest"] for one in found)
    told = f"{most:.0f} ms" if most else "under 50 ms"
    return Row(what, told, "100 ms", "", "of both; the browser counts from 50 ms", most < 100)


def _heap(page: Any) -> float:
    """What the page holds once nothing is left to be collected [MB]."""
    page.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    usage = page.driver.execute_cdp_cmd("Runtime.getHeapUsage", {})
    return float(usage["usedSize"]) / 1e6
