// Lines of charts. A line with more points than pixels is drawn as one bar per pixel column: stroking thousands of joined
// segments takes a browser without a graphics processor fifty times as long, for the same picture.

const linear = uPlot.paths.linear();

/** Path builder of a series: none where the line is drawn as columns by `columns`. */
export function paths(plot, series, first, last) {
  const dense = last - first > plot.bbox.width;
  plot.series[series].dense = dense ? [first, last] : null;
  return dense ? null : linear(plot, series, first, last);
}

/** Hook `drawSeries`: the columns of a dense line, each joined to the one before it. */
export function columns(plot, index) {
  const series = plot.series[index];
  if (!series.dense || !series.show) return;
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
  ctx.fillStyle = series.stroke(plot, index);
  // Whole pixels: a software canvas takes several times as long over edges that it has to blend.
  const thick = Math.max(Math.round(series.width * uPlot.pxRatio), 1);
  const wide = Math.max(Math.round(thick / 2), 1);
  const [on, off] = (series.dash ?? [1, 0]).map((length) => length * uPlot.pxRatio);
  each(plot, index, (at, low, high) => {
    if (off && (at - bbox.left) % (on + off) >= on) return;
    const top = Math.round(high - thick / 2);
    ctx.fillRect(at, top, wide, Math.round(low - high) + thick);
  });
  ctx.restore();
}

/** Calls `bar` with pixel column, lowest and highest place of each column of a line. */
function each({ data, bbox, scales, series }, index, bar) {
  const [x, y, [first, last]] = [data[0], data[index], series[index].dense];
  const across = bbox.width / (scales.x.max - scales.x.min);
  const up = bbox.height / (scales.y.max - scales.y.min);
  const left = bbox.left - scales.x.min * across;
  const top = bbox.top + scales.y.max * up;
  let at = -1, low = 0, high = 0, before = null;
  for (let k = first; k <= last; k++) {
    const value = y[k];
    if (value === undefined) continue;
    if (value === null) { if (at >= 0) bar(at, low, high); at = -1; before = null; continue; }
    const column = Math.max(Math.floor(left + x[k] * across), 0);
    const place = top - value * up;
    if (column !== at) {
      if (at >= 0) bar(at, low, high);
      at = column;
      low = high = before ?? place;
    }
    if (place > low) low = place;
    if (place < high) high = place;
    before = place;
  }
  if (at >= 0) bar(at, low, high);
}
