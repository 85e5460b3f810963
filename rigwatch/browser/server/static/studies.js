// The list of studies: running tasks, changes made elsewhere; stories are begun from here.
import { post } from "./api.js";
import { $, advance, attempt, keysOn, say, showHelp } from "./common.js";
import { listen } from "./stream.js";

let jobs = {};

/** A study's running task stands where its last step stands otherwise. */
function show() {
  for (const row of document.querySelectorAll("#studies tr[data-study]")) {
    const cell = row.querySelector(".last");
    const job = jobs[row.dataset.study];
    row.dataset.running = job?.task ?? "";
    if (!job) { if (cell.querySelector("progress")) cell.textContent = cell.dataset.last; continue; }
    if (!cell.querySelector("progress")) {
      const bar = document.createElement("progress");
      bar.setAttribute("aria-label", `${row.dataset.study}: ${job.task}`);
      cell.replaceChildren(bar, document.createElement("small"));
    }
    advance(cell.querySelector("progress"), job.text);
    cell.querySelector("small").textContent = job.text || job.task;
  }
}

async function refresh() {
  const answer = await attempt(() => fetch("/api/studies"));
  if (!answer?.ok) return;
  const focused = document.activeElement?.closest("#studies a")?.getAttribute("href");
  $("studies").innerHTML = await answer.text();
  if (focused) $("studies").querySelector(`a[href="${CSS.escape(focused)}"]`)?.focus();
  show();
}

function heard(kind, content) {
  if (kind === "studies") { refresh(); return; }
  const ended = Object.keys(jobs).filter((name) => !(name in content));
  jobs = content;
  show();
  if (ended.length) say(ended.map((name) => `${name}: task ended`).join(", "));
}
listen("/api/studies/events", { kinds: ["jobs", "studies"], heard, again: refresh });

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || !keysOn() || event.target.closest("input, select, textarea")) return;
  if (event.key === "?") showHelp();
});

document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-story]");
  if (!button) return;
  button.disabled = true;
  button.textContent = "Preparing…";
  say("preparing the recordings of the story");
  const made = await attempt(() => post(`/api/story/${button.dataset.story}`));
  if (made) location.href = `/study/${made.study}`;
  else { button.disabled = false; button.textContent = "Begin"; }
});
