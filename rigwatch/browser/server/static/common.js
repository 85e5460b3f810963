// What every page has: remarks, the live region, the dialog of keys, copying.

export const $ = (id) => document.getElementById(id);

let hiding = 0;
export function remark(text, good = false) {
  const toast = $("toast");
  toast.textContent = text;
  toast.classList.toggle("good", good);
  toast.hidden = !text;
  clearTimeout(hiding);
  hiding = setTimeout(() => { toast.hidden = true; }, 9000);
}

export function say(text) { if ($("live").textContent !== text) $("live").textContent = text; }

/** Runs an action; what the server refuses is shown in its words. */
export async function attempt(action) {
  try { return await action(); } catch (error) {
    if (error.name !== "AbortError") remark(error.message);
    return undefined;
  }
}

/** A bar as far as a task's text says, such as "fitting lugre@load, 3 of 12"; else one that only moves. */
export function advance(bar, text) {
  const steps = /(\d+) of (?:at most )?(\d+)/.exec(text);
  if (steps) { bar.max = Number(steps[2]); bar.value = Number(steps[1]); } else bar.removeAttribute("value");
}

const stored = "rigwatch.keys";
export function keysOn() { return localStorage.getItem(stored) !== "off"; }

export function showHelp() { if (!$("help").open) $("help").showModal(); }

$("help-button").addEventListener("click", showHelp);
$("keys-on").checked = keysOn();
$("keys-on").addEventListener("change", (event) => localStorage.setItem(stored, event.target.checked ? "on" : "off"));
document.addEventListener("click", async (event) => {
  const button = event.target.closest("[data-copy]");
  if (!button) return;
  try { await navigator.clipboard.writeText(button.dataset.copy); remark(`copied: ${button.dataset.copy}`, true); }
  catch { remark(button.dataset.copy, true); }
});
