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
      ["SVG", () => save(`${name}.svg`, "image/svg+xml", document_of(one.querySelector("svg")))],
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
