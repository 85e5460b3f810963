// A cursor for the keyboard on a chart of signals: Shift and an arrow, or an arrow where nothing pans.

/**
 * Lets the keyboard move a chart's cursor from point to point.
 *   box: the focused element; plot: () => its uPlot; told: (words) => shown and spoken;
 *   plain: whether arrows alone move it.
 */
export function cursor(box, plot, told, { plain = false } = {}) {
  let at = null;
  box.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by || !(plain || event.shiftKey) || !plot()) return;
    event.preventDefault();
    event.stopPropagation();
    const chart = plot();
    const [x, ...lines] = chart.data;
    const { min, max } = chart.scales.x;
    const first = x.findIndex((value) => value >= min);
    const last = x.length - 1 - [...x].reverse().findIndex((value) => value <= max);
    if (first < 0 || last < first) return;
    const step = Math.max(1, Math.round((last - first) / 200)) * by;
    at = at === null || at < first || at > last ? (by > 0 ? first : last) : Math.min(Math.max(at + step, first), last);
    chart.setCursor({ left: chart.valToPos(x[at], "x"), top: chart.over.clientHeight / 2 });
    const words = lines.flatMap((line, k) => (chart.series[k + 1].show ? [`${chart.series[k + 1].label} ${label(line[at])}`] : []));
    told(`t ${label(x[at])} s   ${words.join("   ")}`);
  });
}

export function label(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : String(Number(value.toPrecision(4)));
}
