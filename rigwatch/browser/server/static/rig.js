// The rig as it is now: signals a few times a second, alarms, an alarm as a study.
import { get, post } from "./api.js";
import { $, attempt, say } from "./common.js";

const EVERY = 400;
const charts = {};
let shown = "";
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

function element(tag, text, attributes = {}) {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

function draw(kind, name, times, values, unit) {
  const last = times[times.length - 1] ?? 0;
  const data = [times.map((at) => at - last), values];
  const id = `${kind}-${name}`;
  if (!charts[id]) {
    const box = element("div", "", { class: "live", role: "img", "aria-label": `${name} over the last seconds` });
    $("live-charts").append(element("h3", `${name.replaceAll("_", " ")} [${unit}]`), box);
    const axis = { stroke: colour("soft"), grid: { stroke: colour("line"), width: 1 }, font: "11px system-ui" };
    charts[id] = new uPlot({
      width: box.clientWidth, height: 110, legend: { show: false }, cursor: { show: false },
      scales: { x: { time: false, range: [-20, 0] } },
      axes: [{ ...axis, size: 20 }, { ...axis, size: 60 }],
      series: [{}, { stroke: colour(kind === "samples" ? "measured" : "rest"), width: 1.3, points: { show: false } }],
    }, data, box);
  } else charts[id].setData(data);
}

function button(words, act) {
  const made = element("button", words, { type: "button" });
  made.addEventListener("click", () => attempt(act));
  return made;
}

function alarms(found) {
  const now = JSON.stringify(found.map((one) => [one.name, one.state, one.cause]));
  if (now === shown) return;
  shown = now;
  const items = found.map((one) => {
    const item = element("article", "", { class: `alarm ${one.state}`, "data-alarm": one.name, "data-state": one.state });
    const name = one.name.replaceAll("_", " ");
    item.append(element("h3", name), element("p", `${one.severity}, ${one.state.replaceAll("_", " ")}`, { class: "note" }));
    item.append(element("p", one.cause), element("p", one.guidance, { class: "note" }));
    const acts = element("p", "", { class: "acts" });
    if (one.state === "unacknowledged" || one.state === "cleared_unacknowledged") acts.append(button("Acknowledge", () => post("/api/rig/alarm", { name: one.name, action: "acknowledge" })));
    if (one.state !== "normal") acts.append(button("Reset", () => post("/api/rig/alarm", { name: one.name, action: "reset" })));
    if (one.seq >= 0) {
      const open = button("Open as a study", async () => {
        const made = await post("/api/rig/study", { name: one.name });
        location.href = `/study/${made.study}`;
      });
      open.className = "primary";
      acts.append(open);
    }
    item.append(acts);
    return item;
  });
  $("alarms").replaceChildren(...(items.length ? items : [element("p", "No alarms received.", { class: "note" })]));
  const standing = found.filter((one) => one.state !== "normal").map((one) => one.name.replaceAll("_", " "));
  say(standing.length ? `alarms: ${standing.join(", ")}` : "no standing alarms");
}

async function look() {
  if (!document.hidden) {
    try {
      const found = await get("/api/rig");
      const words = found.trouble || "live";
      if ($("link").textContent !== words) $("link").textContent = words;
      for (const [kind, { times, lines }] of Object.entries(found.signals)) {
        for (const [name, values] of Object.entries(lines)) draw(kind, name, times, values, found.units[name]);
      }
      alarms(found.alarms);
    } catch (error) { $("link").textContent = error.message; }
  }
  setTimeout(look, EVERY);
}
addEventListener("load", look);
