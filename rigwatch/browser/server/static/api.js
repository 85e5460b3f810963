// Asks the server: JSON and signals.

export class Refused extends Error {}

async function checked(response) {
  if (response.ok) return response;
  let text = await response.text();
  try { text = JSON.parse(text).error ?? text; } catch { /* plain words */ }
  throw new Refused(text);
}

export async function get(path, signal) {
  return (await checked(await fetch(path, { signal }))).json();
}

export async function post(path, body = {}) {
  const headers = { "content-type": "application/json" };
  return (await checked(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }))).json();
}

/** Lines of a chart: { ends, lines: [{ name, x, y }] }; NaN becomes null, a gap. */
export async function signals(path, signal) {
  const buffer = await (await checked(await fetch(path, { signal }))).arrayBuffer();
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const times = (head.shared ? head.lines.slice(0, 1) : head.lines).map(([, count]) => {
    const x = new Float64Array(buffer, at, count);
    at += 8 * count;
    return x;
  });
  const lines = head.lines.map(([name, count], k) => {
    const y = new Float32Array(buffer, at, count);
    at += 4 * count;
    return { name, count, x: times[head.shared ? 0 : k], y: y.some(Number.isNaN) ? Array.from(y, (v) => (Number.isNaN(v) ? null : v)) : y };
  });
  return { ends: head.ends, lines };
}
