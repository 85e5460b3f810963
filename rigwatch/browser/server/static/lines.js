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
  if (!series.dense) return;
  const { ctx, bbox } = plot;
  const thick = Math.max(series.width * uPlot.pxRatio, 1);
  ctx.save();
  ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
  ctx.fillStyle = series.stroke(plot, index);
  for (const [at, low, high] of bars(plot, index, series)) {
    ctx.fillRect(at, high - thick / 2, Math.max(thick / 2, 1), low - high + thick);
  }
  ctx.restore();
}

/** Pixel column, lowest and highest place of each column of a line. */
function* bars(plot, index, series) {
  const { data, bbox, scales } = plot;
  const [x, y, [first, last]] = [data[0], data[index], series.dense];
  const across = bbox.width / (scales.x.max - scales.x.min);
  const up = bbox.height / (scales.y.max - scales.y.min);
  let at = null, low = 0, high = 0, before = null;
  for (let k = first; k <= last; k++) {
    if (y[k] === undefined) continue;
    if (y[k] === null) { if (at !== null) yield [at, low, high]; at = before = null; continue; }
    const column = Math.floor(bbox.left + (x[k] - scales.x.min) * across);
    const place = bbox.top + (scales.y.max - y[k]) * up;
    if (column !== at) {
      if (at !== null) yield [at, low, high];
      at = column;
      low = high = before ?? place;
    }
    low = Math.max(low, place);
    high = Math.min(high, place);
    before = place;
  }
  if (at !== null) yield [at, low, high];
}
