// The numbers of a study's charts over the span shown, as a table that a screen reader reads.
import { $ } from "./common.js";
import { label } from "./cursor.js";

const MOST = 200;

function row(words, tag, body) {
  const line = body.insertRow();
  words.forEach((text, k) => {
    const cell = document.createElement(k ? tag : "th");
    cell.scope = tag === "th" ? "col" : k ? "" : "row";
    cell.className = "num";
    cell.textContent = text;
    line.append(cell);
  });
}

function table(plot, unit) {
  const made = document.createElement("table");
  const { min, max } = plot.scales.x;
  const shown = plot.series.slice(1).filter((one) => one.show);
  const x = plot.data[0];
  const lines = plot.data.slice(1).filter((_, k) => plot.series[k + 1].show);
  const within = [...x.keys()].filter((k) => x[k] >= min && x[k] <= max);
  const every = Math.max(1, Math.ceil(within.length / MOST));
  made.createCaption().textContent = `${shown.map((one) => one.label).join(" and ")} [${unit}]${every > 1 ? `, every ${every}th of the ${within.length} points drawn; all samples: Export, CSV` : ""}`;
  row(["time [s]", ...shown.map((one) => one.label)], "th", made.createTHead());
  const body = made.createTBody();
  for (let k = 0; k < within.length; k += every) row([label(x[within[k]]), ...lines.map((line) => label(line[within[k]]))], "td", body);
  return made;
}

/** Opens the table of the charts. */
export function numbers(charts) {
  $("table").querySelector(".scroll").replaceChildren(...Object.values(charts.plots).map((plot) => table(plot, charts.unit)));
  $("table").showModal();
}
