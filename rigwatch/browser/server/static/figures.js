// Figures other than time series: a picture, a cursor for the keyboard, its numbers, and both as files.
import { say } from "./common.js";

function save(name, kind, content) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([content], { type: kind }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const PAINT = ["fill", "stroke", "stroke-width", "stroke-dasharray", "fill-opacity", "font-size", "font-family", "font-weight", "text-anchor", "opacity"];

/** An SVG file that looks as on the page, whose style sheets it does not have. */
function document_of(svg) {
  const copy = svg.cloneNode(true);
  const [from, to] = [[svg, ...svg.querySelectorAll("*")], [copy, ...copy.querySelectorAll("*")]];
  from.forEach((one, k) => {
    const style = getComputedStyle(one);
    for (const name of PAINT) to[k].setAttribute(name, style.getPropertyValue(name));
    for (const name of ["class", "tabindex", "role", "aria-pressed", "data-region"]) to[k].removeAttribute(name);
  });
  const box = svg.viewBox.baseVal;
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy.setAttribute("width", box.width);
  copy.setAttribute("height", box.height);
  const ground = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  for (const [name, value] of Object.entries({ x: box.x, y: box.y, width: box.width, height: box.height, fill: getComputedStyle(document.body).backgroundColor })) ground.setAttribute(name, value);
  copy.prepend(ground);
  return new XMLSerializer().serializeToString(copy);
}

const NS = "http://www.w3.org/2000/svg";
function shape(tag, attributes, words = "") {
  const made = document.createElementNS(NS, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.textContent = words;
  return made;
}

/** A table as a picture: a bar for each value, or a point with its interval. */
function drawn(table, title) {
  const rows = [...table.tBodies[0].rows].map((row) => ({
    name: row.cells[0].textContent.trim().replace(/\s+/g, " ").slice(0, 44), at: row.querySelector("[data-bar], [data-low]"),
  })).filter((row) => row.at);
  const soft = getComputedStyle(document.documentElement).getPropertyValue("--soft");
  const held = getComputedStyle(document.documentElement).getPropertyValue("--held");
  const top = Math.max(...rows.map(({ at }) => Math.abs(Number(at.dataset.bar ?? 0))), 1e-300);
  const height = 34 + 22 * rows.length;
  const svg = shape("svg", { xmlns: NS, viewBox: `0 0 640 ${height}`, width: 640, height, "font-family": "sans-serif", "font-size": 12 });
  svg.append(shape("rect", { width: 640, height, fill: getComputedStyle(document.body).backgroundColor }));
  svg.append(shape("text", { x: 10, y: 18, fill: soft, "font-size": 14 }, title));
  rows.forEach(({ name, at }, k) => {
    const y = 44 + 22 * k;
    svg.append(shape("text", { x: 270, y, fill: soft, "text-anchor": "end" }, name));
    const { bar, low, high, value } = at.dataset;
    if (bar !== undefined) svg.append(shape("rect", { x: 280, y: y - 11, width: (260 * Math.abs(Number(bar))) / top, height: 12, fill: held }));
    else {
      const scale = (end) => 410 + 260 * Math.min(Math.max((Number(end) - Number(value)) / Math.abs(Number(value)), -0.5), 0.5);
      svg.append(shape("path", { d: `M${scale(low)} ${y - 5}H${scale(high)}`, stroke: held, "stroke-width": 3 }), shape("circle", { cx: 410, cy: y - 5, r: 3.5, fill: held }));
    }
    svg.append(shape("text", { x: 630, y, fill: soft, "text-anchor": "end" }, at.textContent.trim()));
  });
  return new XMLSerializer().serializeToString(svg);
}

const quoted = (words) => (/[",\n]/.test(words) ? `"${words.replaceAll('"', '""')}"` : words);

/** A table's visible words as CSV; a cell's `data-value` has the number in full. */
export function csv(table) {
  return `${[...table.rows].map((row) => [...row.cells].map((cell) => quoted(cell.dataset.value ?? cell.textContent.trim().replace(/\s+/g, " "))).join(",")).join("\n")}\n`;
}

/** Buttons below every figure that has a picture and a table. */
export function exportable(root = document) {
  for (const one of root.querySelectorAll("figure[data-figure]:not(:has(.export))")) {
    const name = one.dataset.figure;
    const bar = document.createElement("p");
    bar.className = "export";
    for (const [words, act] of [
      ["SVG", () => save(`${name}.svg`, "image/svg+xml", one.classList.contains("listed") ? drawn(one.querySelector("table"), name.replaceAll("-", " ")) : document_of(one.querySelector("svg")))],
      ["CSV", () => save(`${name}.csv`, "text/csv", csv(one.querySelector("table")))],
    ]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = words;
      button.setAttribute("aria-label", `${name.replaceAll("-", " ")} as ${words}`);
      button.addEventListener("click", act);
      bar.append(button);
    }
    one.append(bar);
  }
}

/** A curve from the server: { title, svg, axes, points }. */
export function figure({ title, svg, axes, points }) {
  const made = document.createElement("figure");
  made.dataset.figure = title.replace(/[^A-Za-z0-9]+/g, "-");
  made.innerHTML = svg;
  const caption = document.createElement("figcaption");
  caption.textContent = title;
  made.append(caption, numbers(title, axes, points));
  cursor(made.querySelector("svg"), title, axes, points);
  const holder = document.createElement("div");
  holder.append(made);
  exportable(holder);
  return made;
}

function numbers(title, axes, points) {
  const box = document.createElement("details");
  const head = document.createElement("summary");
  head.textContent = "Numbers";
  const table = document.createElement("table");
  table.createCaption().textContent = title;
  table.caption.className = "visually-hidden";
  const row = table.createTHead().insertRow();
  for (const words of axes) {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.textContent = words;
    row.append(cell);
  }
  const body = table.createTBody();
  for (const point of points) {
    const line = body.insertRow();
    for (const value of point) { const cell = line.insertCell(); cell.className = "num"; cell.textContent = value; }
  }
  box.append(head, table);
  return box;
}

/** Arrow keys go from point to point, which the live region tells. */
function cursor(svg, title, axes, points) {
  let at = -1;
  svg.tabIndex = 0;
  svg.setAttribute("aria-label", `${title}; arrow keys read its points`);
  svg.addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    at = Math.min(Math.max(at + by, 0), points.length - 1);
    say(points[at].map((value, k) => `${axes[k]} ${value}`).join(", "));
  });
}
