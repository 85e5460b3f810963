// What the server tells a page by itself, and whether what the page shows is still so.

const SILENT = 15; // three times as long as a server that is well stays silent [s]
const OLD = "the figures are old";

function banner(words) {
  const place = document.getElementById("old");
  place.textContent = words;
  place.hidden = !words;
}

/**
 * Server-sent events for as long as the page is looked at: a browser has few connections.
 *
 * `heard` takes the events of these kinds, `again` is called when the page is looked at once more.
 * `told` takes why the page's figures are old, or "" once they are not: the server says so while its looks stall,
 * and one that hangs says nothing.
 */
export function listen(path, { kinds, heard, again = () => {}, told = banner }) {
  let source = null;
  let last = 0;
  let words = "";
  const say = (now) => { if (now !== words) { words = now; told(now); } };
  const on = (kind, act) => source.addEventListener(kind, (event) => { last = Date.now(); act(JSON.parse(event.data)); });
  const open = () => {
    if (source || document.hidden) return;
    source = new EventSource(path);
    last = Date.now();
    for (const kind of kinds) on(kind, (content) => { say(""); heard(kind, content); });
    on("still", () => say(""));
    on("old", ({ seconds, why }) => say(`no look for ${seconds} s: ${OLD}${why ? ` (${why})` : ""}`));
    source.addEventListener("error", () => { if (!words.startsWith("not connected")) say(`not connected since ${new Date().toLocaleTimeString()}: ${OLD}`); });
  };
  const close = () => { source?.close(); source = null; };
  document.addEventListener("visibilitychange", () => { if (document.hidden) close(); else { open(); again(); } });
  addEventListener("pagehide", close);
  setInterval(() => {
    if (source && !words && Date.now() - last > 1000 * SILENT) say(`the server says nothing since ${new Date(last).toLocaleTimeString()}: ${OLD}`);
  }, 1000);
  open();
}
