// The page of a study: parts from the server, charts, candidates, places, keys.
import { get, post } from "./api.js";
import { $, advance, attempt, keysOn, remark, say, showHelp } from "./common.js";
import { Charts } from "./charts.js";
import { cursor } from "./cursor.js";
import { exportable } from "./figures.js";
import { numbers } from "./numbers.js";
import { listen } from "./stream.js";

const name = document.querySelector("[data-study]").dataset.study;
const path = name.split("/").map(encodeURIComponent).join("/");
const address = new URLSearchParams(location.search);
let state = JSON.parse($("state").textContent);
let job = null;
const over = new Set();
let asked = 0;
let wanted = null;
const HOVER = 20; // a pointer that only crosses a row does not choose it [ms]
let chosen = null;
let place = null;
let refreshing = null;
let again = false;
let sought = state.latest ? null : state.step; // the step that is shown or on its way; null: the newest

const charts = new Charts({ signals: $("signals"), residual: $("residual") }, (what, content) => {
  if (what === "point") $("readout").textContent = content;
  if (what === "span") remember();
  if (what === "drawn") document.body.dataset.drawn = `${content} ${(Number(document.body.dataset.count) || 0) + 1}`;
  if (what === "drawn") document.body.dataset.count = (Number(document.body.dataset.count) || 0) + 1;
});

const use = () => document.querySelector("input[name=use]:checked").value;
const channel = () => state.channels.find((one) => one.name === $("channel").value) ?? state.channels[0];
const row = (label) => document.querySelector(`#ranking tr[data-label="${CSS.escape(label ?? "")}"]`);

let remembering = 0;
/** The address holds step, recordings, channel and span, so that it can be sent to a colleague; written once the charts stand still. */
function remember() {
  clearTimeout(remembering);
  remembering = setTimeout(write, 120);
}

function write() {
  const query = new URLSearchParams();
  if (!state.latest) query.set("step", state.step);
  if (use() !== "held_out") query.set("use", use());
  if (channel() && channel() !== state.channels[0]) query.set("channel", channel().name);
  if (charts.span) { query.set("from", charts.span[0].toPrecision(7)); query.set("to", charts.span[1].toPrecision(7)); }
  history.replaceState(null, "", query.size ? `?${query}` : location.pathname);
  exports();
}

function chartQuery() {
  const one = channel();
  return new URLSearchParams({ key: state.key, use: use(), channel: one.name, number: state.channels.indexOf(one), unit: one.unit });
}

function exports() {
  for (const chart of ["signals", "residual"]) {
    for (const kind of ["svg", "csv"]) {
      const query = chartQuery();
      query.set("chart", chart);
      if (charts.span) { query.set("from", charts.span[0]); query.set("to", charts.span[1]); }
      if (chosen && chart === "residual") query.set("preview", chosen);
      $(`export-${chart}-${kind}`).href = `/api/figure.${kind}/${path}?${query}`;
    }
  }
}

function draw({ keep = true } = {}) {
  legend();
  if (!state.fitted) return;
  const query = chartQuery();
  query.set("path", `/api/signals/${path}`);
  attempt(() => charts.show(query, { keep, unit: channel().unit, floor: channel().floor }));
  remember();
}

function legend() {
  const entries = [["measured", "measured"], ["model", "modelled"], ["rest", "residual"], ["floor", "noise floor (band)"]];
  if (chosen) entries.push(["held", `predicted residual with ${chosen.split("@")[0].replaceAll("_", " ")} (dashed)`]);
  $("legend").replaceChildren(...entries.map(([colour, words]) => {
    const span = document.createElement("span");
    const mark = document.createElement("i");
    mark.className = colour;
    span.append(mark, words);
    return span;
  }));
}

function channels() {
  const before = $("channel").value;
  $("channel").replaceChildren(...state.channels.map((one) => new Option(one.name, one.name)));
  if (state.channels.some((one) => one.name === before)) $("channel").value = before;
}

/** Takes what the server says of the study; charts keep their span, lists their place. */
async function refresh(step = sought) {
  // An answer that is on its way is shown first, or changes in a row would put it off.
  if (refreshing && step === sought) { again = true; return; }
  sought = step;
  again = false;
  refreshing?.abort();
  refreshing = new AbortController();
  const query = step === null ? "" : `?step=${step}`;
  const mine = refreshing;
  const found = await attempt(() => get(`/api/parts/${path}${query}`, mine.signal));
  if (refreshing !== mine) return;
  refreshing = null;
  if (again) refresh();
  if (!found) return;
  const before = state;
  state = found.state;
  for (const [part, html] of Object.entries(found.parts)) replace($(part), html);
  if (pinned && !row(pinned)) pinned = null;
  if (chosen && !row(chosen)) choose(null);
  else if (chosen) choose(chosen);
  if (place !== null && state.key !== before.key) leavePlace();
  channels();
  show();
}

/** What is fitted is drawn; what is not is fitted, unless the data are not those of the last step. */
function show() {
  if (state.fitted) draw();
  else if (!state.changed) ask("show", state.latest ? {} : { step: state.step });
}

const drawn = new Map();

/** What has not changed stays, so that nothing moves away under the mouse. */
function replace(part, html) {
  if (drawn.get(part) === html && part.firstElementChild) return;
  drawn.set(part, html);
  const focused = part.contains(document.activeElement) ? selector(document.activeElement) : null;
  const tops = [part, ...part.querySelectorAll(".scroll")].map((box) => box.scrollTop);
  part.innerHTML = html;
  [part, ...part.querySelectorAll(".scroll")].forEach((box, k) => { if (tops[k]) box.scrollTop = tops[k]; });
  if (focused) part.querySelector(focused)?.focus({ preventScroll: true });
  exportable(part);
}

function selector(element) {
  if (element.id) return `#${element.id}`;
  if (element.dataset.label) return `tr[data-label="${CSS.escape(element.dataset.label)}"]`;
  if (element.dataset.step) return `[data-step="${element.dataset.step}"]`;
  return null;
}

async function ask(task, args = {}) {
  const found = await attempt(() => post(`/api/begin/${path}`, { task, arguments: args, study: state.study }));
  if (found) { asked = found.number; heardJob(found); }
  else if (["add", "undo", "accept_data"].includes(task)) refresh();
}

const OVER = { done: "", refused: "refused", failed: "failed", cancelled: "cancelled" };

/** A job that waits is not shown before the one that runs; each end is told once, in any order. */
function heardJob(now, tell = true) {
  if (!now) return;
  const newer = !job || now.number > job.number || (now.number === job.number && job.active);
  if (newer && !(now.state === "waiting" && job?.active)) { job = now; showJob(); }
  if (now.active || over.has(now.number)) return;
  over.add(now.number);
  if (tell) ended(now);
}

function showJob() {
  const box = $("job");
  box.hidden = !(job.active || (["failed", "refused", "cancelled"].includes(job.state) && job.task !== "show"));
  $("dismiss").hidden = job.active;
  const bar = $("job-progress");
  advance(bar, job.active ? job.text : "");
  bar.hidden = !job.active;
  $("cancel").hidden = !job.active;
  $("job-text").textContent = job.text || job.task;
  box.classList.toggle("failed", job.state === "failed" || job.state === "refused");
  box.dataset.state = job.state;
  clock();
  if (job.active) say(job.text || job.task);
}

function ended(one) {
  if (one.text) remark(one.text, one.state === "done" || one.state === "cancelled");
  say(`${one.task} ${OVER[one.state] || "done"}: ${one.text}`);
  document.body.dataset.ended = `${document.body.dataset.ended ?? ""}${one.task} ${one.state};`;
  if (one.task === "report" && one.state === "done" && wanted) { wanted = null; location.href = `/api/file/report/${path}`; }
  else if (one.state !== "cancelled" && one.state !== "failed") refresh();
}

function clock() {
  $("job-time").textContent = job?.active ? `${Math.max(0, Date.now() / 1000 - job.began).toFixed(0)} s` : "";
}
setInterval(clock, 500);

function rows() { return [...document.querySelectorAll("#ranking tr.candidate:not([hidden])")]; }

/** Chooses a candidate: its evidence beside the list, what would be left in the residual. */
async function choose(label) {
  const same = chosen === label;
  chosen = label;
  for (const one of document.querySelectorAll("#ranking tr.candidate")) {
    const on = one.dataset.label === label;
    one.setAttribute("aria-selected", on);
    one.tabIndex = on ? 0 : -1;
  }
  const drawn = attempt(() => charts.preview(label ? { preview: label } : null));
  legend();
  exports();
  if (!label) { await drawn; return; }
  const query = new URLSearchParams({ label });
  if (!state.latest) query.set("step", state.step);
  const found = await attempt(() => get(`/api/candidate/${path}?${query}`));
  if (found && chosen === label && $("detail")) replace($("detail"), found.html);
  if (!same) say(`${label}: ${row(label)?.querySelector("td")?.textContent ?? ""}`);
}

function pin(label) {
  pinned = label;
  clearTimeout(hovered);
  if (label !== chosen) choose(label);
}

function move(by) {
  const all = rows();
  if (!all.length) return;
  tab("missing");
  const at = all.findIndex((one) => one.dataset.label === chosen);
  const next = all[Math.min(Math.max(at + by, 0), all.length - 1)];
  next.focus();
  next.scrollIntoView({ block: "nearest" });
  pin(next.dataset.label);
}

const candidate = () => {
  const one = row(chosen);
  return one && { effect: one.dataset.effect, port: one.dataset.port };
};

const acts = {
  explain: () => ask("explain"),
  undo: () => ask("undo"),
  preview: () => { if (candidate()) ask("preview", candidate()); else move(1); },
  anyway: () => { if (candidate()) ask("add", { ...candidate(), anyway: true }); },
  accept_data: () => ask("accept_data"),
  add: () => { if (candidate()) ask("add", candidate()); else remark("select a candidate first (j, k)"); },
  cancel: () => attempt(() => post(`/api/cancel/${path}`)),
  report: async () => { wanted = "report"; await ask("report"); },
  rehearse: () => ask("rehearse"),
  promote: () => ask("promote"),
  rollback: () => ask("rollback"),
  step: (to) => { if (to >= 0 && to < state.steps) refresh(to === state.steps - 1 ? null : to); },
};

function tab(id) {
  for (const one of document.querySelectorAll("[role=tab]")) {
    const on = one.id === `tab-${id}`;
    one.setAttribute("aria-selected", on);
    one.tabIndex = on ? 0 : -1;
    $(one.getAttribute("aria-controls")).hidden = !on;
  }
}

async function choosePlace(number) {
  if (place === number) { leavePlace(); return; }
  const query = new URLSearchParams({ key: state.key, number });
  const found = await attempt(() => get(`/api/place/${path}?${query}`));
  if (!found) return;
  place = number;
  document.querySelector("input[name=use][value=train]").checked = true;
  draw();
  charts.mark(found.spans);
  for (const one of document.querySelectorAll(".place")) one.setAttribute("aria-pressed", one.dataset.region === number);
  $("no-place").hidden = false;
  sort(found.explained);
}

function sort(explained) {
  const table = $("ranking");
  if (!table || !Object.keys(explained).length) return;
  table.classList.add("placed");
  const body = table.tBodies[0];
  const share = (one) => explained[one.dataset.label] ?? -Infinity;
  for (const one of [...body.rows].sort((a, b) => share(b) - share(a))) {
    one.querySelector(".here").textContent = share(one) > -Infinity ? `${(100 * Math.max(share(one), 0)).toFixed(0)} %` : "";
    body.append(one);
  }
  $("place-note").hidden = false;
  $("place-note").textContent = "Sorted by the share of the residual that each explains in the selected region.";
}

function leavePlace() {
  place = null;
  charts.mark([]);
  for (const one of document.querySelectorAll(".place")) one.setAttribute("aria-pressed", "false");
  if ($("no-place")) $("no-place").hidden = true;
  refresh();
}

document.addEventListener("click", (event) => {
  const at = (what) => event.target.closest(what);
  if (at(".opener")) return open(at(".opener"));
  if (at("[data-act]")) return acts[at("[data-act]").dataset.act]();
  if (at("[data-step]")) return acts.step(Number(at("[data-step]").dataset.step));
  if (at(".place")) return choosePlace(at(".place").dataset.region);
  if (at("#no-place")) return leavePlace();
  if (at("tr.candidate")) { at("tr.candidate").focus(); return pin(at("tr.candidate").dataset.label); }
  if (at("[role=tab]")) return tab(at("[role=tab]").id.slice(4));
  for (const id of ["explain", "undo", "cancel"]) if (at(`#${id}`)) return acts[id]();
  if (at("#export-report")) return acts.report();
  if (at("#numbers")) { at("details").open = false; return numbers(charts); }
  if (at("#dismiss")) { $("job").hidden = true; return undefined; }
  if (at("#zoom-in")) return charts.zoom(0.5);
  if (at("#zoom-out")) return charts.zoom(2);
  if (at("#zoom-all")) return charts.look(null);
  return undefined;
});

function open(button) {
  const shown = button.getAttribute("aria-expanded") !== "true";
  button.setAttribute("aria-expanded", shown);
  for (let next = button.closest("tr").nextElementSibling; next?.classList.contains("alike"); next = next.nextElementSibling) next.hidden = !shown;
}

// A candidate under the pointer is shown; one that was clicked comes back when the pointer leaves.
let hovered = 0;
let pinned = null;
document.addEventListener("pointerover", (event) => {
  const one = event.target.closest?.("tr.candidate");
  const label = one ? one.dataset.label : pinned;
  clearTimeout(hovered);
  if (label && label !== chosen) hovered = setTimeout(() => choose(label), one ? HOVER : 0);
});
document.addEventListener("change", (event) => {
  if (event.target.name === "use" || event.target.id === "channel") { draw(); }
  if (event.target.id === "step") acts.step(Number(event.target.value));
});

const KEYS = {
  j: () => move(1), k: () => move(-1), ArrowDown: () => move(1), ArrowUp: () => move(-1),
  Enter: acts.preview, a: acts.add, u: acts.undo, e: acts.explain,
  "[": () => acts.step(state.step - 1), "]": () => acts.step(state.step + 1),
  ArrowLeft: () => charts.pan(-0.2), ArrowRight: () => charts.pan(0.2),
  "+": () => charts.zoom(0.5), "=": () => charts.zoom(0.5), "-": () => charts.zoom(2), 0: () => charts.look(null),
  "?": showHelp,
  Escape: () => { if (job?.active) acts.cancel(); else if (place !== null) leavePlace(); else { pinned = null; choose(null); } },
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || $("help").open || $("table").open) return;
  const target = event.target;
  const within = (what) => target.closest?.(what);
  if (event.key !== "Escape" && (!keysOn() || within("input, select, textarea"))) return;
  if (within("[role=tablist]") && event.key.startsWith("Arrow")) return tabs(event);
  if (within("svg.map") && (event.key.startsWith("Arrow") || event.key === "Enter" || event.key === " ")) return cells(event);
  if (event.key === "Enter" && within("button, a, summary")) return;
  if ((event.key === "ArrowDown" || event.key === "ArrowUp") && !within("tr.candidate")) return;
  const act = KEYS[event.key];
  if (act) { event.preventDefault(); act(); }
});

function tabs(event) {
  const all = [...document.querySelectorAll("[role=tab]")];
  const at = all.indexOf(event.target) + { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (all[at]) { event.preventDefault(); tab(all[at].id.slice(4)); all[at].focus(); }
}

/** The map has one stop of the tab key; arrows go from cell to cell. */
function cells(event) {
  event.preventDefault();
  const from = event.target;
  if (event.key === "Enter" || event.key === " ") { choosePlace(from.dataset.region); return; }
  const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  const at = (one) => [one.x.baseVal.value + one.width.baseVal.value / 2, one.y.baseVal.value + one.height.baseVal.value / 2];
  const [x, y] = at(from);
  const along = (one) => { const [a, b] = at(one); return [(a - x) * dx + (b - y) * dy, Math.abs((a - x) * dy) + Math.abs((b - y) * dx)]; };
  const next = [...from.parentNode.querySelectorAll("rect.place")]
    .filter((one) => along(one)[0] > 1)
    .sort((a, b) => (along(a)[0] + 3 * along(a)[1]) - (along(b)[0] + 3 * along(b)[1]))[0];
  if (next) { from.tabIndex = -1; next.tabIndex = 0; next.focus(); }
}

// What had ended before this page was opened is no news.
let told = false;
function heard(kind, content) {
  if (kind === "study") { refresh(); return; }
  heardJob(content, told || content?.number === asked);
  told = true;
}
listen(`/api/events/${path}`, { kinds: ["job", "study"], heard, again: refresh });

function begin() {
  channels();
  if (address.get("use") === "train") document.querySelector("input[name=use][value=train]").checked = true;
  if (state.channels.some((one) => one.name === address.get("channel"))) $("channel").value = address.get("channel");
  const span = [Number(address.get("from")), Number(address.get("to"))];
  if (address.has("from") && span[1] > span[0]) charts.span = span;
  show();
  exportable();
  for (const chart of ["signals", "residual"]) cursor($(chart), () => charts.plots[chart], (words) => { $("readout").textContent = words; say(words); });
}
addEventListener("load", begin);
