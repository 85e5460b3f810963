/* The live page of many rigs: takes the parts that the server sends, and keeps the focus. */
import { listen } from "./stream.js";

const byId = (id) => document.getElementById(id);

/* Replaces only the sections that have changed, so that a reader loses neither place nor focus. */
function show(html) {
  const fresh = document.createElement("template");
  fresh.innerHTML = html;
  const focused = document.activeElement?.id;
  const rigs = byId("rigs");
  let before = null;
  for (const section of [...fresh.content.querySelectorAll("section")]) {
    const known = byId(section.id);
    const kept = known?.outerHTML === section.outerHTML ? known : section;
    if (known && kept !== known) known.remove();
    const place = before ? before.nextElementSibling : rigs.firstElementChild;
    if (place !== kept) rigs.insertBefore(kept, place);
    before = kept;
  }
  while (before?.nextElementSibling) before.nextElementSibling.remove();
  if (focused && document.activeElement?.id !== focused) byId(focused)?.focus({ preventScroll: true });
}

function say(id, words) {
  if (byId(id).textContent !== words) byId(id).textContent = words;
}

function heard(_, { summary, html }) {
  say("summary", summary);
  document.title = summary;
  show(html);
  document.body.dataset.count = String(Number(document.body.dataset.count ?? 0) + 1);
}

function told(words) {
  say("link", words || "live");
  byId("link").className = words ? "no" : "";
}
listen("/events", { kinds: ["rigs"], heard, told });
