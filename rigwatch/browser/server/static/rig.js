// The rig as it is now: signals, alarms and states as the server tells them; an alarm as a study.
import { get, post } from "./api.js";
import { $, attempt, keysOn, remark, say, showHelp } from "./common.js";
import { cursor, label } from "./cursor.js";
import { listen } from "./stream.js";

const charts = {};
const kept = { samples: { times: [], lines: {} }, estimates: { times: [], lines: {} } };
let seconds = 20;
let units = {};
let shown = "";
let shelved = "";
let paused = false;
let status = null;
let old = ""; // why the figures are old
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const plain = (words) => words.replaceAll("_", " ");
const ESTIMATES = { theta1: "Coulomb θ1", theta2: "viscous θ2" };
const named = (name) => ESTIMATES[name] ?? plain(name);

function element(tag, text, attributes = {}, ...children) {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

function button(words, act, attributes = {}) {
  const made = element("button", words, { type: "button", ...attributes });
  made.addEventListener("click", async () => { made.disabled = true; await attempt(act); made.disabled = false; });
  return made;
}

/** New samples behind those that are here, as long as they are of one span. */
function take(kind, { times, lines }) {
  if (!times.length) return;
  const own = kept[kind];
  const names = Object.keys(lines);
  const same = names.length === Object.keys(own.lines).length && names.every((name) => name in own.lines);
  if (!same || times[0] <= (own.times.at(-1) ?? -Infinity)) { own.times = []; own.lines = Object.fromEntries(names.map((name) => [name, []])); }
  own.times.push(...times);
  for (const name of names) own.lines[name].push(...lines[name]);
  const old = own.times.findIndex((at) => at >= own.times.at(-1) - seconds);
  own.times.splice(0, old);
  for (const name of names) own.lines[name].splice(0, old);
}

function draw() {
  for (const [kind, { times, lines }] of Object.entries(kept)) {
    const last = times.at(-1) ?? 0;
    const since = times.map((at) => at - last);
    for (const [name, values] of Object.entries(lines)) {
      const chart = charts[name] ?? make(kind, name, [since, values]);
      chart.plot.setData([since, values]);
      told(chart.value, name, times, values);
      numbers(name, values);
    }
  }
  document.body.dataset.frames = String(Number(document.body.dataset.frames ?? 0) + 1);
}

/** A signal's value; of the residual, which swings about zero, its size over the last second. */
function told(place, name, times, values) {
  const swings = name === "residual";
  const value = swings ? rms(values.slice(times.findIndex((at) => at > times.at(-1) - 1))) : values.at(-1);
  place.dataset.value = value ?? "";
  place.textContent = `${swings ? "rms " : ""}${label(value)} ${units[name] ?? ""}`;
}

function rms(values) {
  const real = values.filter((value) => value !== null);
  return real.length ? Math.sqrt(real.reduce((sum, value) => sum + value * value, 0) / real.length) : null;
}

function make(kind, name, data) {
  if (!Object.keys(charts).length) { $("live-charts").replaceChildren(); }
  const words = units[name] ? `${named(name)} [${units[name]}]` : named(name);
  const value = element("b", "", { class: "value", "data-signal": name });
  const box = element("div", "", { class: "live", role: "img", tabindex: "0", "aria-label": `${words} over the last seconds; arrow keys read its points` });
  $("live-charts").append(element("h3", `${words} `, {}, value), box);
  const axis = { stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, font: "11px system-ui" };
  const plot = new uPlot({
    width: box.clientWidth, height: 124, legend: { show: false }, cursor: { y: false },
    scales: { x: { time: false, range: () => [-seconds, 0] } },
    axes: [{ ...axis, size: 30 }, { ...axis, size: 60, space: 18 }],
    series: [{}, { label: plain(name), stroke: colour(kind === "samples" ? "measured" : "rest"), width: 1.3, points: { show: false } }],
  }, data, box);
  cursor(box, () => plot, (text) => { $("readout").textContent = text; say(text); }, { plain: true });
  box.addEventListener("keydown", (event) => { if (event.key.startsWith("Arrow")) pause(true); });
  charts[name] = { plot, value, box };
  return charts[name];
}

function numbers(name, values) {
  const body = $("numbers").tBodies[0];
  const id = `number-${name}`;
  const row = $(id) ?? body.appendChild(element("tr", "", { id }, element("th", named(name), { scope: "row" }), ...[0, 1, 2].map(() => element("td", "", { class: "num" })), element("td", units[name] ?? "")));
  const real = values.filter((value) => value !== null);
  [values.at(-1), Math.min(...real), Math.max(...real)].forEach((value, k) => { row.cells[k + 1].textContent = real.length ? label(value) : "–"; });
}

function pause(on) {
  paused = on;
  $("pause").setAttribute("aria-pressed", on);
  $("pause").textContent = on ? "Resume" : "Pause";
  if (!on) draw();
}

function since(t_ns) { return new Date(t_ns / 1e6).toLocaleString([], { dateStyle: "short", timeStyle: "medium" }); }

const items = new Map(); // of each alarm: what it shows, and its element

/** Each alarm keeps its place, so that nothing moves away under the pointer; new ones come last. */
function alarms(found) {
  const now = JSON.stringify(found);
  if (now === shown) return;
  shown = now;
  for (const one of found) {
    const text = JSON.stringify(one);
    const before = items.get(one.name);
    if (before?.text === text) continue;
    const made = alarm(one);
    const focused = before?.made.contains(document.activeElement) ? document.activeElement.dataset.act : "";
    if (before) before.made.replaceWith(made);
    else { if (!items.size) $("alarms").replaceChildren(); $("alarms").append(made); }
    if (focused) made.querySelector(`[data-act="${focused}"]`)?.focus();
    items.set(one.name, { text, made });
  }
  const standing = found.filter((one) => one.state !== "normal").map((one) => plain(one.name));
  say(standing.length ? `alarms: ${standing.join(", ")}` : "no active alarms");
}

/** Shelved alarms are announced nowhere: here is what is kept quiet, until when and by whom. */
function shelf(found) {
  const now = JSON.stringify(found);
  if (now === shelved) return;
  shelved = now;
  const lines = found.map((one) => element("li", `${plain(one.name)} until ${since(one.until_ns)}, by ${one.user}${one.identity === "proved" ? " (proved)" : ""}${one.active ? "; its condition holds" : ""}${one.text ? `: ${one.text}` : ""}`, { "data-shelved": one.name }));
  $("shelf").replaceChildren(...(lines.length ? [element("h3", "Shelved"), element("ul", "", { class: "note" }, ...lines)] : []));
}

function alarm(one) {
  const item = element("article", "", { class: `alarm ${one.state}`, "data-alarm": one.name, "data-state": one.state });
  item.append(element("h3", plain(one.name)), element("p", `${one.severity}, ${one.state === "normal" ? "cleared" : plain(one.state)}, since ${since(one.t_ns)}${one.first_out ? ", first-out" : ""}${one.user ? `, by ${one.user}` : ""}`, { class: "note" }));
  const [what, probable] = one.cause.split("; probably missing: ");
  item.append(element("p", what));
  if (probable) item.append(element("p", `probably missing: ${probable}`, { class: "probable" }));
  item.append(element("p", one.guidance, { class: "note" }));
  const acts = element("p", "", { class: "acts" });
  const tell = (action) => () => post("/api/rig/alarm", { name: one.name, action });
  if (one.state === "unacknowledged" || one.state === "cleared_unacknowledged") acts.append(button("Acknowledge", tell("acknowledge"), { "data-act": "acknowledge" }));
  if (one.state !== "normal") acts.append(button("Reset", tell("reset"), { "data-act": "reset" }));
  if (one.seq >= 0 && one.severity !== "info") {
    acts.append(button("Open as a study", () => openStudy(one.name), { class: one.state === "normal" ? "" : "primary", "data-act": "study" }));
  }
  item.append(acts);
  return item;
}

/** A fault that has just begun is recorded a little longer first. */
async function openStudy(name) {
  for (;;) {
    const { study, wait } = await post("/api/rig/study", { name });
    if (study) { location.href = `/study/${study}`; return; }
    remark(`The fault is being recorded: ${Math.ceil(wait)} s more, then the study opens`, true);
    await new Promise((done) => { setTimeout(done, 1000 * Math.min(wait, 1)); });
  }
}

function states() {
  const { trouble, armed, why, processes } = status;
  const words = old ? old : trouble ? "absent" : armed && !why ? "watching" : armed ? `watching, but ${why}` : `not armed: ${why}`;
  if ($("link").textContent !== words) $("link").textContent = words;
  $("link").dataset.armed = trouble || old ? "absent" : armed ? "yes" : "no";
  $("absent").hidden = !trouble;
  $("absent-why").textContent = trouble;
  $("processes").tBodies[0].replaceChildren(...processes.map((one) => element("tr", "", {}, element("th", one.name, { scope: "row" }), element("td", one.state), element("td", one.text))));
}

async function history() {
  const found = await attempt(() => get("/api/rig/history"));
  if (!found) return;
  const rows = found.history.map((one) => {
    const study = one.study ? element("a", one.study, { href: `/study/${one.study}` }) : element("span", "–");
    const step = `${one.step === "promote" ? "promoted" : "rolled back"}${one.in_force ? ", in force" : ""}`;
    return element("tr", "", { "data-step": one.step, "data-in-force": one.in_force ? "yes" : "" }, element("th", since(one.t_ns), { scope: "row" }), element("td", step), element("td", one.identity ? `${one.user} (${plain(one.identity)})` : one.user), element("td", "", {}, study), element("td", one.why));
  });
  const head = element("tr", "", {}, ...["when", "what", "who", "study", "why"].map((words) => element("th", words, { scope: "col" })));
  const table = element("table", "", { id: "promotions" }, element("caption", "History of promotions, newest first", { class: "visually-hidden" }), element("thead", "", {}, head), element("tbody", "", {}, ...rows));
  const parts = rows.length ? [element("div", "", { class: "scroll", tabindex: "0", role: "region", "aria-label": "History of promotions" }, table)] : [element("p", "The commissioned model; nothing has been promoted yet.", { class: "note" })];
  if (found.can_roll_back) parts.push(element("p", "", { class: "acts" }, button("Roll back", rollback, { id: "rollback" }), element("span", "restores the previous model between two samples", { class: "note" })));
  if (found.studies.length) {
    const links = found.studies.map((one) => element("li", "", {}, element("a", one.name, { href: `/study/${one.name}` }), ` ${one.effects.join(", ")}`));
    parts.push(element("h3", "To promote"), element("p", "A study's page rehearses its model on the rig's last minutes, and then lets it go live.", { class: "note" }), element("ul", "", { class: "note" }, ...links));
  }
  $("history").replaceChildren(...parts);
}

async function rollback() {
  const done = await post("/api/rig/rollback");
  remark(done.text, true);
  await history();
}

function heard(kind, content) {
  if (kind === "status") { status = content; states(); alarms(status.alarms); shelf(status.shelf); return; }
  ({ units, seconds } = content);
  for (const one of Object.keys(kept)) take(one, content.signals[one]);
  if (!paused) draw();
}

/** Whether the monitor watches is not known while the page's figures are old. */
function outdated(words) {
  old = words;
  if (status) states(); else $("link").textContent = words;
}
$("pause").addEventListener("click", () => pause(!paused));
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || !keysOn() || event.target.closest("input, select, textarea")) return;
  if (event.key === "?") showHelp();
});
/** Charts are made anew in the colours of the page. */
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const [name, { plot }] of Object.entries(charts)) { plot.destroy(); delete charts[name]; }
  draw();
});
addEventListener("resize", () => { for (const { plot, box } of Object.values(charts)) plot.setSize({ width: box.clientWidth, height: 124 }); });
addEventListener("load", () => { listen("/api/rig/events", { kinds: ["signals", "status"], heard, again: history, told: outdated }); history(); });
