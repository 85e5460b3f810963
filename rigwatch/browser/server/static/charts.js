// Two charts over one span of time: signals, and the residual with the floor as a band.
import { signals } from "./api.js";
import { columns, paths } from "./lines.js";

const MARGIN = 62;
const EVERY = 80; // least time between two loads while the span moves [ms]
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const STYLES = {
  measured: { stroke: "measured", width: 2.6 },
  modelled: { stroke: "model", width: 1.2 },
  residual: { stroke: "rest", width: 1.1 },
  preview: { stroke: "held", width: 1.5, dash: [6, 3] },
};

function label(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : String(Number(value.toPrecision(4)));
}

export class Charts {
  constructor(places, told) {
    this.told = told;
    this.span = null;
    this.ends = null; // first and last time of all lines, once one is known
    this.other = false; // whether they are those of another recording
    this.marks = [];
    this.band = null;
    this.names = {};
    this.plots = {};
    this.places = places;
    this.asked = {};
    this.found = {}; // answers that the next frame takes
    this.due = new Set();
    this.frame = null;
    this.loaded = 0; // width that was loaded for [px]
    this.colours();
    new ResizeObserver(() => this.fit()).observe(places.signals);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.rebuild());
  }

  /** Shows another recording, channel or step; the span stays where it still is one. */
  async show(query, { keep = true, unit = "", floor = null } = {}) {
    this.query = query;
    this.unit = unit;
    this.band = floor;
    if (!keep) this.span = null;
    this.other = true;
    await this.load();
  }

  async preview(query) { this.previewed = query; await this.load(["residual"]); }

  async load(charts = ["signals", "residual"]) {
    if (!this.query) return;
    await Promise.all(charts.map((chart) => this.loadOne(chart)));
  }

  async loadOne(chart) {
    this.asked[chart]?.abort();
    const asked = (this.asked[chart] = new AbortController());
    const query = new URLSearchParams(this.query);
    this.loaded = this.places[chart].clientWidth;
    const width = Math.max(200, Math.round(this.loaded - MARGIN));
    query.set("chart", chart);
    query.set("width", this.span ? 2 * width : width);
    if (this.span) {
      // Half a chart more on both sides, so that a pan has something to show at once.
      const beside = (this.span[1] - this.span[0]) / 2;
      query.set("from", this.span[0] - beside);
      query.set("to", this.span[1] + beside);
    }
    if (chart === "residual" && this.previewed) for (const [k, v] of Object.entries(this.previewed)) query.set(k, v);
    const path = this.query.get("path");
    query.delete("path");
    try { this.found[chart] = await signals(`${path}?${query}`, asked.signal); } catch (error) {
      if (error.name !== "AbortError") throw error;
      return;
    }
    this.reach(this.found[chart].ends);
    await this.soon(chart);
  }

  /** Draws charts at the next frame: once for all that has changed by then. */
  soon(...charts) {
    for (const chart of charts) this.due.add(chart);
    this.frame ??= new Promise((done) => {
      requestAnimationFrame(() => { this.frame = null; this.flush(); done(); });
    });
    return this.frame;
  }

  flush() {
    const due = [...this.due];
    this.due.clear();
    for (const chart of due) {
      const found = this.found[chart];
      delete this.found[chart];
      if (found) this.draw(chart, found);
      else if (this.plots[chart]) this.place(chart);
    }
  }

  draw(chart, found) {
    const [first, ...rest] = found.lines;
    const same = rest.every((line) => line.count === first.count && line.x[0] === first.x[0] && line.x[line.count - 1] === first.x[first.count - 1]);
    const [x, ...values] = same ? [first.x, ...found.lines.map((line) => line.y)] : uPlot.join(found.lines.map((line) => [line.x, line.y]));
    const names = found.lines.map((line) => line.name);
    if (!this.plots[chart] || !names.every((name) => this.names[chart].includes(name))) {
      this.plots[chart]?.destroy();
      this.names[chart] = names;
      this.plots[chart] = this.make(chart, names, [x, ...values]);
      this.place(chart);
    } else {
      // A line that is not there now keeps its place, hidden: making a chart anew takes longer.
      const lines = this.names[chart].map((name) => values[names.indexOf(name)] ?? new Array(x.length).fill(null));
      this.place(chart, [x, ...lines], this.names[chart].map((name) => names.includes(name)));
    }
    this.told("drawn", chart);
  }

  /** The charts share one span, whichever of their answers comes first. */
  reach([first, last]) {
    const before = (!this.other && this.ends) || [Infinity, -Infinity];
    this.other = false;
    this.ends = [Math.min(first, before[0]), Math.max(last, before[1])];
    if (this.span || (this.ends[0] === before[0] && this.ends[1] === before[1])) return;
    this.soon(...Object.keys(this.plots));
  }

  whole() { return this.ends ?? [0, 1]; }

  /** Sets a chart's span, and its data and which lines are there if they are given. */
  place(chart, data = null, shown = []) {
    const [from, to] = this.span ?? this.whole();
    const plot = this.plots[chart];
    plot.batch(() => {
      if (data) plot.setData(data, false);
      shown.forEach((show, k) => { if (plot.series[k + 1].show !== show) plot.setSeries(k + 1, { show }); });
      plot.setScale("x", { min: from, max: to });
    });
  }

  make(chart, names, data) {
    const box = this.places[chart];
    const axis = { stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line"), width: 1 }, font: "11px system-ui" };
    const last = chart === "residual";
    return new uPlot({
      width: box.clientWidth, height: box.clientHeight,
      legend: { show: false },
      cursor: { sync: { key: "time" }, drag: { x: true, y: false, setScale: false }, points: { size: 6 } },
      // A span without samples keeps its axis, so that the charts stay below one another.
      scales: { x: { time: false, auto: false }, y: { range: (_, low, high) => (low === null ? [-1, 1] : uPlot.rangeNum(low, high, 0.1, true)) } },
      axes: [
        { ...axis, show: true, size: last ? 30 : 8, label: last ? "time [s]" : undefined, labelSize: 13, labelFont: "11px system-ui", values: last ? undefined : (_, ticks) => ticks.map(() => "") },
        { ...axis, size: MARGIN, space: 14, label: `${last ? "residual" : this.query.get("channel")} [${this.unit}]`, labelSize: 16, labelFont: "11px system-ui", values: (_, ticks) => ticks.map(label) },
      ],
      series: [{}, ...names.map((name) => ({
        label: name, spanGaps: false, points: { show: false }, paths, width: STYLES[name].width,
        stroke: colour(STYLES[name].stroke), dash: STYLES[name].dash,
      }))],
      hooks: {
        drawClear: [(plot) => { this.drawMarks(plot); if (last) this.drawBand(plot); }],
        drawSeries: [columns],
        setSelect: [(plot) => this.selected(plot)],
        setCursor: [(plot) => this.point(plot, names)],
        ready: [(plot) => this.wheel(plot)],
      },
    }, data, box);
  }

  drawBand(plot) {
    if (!this.band) return;
    const [high, low] = [plot.valToPos(this.band, "y", true), plot.valToPos(-this.band, "y", true)];
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    ctx.fillStyle = this.fill.band;
    ctx.fillRect(bbox.left, high, bbox.width, low - high);
    ctx.restore();
  }

  drawMarks(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    ctx.fillStyle = this.fill.mark;
    for (const [from, to] of this.marks) {
      const left = plot.valToPos(from, "x", true);
      ctx.fillRect(left, bbox.top, Math.max(plot.valToPos(to, "x", true) - left, 1.5), bbox.height);
    }
    ctx.restore();
  }

  mark(spans) { this.marks = spans; for (const plot of Object.values(this.plots)) plot.redraw(false); }

  selected(plot) {
    if (plot.select.width < 4) return;
    const span = [plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.look(span);
  }

  point(plot, names) {
    const at = plot.cursor.idx;
    if (at === null || at === undefined) return;
    this.told("point", [`t ${label(plot.data[0][at])} s`, ...names.flatMap((name, k) => (plot.series[k + 1].show ? [`${name} ${label(plot.data[k + 1][at])}`] : []))].join("   "));
  }

  wheel(plot) {
    plot.over.addEventListener("wheel", (event) => {
      event.preventDefault();
      const centre = plot.posToVal(event.offsetX, "x");
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8, centre);
    }, { passive: false });
    plot.over.addEventListener("dblclick", () => this.look(null));
  }

  look(span) {
    const [first, last] = this.whole();
    if (span) {
      const width = Math.min(span[1] - span[0], last - first);
      const from = Math.min(Math.max(span[0], first), last - width);
      span = width >= last - first || width <= 0 ? null : [from, from + width];
    }
    this.span = span;
    this.soon(...Object.keys(this.plots));
    this.told("span", span);
    this.loadSoon(EVERY);
  }

  /** Loads while the span still moves, one load at a time; the last span is always loaded. */
  loadSoon(within) {
    if (this.loading) { this.again = true; return; }
    this.loading = true;
    setTimeout(async () => {
      this.again = false;
      try { await this.load(); } finally { this.loading = false; }
      if (this.again) this.loadSoon(within);
    }, within);
  }

  zoom(factor, centre) {
    const [from, to] = this.span ?? this.whole();
    const at = centre ?? (from + to) / 2;
    this.look([at - (at - from) * factor, at + (to - at) * factor]);
  }

  pan(share) {
    const [from, to] = this.span ?? this.whole();
    const by = (to - from) * share;
    this.look([from + by, to + by]);
  }

  /** A browser tells a size also when it begins to look: what is loaded for it is not loaded again. */
  fit() {
    for (const [chart, plot] of Object.entries(this.plots)) {
      const { clientWidth: width, clientHeight: height } = this.places[chart];
      if (plot.width !== width || plot.height !== height) plot.setSize({ width, height });
    }
    if (this.loaded && this.loaded !== this.places.signals.clientWidth) this.loadSoon(120);
  }

  /** Those of areas, looked up once: a look-up makes the browser compute its styles. */
  colours() { this.fill = { band: colour("band"), mark: colour("mark") }; }

  rebuild() {
    this.colours();
    for (const plot of Object.values(this.plots)) plot.destroy();
    this.plots = {};
    this.load();
  }
}
