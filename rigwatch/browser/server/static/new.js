// Brings recordings, maps their columns, and makes a study of parts of them.
import { get, post, signals, Refused } from "./api.js";
import { $, attempt, keysOn, remark, say, showHelp } from "./common.js";
import { cursor } from "./cursor.js";
import { figure } from "./figures.js";

const USES = [["train", "training"], ["held_out", "held out"], ["healthy", "healthy"]];
let upload = null;
let recordings = [];
let chosen = null;
let chart = null;
let columns = [];
let begun = null; // the start of a span that the keyboard is about to set

function field(value, label, width = 24) {
  const input = document.createElement("input");
  input.value = value ?? "";
  input.size = width;
  input.setAttribute("aria-label", label);
  return input;
}

function cell(row, ...content) {
  const td = row.insertCell();
  td.append(...content);
  return td;
}

function remover(row, done = () => {}) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = "×";
  button.setAttribute("aria-label", "remove this row");
  button.addEventListener("click", () => { row.remove(); done(); });
  return button;
}

async function bring(file) {
  $("bringing").textContent = `reading ${file.name}…`;
  const response = await fetch(`/api/upload/${encodeURIComponent(file.name)}`, { method: "PUT", body: file });
  $("bringing").textContent = "";
  if (!response.ok) {
    const text = await response.text();
    let told = text;
    try { told = JSON.parse(text).error; } catch { /* plain words */ }
    throw new Refused(told);
  }
  const found = await response.json();
  upload = found.upload;
  const name = file.name.replace(/\.[^.]*$/, "").replace(/[^A-Za-z0-9._-]/g, "_");
  if (!found.look) { await take(name, null); return; }
  look(file.name, found.look, found.look.mapping || name.toLowerCase());
}

function look(file, found, name) {
  $("mapping").hidden = false;
  $("preview-box").hidden = true;
  columns = found.columns.map((one) => one.name);
  $("mapping").dataset.rest = JSON.stringify(found.suggested);
  const told = found.mapping ? `, read as ${found.mapping}` : "";
  $("mapping-title").textContent = `${file}: ${found.rows} rows${told}`;
  const body = $("columns").tBodies[0];
  body.replaceChildren();
  for (const one of found.columns) {
    const row = body.insertRow();
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = one.name;
    row.append(head);
    cell(row, one.shown.map((v) => v.slice(0, 12)).join("  "));
    for (const end of [one.low, one.high]) cell(row, end === null ? "–" : Number(end.toPrecision(5)).toString()).className = "num";
  }
  for (const [constant, value] of Object.entries(found.scalars)) {
    const row = body.insertRow();
    cell(row, constant);
    cell(row, `${value} (one number)`).colSpan = 3;
  }
  $("recording-name").value = name;
  $("time").value = found.suggested.time;
  $("rate").value = found.suggested.rate ?? "";
  $("channels").tBodies[0].replaceChildren();
  for (const [channel, source] of Object.entries(found.suggested.channels)) channelRow(channel, source);
  $("recording-name").focus();
  say(`${file} has ${found.columns.length} columns`);
}

/** "column * factor + offset [unit]" in its parts; a column's name may hold signs. */
function parted(source) {
  const [, rest, unit] = /^(.*?)\s*\[([^\]]*)\]\s*$/.exec(source) ?? ["", source, ""];
  const column = [...columns].sort((a, b) => b.length - a.length).find((one) => rest === one || (rest.startsWith(one) && /^\s*[*+-]/.test(rest.slice(one.length)))) ?? rest;
  const [, factor = "", sign = "", offset = ""] = /^\s*(?:\*\s*([^\s+-]+|[^\s]+))?\s*(?:([+-])\s*(\S+))?$/.exec(rest.slice(column.length)) ?? [];
  return { column, factor, offset: `${sign === "-" ? "-" : ""}${offset}`, unit };
}

function joined({ column, factor, offset, unit }) {
  const shift = offset ? ` ${offset.startsWith("-") ? "-" : "+"} ${offset.replace(/^[+-]/, "")}` : "";
  return `${column}${factor || shift ? ` * ${factor || 1}` : ""}${shift}[${unit}]`;
}

function channelRow(channel = "", source = "") {
  const row = $("channels").tBodies[0].insertRow();
  const parts = parted(source);
  const of = channel || "the channel";
  const which = document.createElement("select");
  which.setAttribute("aria-label", `column of ${of}`);
  which.append(...columns.map((one) => new Option(one, one)));
  which.value = parts.column;
  cell(row, field(channel, "channel", 16));
  cell(row, which);
  cell(row, field(parts.factor, `factor of ${of}: a number, or a constant of the file`, 8));
  cell(row, field(parts.offset, `offset of ${of}`, 8));
  cell(row, field(parts.unit, `unit of ${of}`, 10));
  cell(row, remover(row));
}

function mapping() {
  const channels = {};
  for (const row of $("channels").tBodies[0].rows) {
    const [channel, factor, offset, unit] = [...row.querySelectorAll("input")].map((one) => one.value.trim());
    if (channel) channels[channel] = joined({ column: row.querySelector("select").value, factor, offset, unit });
  }
  const rate = $("rate").value.trim();
  return { ...JSON.parse($("mapping").dataset.rest), time: $("time").value.trim(), rate: rate ? Number(rate) : null, channels };
}

async function take(name, given) {
  const made = await post("/api/import", { upload, name, mapping: given });
  $("mapping").hidden = true;
  $("file").value = "";
  await list();
  remark([`${made.recording} is here`, ...(made.remarks ?? [])].join("; "), true);
  document.body.dataset.imported = made.recording;
  fill();
}

async function list() {
  recordings = await get("/api/recordings");
  $("no-recordings").hidden = recordings.length > 0;
  $("spans").hidden = !recordings.length;
  for (const select of document.querySelectorAll("#parts select.recording")) options(select, select.value);
}

function options(select, value) {
  select.replaceChildren(...recordings.map((one) => new Option(one, one)));
  if (recordings.includes(value)) select.value = value;
}

function partRow({ use = "train", session = "", start = 0, end = null } = {}) {
  const row = $("parts").tBodies[0].insertRow();
  const uses = document.createElement("select");
  uses.setAttribute("aria-label", "use");
  uses.append(...USES.map(([value, words]) => new Option(words, value)));
  uses.value = use;
  const which = document.createElement("select");
  which.className = "recording";
  which.setAttribute("aria-label", "recording");
  options(which, session);
  cell(row, uses);
  cell(row, which);
  cell(row, field(start || "", "from, seconds", 8));
  cell(row, field(end ?? "", "to, seconds", 8));
  cell(row, remover(row, () => choose($("parts").tBodies[0].rows[0] ?? null)));
  row.addEventListener("focusin", () => choose(row));
  which.addEventListener("change", () => show());
  return row;
}

/** The template's parts, with recordings of the same name where there are such. */
async function fill() {
  const begin = $("begin").value;
  const body = $("parts").tBodies[0];
  let parts = [{ use: "train" }, { use: "held_out" }];
  $("needs").textContent = "";
  if (!begin.includes(":")) {
    const found = await get(`/api/template/${begin}`);
    parts = found.spans;
    if (begin !== $("begin").value) return;
    $("needs").textContent = `model ${found.model}`;
  }
  body.replaceChildren();
  for (const part of parts) {
    const same = recordings.find((one) => one.split("/").pop() === part.session);
    partRow({ ...part, session: same ?? recordings[0] });
  }
  if (!$("study-name").value && !begin.includes(":")) $("study-name").value = begin;
  choose(body.rows[0]);
}

function choose(row) {
  if (chosen === row && chart) return;
  chosen = row;
  begun = null;
  for (const one of $("parts").tBodies[0].rows) one.classList.toggle("chosen", one === row);
  show();
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

async function show() {
  const session = chosen?.querySelector("select.recording")?.value;
  if (!session) return;
  const path = session.split("/").map(encodeURIComponent).join("/");
  const found = await attempt(() => get(`/api/recording/${path}`));
  if (!found) return;
  const select = $("brush-channel");
  const before = select.value;
  select.replaceChildren(...Object.entries(found.channels).map(([name, unit]) => new Option(`${name} [${unit}]`, name)));
  if (before in found.channels) select.value = before;
  const query = new URLSearchParams({ channel: select.value, width: $("brush").clientWidth });
  const lines = await attempt(() => signals(`/api/recording-signals/${path}?${query}`));
  if (lines) draw(lines, found.channels[select.value]);
}

function draw(found, unit) {
  chart?.destroy();
  const axis = { stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, font: "11px system-ui" };
  chart = new uPlot({
    width: $("brush").clientWidth, height: 170, legend: { show: false },
    cursor: { drag: { x: true, y: false, setScale: false } },
    scales: { x: { time: false } },
    axes: [{ ...axis, size: 26, label: "time [s]", labelSize: 14, labelFont: "11px system-ui" }, { ...axis, size: 62, space: 26, label: `[${unit}]`, labelSize: 14, labelFont: "11px system-ui" }],
    series: [{}, { label: $("brush-channel").value, stroke: colour("measured"), width: 1.3, points: { show: false } }],
    hooks: { setSelect: [brushed], drawClear: [marked] },
  }, [found.lines[0].x, found.lines[0].y], $("brush"));
}

function brushed(plot) {
  if (plot.select.width < 4 || !chosen) return;
  const ends = [plot.select.left, plot.select.left + plot.select.width].map((at) => plot.posToVal(at, "x"));
  plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  span(...ends);
}

/** Sets the span of the selected part. */
function span(start, end) {
  const [from, to] = chosen.querySelectorAll("input");
  from.value = start === null ? "" : start.toFixed(3);
  to.value = end === null ? "" : end.toFixed(3);
  chart?.redraw(false);
  $("brush-told").textContent = `${chosen.querySelector("select").selectedOptions[0].text}: ${from.value || "start"} to ${to.value || "end"} s`;
}

const COLOURS = { train: "train", held_out: "held", healthy: "floor" };

/** Every part of the recording that is shown, the selected one with a frame. */
function marked(plot) {
  const session = chosen?.querySelector("select.recording").value;
  const { ctx, bbox } = plot;
  ctx.save();
  for (const row of $("parts").tBodies[0].rows) {
    const [use, which] = [...row.querySelectorAll("select")].map((one) => one.value);
    if (which !== session) continue;
    const [from, to] = [...row.querySelectorAll("input")].map((one) => one.value.trim());
    const left = plot.valToPos(from ? Number(from) : plot.scales.x.min, "x", true);
    const right = plot.valToPos(to ? Number(to) : plot.scales.x.max, "x", true);
    ctx.fillStyle = ctx.strokeStyle = colour(COLOURS[use]);
    ctx.globalAlpha = 0.22;
    ctx.fillRect(left, bbox.top, right - left, bbox.height);
    ctx.globalAlpha = 1;
    ctx.font = "12px system-ui";
    ctx.textAlign = "left";
    ctx.fillText(USES.find(([name]) => name === use)[1], left + 4, bbox.top + 14 + 14 * (row.rowIndex - 1));
    if (row === chosen) { ctx.lineWidth = 2; ctx.strokeRect(left, bbox.top + 1, right - left, bbox.height - 2); }
  }
  ctx.restore();
}

/** Enter sets the start of the selected part where the cursor is, Enter again its end. */
function enter() {
  const at = chart?.cursor.idx;
  if (at === null || at === undefined || !chosen) return;
  const time = chart.data[0][at];
  if (begun === null) { begun = time; span(time, null); return; }
  span(Math.min(begun, time), Math.max(begun, time));
  begun = null;
}

async function preview() {
  const found = await attempt(() => post("/api/import-preview", { upload, mapping: mapping() }));
  $("preview-box").hidden = !found;
  if (!found) return;
  $("preview-told").textContent = [`${found.samples} samples, ${Number(found.rate.toPrecision(6))} Hz, ${Number(found.seconds.toPrecision(4))} s`, ...found.remarks].join("; ");
  $("previews").replaceChildren(...found.figures.map((one) => figure(one)));
  document.body.dataset.previewed = String(found.figures.length);
}

function parts() {
  return [...$("parts").tBodies[0].rows].map((row) => {
    const [use, session] = [...row.querySelectorAll("select")].map((one) => one.value);
    const [start, end] = [...row.querySelectorAll("input")].map((one) => one.value.trim());
    return { use, session, start: start ? Number(start) : 0, end: end ? Number(end) : null };
  });
}

$("file").addEventListener("change", (event) => { if (event.target.files[0]) attempt(() => bring(event.target.files[0])); });
$("more-channels").addEventListener("click", () => channelRow());
$("preview").addEventListener("click", preview);
$("parts").addEventListener("change", () => chart?.redraw(false));
document.addEventListener("click", (event) => {
  const use = event.target.closest("[data-add]")?.dataset.add;
  if (use) { choose(partRow({ use, session: chosen?.querySelector("select.recording").value ?? recordings[0] })); chart?.redraw(false); }
});
cursor($("brush"), () => chart, (words) => { $("brush-told").textContent = words; }, { plain: true });
$("brush").addEventListener("keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); enter(); } });
$("mapping").addEventListener("submit", (event) => { event.preventDefault(); attempt(() => take($("recording-name").value.trim(), mapping())); });
$("begin").addEventListener("change", () => attempt(fill));
$("brush-channel").addEventListener("change", () => show());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => show());
$("study").addEventListener("submit", async (event) => {
  event.preventDefault();
  const made = await attempt(() => post("/api/new", { name: $("study-name").value.trim(), begin: $("begin").value, spans: parts() }));
  if (made) location.href = `/study/${made.study}`;
});
addEventListener("keydown", (event) => { if (event.key === "?" && keysOn() && !event.target.closest("input, select")) showHelp(); });
addEventListener("load", () => attempt(async () => { await list(); await fill(); }));
