/* The live page of many rigs: takes the parts that the server sends, and keeps the focus. */
"use strict";

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

const events = new EventSource("/events");
events.addEventListener("rigs", (event) => {
  const { summary, html } = JSON.parse(event.data);
  say("summary", summary);
  document.title = summary;
  show(html);
  say("link", "live");
  byId("link").className = "";
  document.body.dataset.count = String(Number(document.body.dataset.count ?? 0) + 1);
});
events.addEventListener("old", (event) => {
  say("link", `no look at the rigs for ${JSON.parse(event.data).seconds} s: the figures are old`);
  byId("link").className = "no";
});
events.addEventListener("error", () => {
  say("link", `not connected since ${new Date().toLocaleTimeString()}: the figures are old`);
  byId("link").className = "no";
});
