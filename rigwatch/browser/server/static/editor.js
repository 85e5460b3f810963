// Own effects and models: the text is checked as it is typed, and saved into its study.
import { post } from "./api.js";
import { figure } from "./figures.js";
import { $, attempt, keysOn, remark, say, showHelp } from "./common.js";

const { kind, study } = document.querySelector("[data-kind]").dataset;
const path = study.split("/").map(encodeURIComponent).join("/");
const text = $("text");
const PAUSE = 250;
let { seen } = text.dataset; // the hash of the file as this page got it
let stored = text.value;
let later = 0;
let problems = [];
let asked = 0;

/** Character at a line and a column, both from 1. */
function offset(line, column) {
  const before = text.value.split("\n").slice(0, line - 1);
  return before.reduce((sum, one) => sum + one.length + 1, 0) + Math.max(column - 1, 0);
}

function number() {
  const by = new Map();
  for (const one of problems) if (one.line && by.get(one.line) !== "b") by.set(one.line, one.severe ? "b" : "i");
  const count = text.value.split("\n").length;
  $("lines").replaceChildren(...Array.from({ length: count }, (_, k) => {
    const made = document.createElement(by.get(k + 1) ?? "span");
    made.textContent = `${by.has(k + 1) ? "▸" : ""}${k + 1}\n`;
    return made;
  }));
}

/** Marks lie behind the text: the same characters, invisible, some of them underlined. */
function marks() {
  const places = problems.filter((one) => one.line && one.severe).map((one) => {
    const line = text.value.split("\n")[one.line - 1] ?? "";
    const start = offset(one.line, one.column || 1);
    return [start, start + (one.column ? Math.max(one.length, 1) : line.length)];
  }).sort((a, b) => a[0] - b[0]);
  const parts = [];
  let at = 0;
  for (const [from, to] of places) {
    if (from < at) continue;
    const mark = document.createElement("mark");
    mark.textContent = text.value.slice(from, to) || " ";
    parts.push(text.value.slice(at, from), mark);
    at = to;
  }
  parts.push(`${text.value.slice(at)}\n`);
  $("marks").replaceChildren(...parts);
  scrolled();
}

function scrolled() {
  $("marks").scrollTop = text.scrollTop;
  $("marks").scrollLeft = text.scrollLeft;
  $("lines").scrollTop = text.scrollTop;
}

function go(one) {
  const at = offset(one.line || 1, one.column);
  text.focus();
  text.setSelectionRange(at, at + one.length);
  text.scrollTop = Math.max(0, ((one.line || 1) - 6) * 20);
}

function list(found) {
  problems = found.problems;
  $("problems").replaceChildren(...problems.map((one) => {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.className = one.severe ? "" : "minor";
    button.dataset.line = one.line;
    button.dataset.column = one.column;
    const place = document.createElement("b");
    place.textContent = one.line ? `line ${one.line}${one.column ? `, column ${one.column}` : ""}` : "file";
    button.append(place, one.text);
    button.addEventListener("click", () => go(one));
    item.append(button);
    return item;
  }));
  const severe = problems.filter((one) => one.severe).length;
  $("verdict").textContent = severe ? `${severe} to correct` : "✓ equations and units are consistent";
  $("verdict").className = severe ? "no" : "good";
  text.setAttribute("aria-invalid", severe > 0);
  $("told").replaceChildren(...found.told.map((words) => {
    const item = document.createElement("li");
    item.textContent = words;
    return item;
  }));
  $("save").disabled = !found.usable;
  number();
  marks();
}

async function check() {
  const mine = (asked += 1);
  const found = await attempt(() => post(`/api/check/${kind}/${path}`, { file: $("file").value, text: text.value }));
  if (!found || mine !== asked) return;
  list(found);
  if (found.usable) $("figures").replaceChildren(...found.figures.map((one) => figure(one)));
  document.body.dataset.checked = String(Number(document.body.dataset.checked ?? 0) + 1);
}

async function save() {
  const made = await attempt(() => post(`/api/save/${kind}/${path}`, { file: $("file").value.trim(), text: text.value, seen }));
  if (!made) return;
  seen = made.seen;
  stored = text.value;
  if (study) $("file").readOnly = true;
  $("saved").textContent = made.text;
  remark(made.text, true);
}

text.addEventListener("input", () => {
  number();
  marks();
  $("saved").textContent = text.value === stored ? "" : "not saved";
  clearTimeout(later);
  later = setTimeout(check, PAUSE);
});
text.addEventListener("scroll", scrolled);
$("save").addEventListener("click", save);
$("like")?.addEventListener("change", (event) => { location.href = `/edit-model?like=${encodeURIComponent(event.target.value)}`; });
addEventListener("beforeunload", (event) => { if (text.value !== stored) event.preventDefault(); });
document.addEventListener("keydown", (event) => {
  if (event.key === "s" && (event.ctrlKey || event.metaKey)) { event.preventDefault(); if (!$("save").disabled) save(); return; }
  if (event.target.closest("input, textarea, select") || event.ctrlKey || event.metaKey || !keysOn()) return;
  if (event.key === "?") showHelp();
});
number();
check().then(() => say($("verdict").textContent));
