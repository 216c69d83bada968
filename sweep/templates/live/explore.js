"use strict";
// A design in hand. Every change is sent to the server, one question at a time; the last one asked is always answered.

const page = JSON.parse(document.getElementById("page-data").textContent);
const by = (id) => document.getElementById(id);
const made = (tag, parent, entries = {}) => Object.assign(parent.appendChild(document.createElement(tag)), entries);

let design = { ...page.first }, pins = page.pins.map((pin) => ({ ...pin })), moving = null, found = null;
const past = [], free = Object.fromEntries(page.ranges.filter((r) => r.swept).map((r) => [r.name, true])), rows = {};

function say(text, wrong = false) {
  by("said").textContent = text;
  by("said").classList.toggle("wrong", wrong);
}

async function ask(what, content, options = {}) {
  const reply = await fetch(what, { method: "POST", body: JSON.stringify(content), ...options });
  if (!reply.ok) throw new Error((await reply.json().catch(() => ({ error: `refused: ${reply.status}` }))).error);
  return reply;
}

// Questions while one is under way become one.
let asking = false, again = false, steady = true;
async function renew() {
  if (asking) { again = true; return; }
  asking = true;
  do {
    again = false;
    const begun = performance.now();
    try {
      const asked = { designs: [design, ...pins.map((p) => p.design)], names: ["in hand", ...pins.map((p) => p.name)] };
      found = await (await ask("answer", asked)).json();
      show(found);
      document.body.dataset.milliseconds = performance.now() - begun;
      document.body.dataset.answers = Number(document.body.dataset.answers ?? 0) + 1;
      say(found.status[0], true);
    } catch (error) { say(error.message, true); }
  } while (again);
  asking = false;
}

function show(answer) {
  const motion = answer.motion;
  if (motion) {
    motion.steady = steady;
    if (moving) moving.replace(motion);
    else moving = new Moving(by("live"), motion);
  }
  steady = true;
  const heads = ["in hand", ...pins.map((p) => p.name)];
  table(by("limits"), ["limit", "asked", ...heads], answer.limits, (line, row) => {
    made("td", line, { textContent: row.symbol, title: row.name });
    made("td", line, { textContent: row.bound });
    row.values.forEach((value, k) => {
      const cell = made("td", line, { className: "n", textContent: `${value} ` }), slack = row.slack[k];
      const words = { missed: slack ? `by ${slack}` : "missed", active: "just", unknown: "?" }[row.states[k]];
      made("span", cell, { className: `state ${row.states[k]}`, textContent: words ?? (slack ? `${slack} left` : "kept") });
    });
  });
  table(by("outputs"), ["output", ...heads], answer.outputs, (line, row) => {
    made("td", line, { textContent: row.symbol, title: row.text });
    row.values.forEach((value, k) => {
      const cell = made("td", line, { className: "n", textContent: value });
      if (row.fast[k]) made("div", cell, { className: "fast", textContent: row.fast[k] });
      if (k === 0) cell.dataset.output = row.name;
    });
  });
}

function table(host, heads, lines, fill) {
  host.replaceChildren();
  const words = pins.length || host.id === "limits" ? heads : ["output", ""], top = made("tr", made("thead", host));
  const plain = heads.length - pins.length;
  words.forEach((text, k) => made("th", top, { textContent: text, className: k >= plain ? `pin-${k - plain + 1}` : "" }));
  const body = made("tbody", host);
  for (const row of lines) fill(made("tr", body), row);
}

function keep() {
  past.push({ ...design });
  by("undo").disabled = false;
}

function take(other, text) {
  keep();
  design = { ...design, ...other };
  steady = false;
  for (const range of page.ranges) put(range);
  say(text ?? "");
  return renew();
}

// Write a dimension into its field; a slider whose range is too narrow is widened.
function put(range) {
  const row = rows[range.name], wide = Math.abs(range.high - range.low) * range.factor;
  const exact = design[range.name] * range.factor, value = Math.abs(exact) < 1e-12 * wide ? 0 : exact; // rounding of zero
  row.field.value = Number(value.toPrecision(7));
  if (!row.slider) return;
  const ends = [Math.min(Number(row.slider.min), value), Math.max(Number(row.slider.max), value)];
  [row.slider.min, row.slider.max] = ends;
  row.slider.value = value;
}

function addDimension(range) {
  const host = made("div", by("dimensions"), { className: "dimension" }), id = `d-${range.name}`;
  const tick = made("input", host, { type: "checkbox", checked: range.swept, ariaLabel: `${range.name} may vary` });
  tick.disabled = range.choices.length > 0;
  tick.addEventListener("change", () => { if (tick.checked) free[range.name] = true; else delete free[range.name]; });
  made("label", host, { htmlFor: id, textContent: range.name, title: range.text });
  const change = (value) => { design[range.name] = value / range.factor; renew(); };
  const row = rows[range.name] = {};
  if (range.choices.length) {
    row.field = made("select", host, { id });
    for (const choice of range.choices) made("option", row.field, { value: choice, textContent: choice });
    row.field.addEventListener("change", () => { keep(); change(Number(row.field.value)); });
    return put(range);
  }
  row.field = made("input", host, { type: "number", id, step: "any" });
  made("span", host, { className: "unit", textContent: range.unit });
  const ends = [range.low * range.factor, range.high * range.factor];
  const attributes = { type: "range", min: ends[0], max: ends[1], step: "any" };
  row.slider = made("input", host, { ...attributes, ariaLabel: `${range.name} ${range.text}` });
  let held = false;
  row.slider.addEventListener("input", () => {
    if (!held) keep();
    held = true;
    row.field.value = Number(Number(row.slider.value).toPrecision(7));
    change(Number(row.slider.value));
  });
  row.slider.addEventListener("change", () => { held = false; });
  row.slider.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
    if (!way) return;
    event.preventDefault();
    const step = (row.slider.max - row.slider.min) / 200;
    row.slider.value = Number(row.slider.value) + way * step;
    for (const name of ["input", "change"]) row.slider.dispatchEvent(new Event(name));
  });
  row.field.addEventListener("change", () => {
    if (!Number.isFinite(row.field.valueAsNumber)) return put(range);
    keep();
    design[range.name] = row.field.valueAsNumber / range.factor;
    const typed = row.field.value;
    put(range);
    row.field.value = typed;
    return renew();
  });
  return put(range);
}

function undo() {
  if (!past.length) return;
  design = past.pop();
  by("undo").disabled = !past.length;
  for (const range of page.ranges) put(range);
  renew();
}

function showPins() {
  by("pins").replaceChildren();
  pins.forEach((pin, k) => {
    const choose = made("button", by("pins"), { type: "button", className: `pin-${k + 1}`, textContent: pin.name });
    choose.title = "take in hand";
    choose.addEventListener("click", () => take(pin.design, `${pin.name} in hand`));
    const away = made("button", by("pins"), { type: "button", textContent: "×", ariaLabel: `remove ${pin.name}` });
    away.addEventListener("click", () => { pins.splice(k, 1); showPins(); renew(); });
  });
  by("pin").disabled = pins.length >= page.most;
}

// The ends of the ticked sliders, in internal units.
function ends() {
  const ticked = page.ranges.filter((range) => free[range.name] && rows[range.name].slider);
  return Object.fromEntries(ticked.map((range) => {
    const { min, max } = rows[range.name].slider;
    return [range.name, [Number(min) / range.factor, Number(max) / range.factor]];
  }));
}

let search = null;
async function improve() {
  if (search) { search.abort(); return; }
  search = new AbortController();
  by("improve").textContent = "stop";
  try {
    const reply = await ask("improve", { design, free: ends() }, { signal: search.signal });
    const reader = reply.body.pipeThrough(new TextDecoderStream()).getReader();
    let text = "";
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      text += part.value;
      const lines = text.split("\n");
      text = lines.pop();
      for (const line of lines.filter(Boolean).map(JSON.parse)) {
        if (line.error) throw new Error(line.error);
        if (line.design) await take(line.design, "");
        const held = line.active?.length ? `; held back by ${line.active.join(", ")}` : "";
        const end = `${line.ended} after ${line.looks} looks${line.feasible ? "" : ", some limits are missed"}${held}`;
        say(line.design ? end : `searching: ${line.looks} looks, ${line.seconds.toFixed(1)} s`);
      }
    }
  } catch (error) { say(error.name === "AbortError" ? "stopped" : error.message, error.name !== "AbortError"); }
  search = null;
  by("improve").textContent = "improve from here";
}

async function save(kind) {
  try {
    const endings = { study: "study.toml", reference: "reference.toml", glb: "design.glb", dxf: "design.dxf", mjcf: "design.xml" };
    const own = kind === "study" || kind === "reference";
    const reply = await ask(own ? "save" : "export", own ? { design, as: kind, free: ends() } : { design, format: kind });
    const content = own ? new Blob([(await reply.json()).text]) : await reply.blob();
    const link = document.createElement("a");
    Object.assign(link, { href: URL.createObjectURL(content), download: endings[kind] ?? `design-${kind}.${kind === "law" ? "csv" : kind}` });
    link.click();
    URL.revokeObjectURL(link.href);
    say(`saved as ${link.download}`);
  } catch (error) { say(error.message, true); }
}

const PLOT = { wide: 400, high: 280, left: 52, bottom: 34, top: 8, right: 8 };
class Cells {
  constructor() {
    for (const [id, chosen] of [["across", page.columns.at(-1)], ["up", page.objective ?? page.columns[0]]]) {
      for (const name of page.columns) made("option", by(id), { textContent: name, selected: name === chosen });
      by(id).addEventListener("change", () => this.load());
    }
    this.frame = by("cells");
    this.frame.setAttribute("viewBox", `0 0 ${PLOT.wide} ${PLOT.high}`);
    this.frame.addEventListener("keydown", (event) => this.key(event));
    this.load();
  }

  async load() {
    try {
      this.data = await (await ask("cells", { x: by("across").value, y: by("up").value })).json();
      this.draw();
    } catch (error) { say(error.message, true); }
  }

  box(across, up) {
    const [x, y] = this.data.axes, wide = (PLOT.wide - PLOT.left - PLOT.right) / x.bins;
    const high = (PLOT.high - PLOT.top - PLOT.bottom) / y.bins;
    const i = x.turned ? x.bins - 1 - across : across, j = y.turned ? y.bins - 1 - up : up;
    return { x: PLOT.left + i * wide, y: PLOT.high - PLOT.bottom - (j + 1) * high, width: wide, height: high };
  }

  draw() {
    this.frame.replaceChildren();
    this.here = null;
    by("count").textContent = `${this.data.of} designs`;
    const most = Math.log1p(Math.max(1, ...this.data.cells.map((cell) => cell[2])));
    const [x, y] = this.data.axes, foot = PLOT.high - PLOT.bottom;
    for (const value of ticksBetween(...x.ends)) {
      const at = PLOT.left + ((value - x.ends[0]) / (x.ends[1] - x.ends[0])) * (PLOT.wide - PLOT.left - PLOT.right);
      svg("text", { x: at, y: foot + 13, "text-anchor": "middle" }, this.frame).textContent = short(value);
    }
    for (const value of ticksBetween(...y.ends)) {
      const at = foot - ((value - y.ends[0]) / (y.ends[1] - y.ends[0])) * (foot - PLOT.top);
      svg("text", { x: PLOT.left - 5, y: at + 3.5, "text-anchor": "end" }, this.frame).textContent = short(value);
    }
    svg("text", { x: (PLOT.wide + PLOT.left) / 2, y: PLOT.high - 5, "text-anchor": "middle" }, this.frame).textContent = `${x.title} →, ${y.title} ↑`;
    this.drawn = this.data.cells.map((cell) => {
      const shade = Math.round(25 + (75 * Math.log1p(cell[2])) / most);
      const fill = `color-mix(in oklab, var(--good) ${shade}%, var(--paper))`;
      const rect = svg("rect", { ...this.box(cell[0], cell[1]), style: `fill: ${fill}`, "data-design": cell[3] }, this.frame);
      svg("title", {}, rect).textContent = `${cell[2]} designs; the best is ${cell[3]}`;
      rect.addEventListener("click", () => this.take(cell));
      return rect;
    });
  }

  async take(cell) {
    try {
      const { design: other } = await (await ask("design", { number: cell[3] })).json();
      await take(other, `design ${cell[3]} in hand`);
    } catch (error) { say(error.message, true); }
  }

  // Arrow keys go to the nearest filled cell on that side.
  key(event) {
    const { cells } = this.data, way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (event.key === "Enter" && this.here !== null) return this.take(cells[this.here]);
    if (!way || !cells.length) return undefined;
    event.preventDefault();
    const from = this.here === null ? null : cells[this.here];
    const far = (cell) => {
      const d = [cell[0] - from[0], cell[1] - from[1]], along = d[0] * way[0] + d[1] * way[1];
      return along > 0 ? along + 3 * Math.abs(d[0] * way[1] + d[1] * way[0]) : Infinity;
    };
    const order = cells.map((cell, k) => [from ? far(cell) : k, k]).sort((a, b) => a[0] - b[0]);
    if (order[0][0] === Infinity) return undefined;
    this.drawn[this.here]?.classList.remove("here");
    this.here = order[0][1];
    this.drawn[this.here].classList.add("here");
    say(`cell with ${cells[this.here][2]} designs; Enter takes the best`);
    return undefined;
  }
}

for (const range of page.ranges) addDimension(range);
by("undo").addEventListener("click", undo);
document.addEventListener("keydown", (event) => {
  if ((event.ctrlKey || event.metaKey) && event.key === "z" && event.target.type !== "number") undo();
});
by("pin").addEventListener("click", () => {
  const name = ["A", "B", "C"].find((letter) => !pins.some((pin) => pin.name === letter));
  pins.push({ name, design: { ...design } });
  showPins();
  renew();
});
by("improve")?.addEventListener("click", improve);
by("save").addEventListener("change", (event) => { if (event.target.value) save(event.target.value); event.target.value = ""; });
showPins();
renew();
if (page.columns.length) new Cells();
