"use strict";
// A design in hand. Every change is sent to the server, one question at a time; the last one asked is always answered.

const page = JSON.parse(document.getElementById("page-data").textContent);
const by = (id) => document.getElementById(id);
const made = (tag, parent, entries = {}) => Object.assign(parent.appendChild(document.createElement(tag)), entries);

let design = { ...page.first }, pins = page.pins.map((pin) => ({ ...pin })), moving = null, found = null;
let note = ""; // what is said of the design in hand until it changes
const past = [], free = Object.fromEntries(page.ranges.filter((r) => r.swept).map((r) => [r.name, true])), rows = {};

function say(text, wrong = false) {
  by("said").textContent = text;
  by("said").classList.toggle("wrong", wrong);
}

async function ask(what, content, options = {}) {
  const reply = await fetch(what, { method: "POST", body: JSON.stringify(content), ...options }).catch((error) => {
    throw error.name === "AbortError" ? error : new Error("no answer: does sweep explore still run in the shell?");
  });
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
      say(found.status[0] || note, found.status[0] !== "");
    } catch (error) { say(`${error.message}; shown is the design before`, true); }
  } while (again);
  asking = false;
}

// A joint that is dragged: the server finds the dimensions that bring it there; the last place asked for is reached.
let place = null, pulling = false;
async function pull(to) {
  if (to === null) { keep(); moving.rest(); return; }
  place = to;
  if (pulling) return;
  pulling = true;
  while (place) {
    const asked = { design, phi: moving.phi, ...place };
    place = null;
    try {
      const reply = await (await ask("drag", asked)).json();
      design = { ...design, ...reply.design };
      for (const range of page.ranges) put(range);
      await renew();
      moving.phi = reply.phi;
    } catch (error) { say(error.message, true); }
  }
  pulling = false;
}

function show(answer) {
  const motion = answer.motion;
  by("drags").hidden = !motion?.draggable;
  if (motion) {
    motion.steady = steady;
    if (moving) moving.replace(motion);
    else {
      moving = new Moving(by("live"), motion);
      moving.view?.grab(pull);
    }
  }
  steady = true;
  const heads = ["in hand", ...pins.map((p) => p.name)];
  const limits = answer.limits.map((row) => [[row.symbol, row.name], [row.bound], ...row.values.map((value, k) => {
    const slack = row.slack[k], words = { missed: slack ? `by ${slack}` : "missed", active: "active", unknown: "?" }[row.states[k]];
    return [value, "", words ?? (slack ? `${slack} to spare` : "met"), `state ${row.states[k]}`];
  })]);
  const outputs = answer.outputs.map((row) => [[row.symbol, row.text], ...row.values.map((value, k) => [value, "", row.fast[k], "fast"])]);
  const frame = by("limits").parentElement;
  frame.hidden = frame.previousElementSibling.hidden = !limits.length;
  table(by("limits"), ["limit", "required", ...heads], limits, 2);
  table(by("outputs"), ["output", ...heads], outputs, 1);
  answer.outputs.forEach((row, k) => { by("outputs").tBodies[0].rows[k].cells[1].dataset.output = row.name; });
}

// Cells are [text, title, words below, their class], the first `plain` of a row words and the others numbers. A table of the
// same shape keeps its cells, and only what is new is written: laying a table out anew costs more than computing it.
function table(host, heads, lines, plain) {
  const words = pins.length || host.id === "limits" ? heads : ["output", ""], shape = JSON.stringify([words, lines.length]);
  if (host.dataset.shape !== shape) {
    host.replaceChildren();
    const top = made("tr", made("thead", host)), body = made("tbody", host);
    words.forEach((text, k) => made("th", top, { textContent: text, className: k < plain ? "" : k > plain ? `n pin-${k - plain}` : "n" }));
    for (const line of lines) {
      const row = made("tr", body);
      line.forEach((_, k) => {
        const cell = made("td", row, { className: k < plain ? "" : "n" });
        cell.append("");
        if (k >= plain) made("span", cell).append("");
      });
    }
    host.dataset.shape = shape;
  }
  lines.forEach((line, j) => line.forEach(([text, title = "", below = "", kind = ""], k) => {
    const cell = host.tBodies[0].rows[j].cells[k], small = cell.lastElementChild;
    tell(cell.firstChild, text);
    if (cell.title !== title) cell.title = title;
    if (!small) return;
    tell(small.firstChild, below);
    write(small, "class", kind);
  }));
}

function keep() {
  note = "";
  past.push({ ...design });
  by("undo").disabled = false;
}

function take(other, text) {
  keep();
  note = text;
  design = { ...design, ...other };
  steady = false;
  for (const range of page.ranges) put(range);
  return renew();
}

// Write a dimension into its field; a slider whose range is too narrow is widened, but not to values that are refused.
function put(range) {
  const row = rows[range.name], wide = Math.abs(range.high - range.low) * range.factor;
  const exact = design[range.name] * range.factor, value = Math.abs(exact) < 1e-12 * wide ? 0 : exact; // rounding of zero
  row.field.value = Number(value.toPrecision(7));
  if (!row.slider) return;
  if (!range.positive || value > 0) {
    const ends = [Math.min(Number(row.slider.min), value), Math.max(Number(row.slider.max), value)];
    [row.slider.min, row.slider.max] = ends;
  }
  row.slider.value = value;
}

// Dimensions of one kind stand together; those groups are open at first in which something is swept.
function group(name) {
  const own = page.ranges.filter((range) => range.group === name);
  if (own.length === page.ranges.length) return by("dimensions");
  const swept = page.ranges.filter((range) => range.swept), first = swept.length ? swept : page.ranges.slice(0, 1);
  const host = made("details", by("dimensions"), { open: first.some((range) => range.group === name) });
  const head = made("summary", host, { textContent: `${name} ` });
  made("small", head, { textContent: String(own.length) });
  return host;
}

const groups = {};
function addDimension(range) {
  const home = (groups[range.group] ??= group(range.group));
  const host = made("div", home, { className: "dimension" }), id = `d-${range.name}`;
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
  note = "";
  by("undo").disabled = !past.length;
  for (const range of page.ranges) {
    const { slider } = rows[range.name];
    if (slider) [slider.min, slider.max] = [range.low * range.factor, range.high * range.factor];
    put(range);
  }
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
        const held = line.active?.length ? `; held back by ${line.active.join(", ")}` : "";
        const how = { converged: "converged", time: "stopped" }[line.ended] ?? "not converged";
        const end = `${line.feasible ? how : `misses ${line.missed?.join(", ")}`} after ${line.looks} evaluations${held}`;
        if (line.design) await take(line.design, end);
        else say(`searching: ${line.looks} evaluations, ${line.seconds.toFixed(1)} s`);
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

const PLOT = { wide: 400, high: 280, left: 52, bottom: 34, top: 8, right: 8 }, FIELD = 48;
const RAILS = { wide: 400, high: 230, side: 24, top: 30, bottom: 20, bins: 24, most: 8, shades: 5 };

// Feasible designs, counted by the server: one pair of columns as cells, several beside each other as bands between
// axes. A range on an axis holds for both.
class Cells {
  constructor() {
    for (const [id, chosen] of [["across", page.columns.at(-1)], ["up", page.objective ?? page.columns[0]]]) {
      for (const name of page.columns) made("option", by(id), { textContent: name, selected: name === chosen });
      by(id).addEventListener("change", () => this.load());
    }
    const first = page.objective ? [page.objective] : [];
    this.rails = [...new Set([...page.swept, ...first, ...page.columns])].slice(0, RAILS.most);
    this.ranges = {};
    this.frame = by("cells");
    this.frame.setAttribute("viewBox", `0 0 ${PLOT.wide} ${PLOT.high}`);
    this.frame.addEventListener("keydown", (event) => this.key(event));
    by("rails").setAttribute("viewBox", `0 0 ${RAILS.wide} ${RAILS.high}`);
    by("rails").addEventListener("click", (event) => this.pick(event));
    this.load();
  }

  // Questions while one is under way become one.
  async load() {
    if (this.asking) { this.again = true; return; }
    this.asking = true;
    do {
      this.again = false;
      try {
        const { ranges, rails } = this, between = rails.slice(1).map((name, k) => [rails[k], name]);
        const pair = { pairs: [[by("across").value, by("up").value]], ranges, bins: FIELD };
        const [field, bands] = await Promise.all([pair, { pairs: between, ranges, bins: RAILS.bins }].map(
          async (what) => (await ask("cells", what)).json(),
        ));
        this.data = { ...field, axes: pair.pairs[0].map((name) => field.axes[name]), cells: field.pairs[0] };
        this.bands = bands;
        this.draw();
        this.drawRails();
      } catch (error) { say(error.message, true); }
    } while (this.again);
    this.asking = false;
  }

  box(across, up) {
    const [x, y] = this.data.axes, wide = (PLOT.wide - PLOT.left - PLOT.right) / FIELD;
    const high = (PLOT.high - PLOT.top - PLOT.bottom) / FIELD;
    const i = x.turned ? FIELD - 1 - across : across, j = y.turned ? FIELD - 1 - up : up;
    return { x: PLOT.left + i * wide, y: PLOT.high - PLOT.bottom - (j + 1) * high, width: wide, height: high };
  }

  draw() {
    this.frame.replaceChildren();
    this.here = null;
    const { kept, of } = this.data;
    by("count").textContent = kept === of ? `${of} designs` : `${kept} of ${of} designs`;
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

  // Places of the axes: a share of one, from its lower end, is a height.
  railAt(k) { return RAILS.side + ((RAILS.wide - 2 * RAILS.side) * k) / (this.rails.length - 1); }

  height(share) { return RAILS.high - RAILS.bottom - share * (RAILS.high - RAILS.top - RAILS.bottom); }

  middle(k, bin) {
    const share = (bin + 0.5) / RAILS.bins;
    return this.height(this.bands.axes[this.rails[k]].turned ? 1 - share : share);
  }

  drawRails() {
    const host = by("rails");
    host.replaceChildren();
    for (const [k, band] of this.bands.pairs.entries()) {
      const most = Math.log1p(Math.max(1, ...band.map((cell) => cell[2]))), texts = Array(RAILS.shades).fill("");
      for (const [i, j, count] of band) {
        const shade = Math.min(RAILS.shades - 1, Math.floor((RAILS.shades * Math.log1p(count)) / most));
        texts[shade] += `M${this.railAt(k).toFixed(1)} ${this.middle(k, i).toFixed(1)}L${this.railAt(k + 1).toFixed(1)} ${this.middle(k + 1, j).toFixed(1)}`;
      }
      texts.forEach((d, shade) => { if (d) svg("path", { d, opacity: (shade + 1) / RAILS.shades }, host); });
    }
    this.rails.forEach((name, k) => {
      const { symbol, ends } = this.bands.axes[name], x = this.railAt(k), range = this.ranges[name], top = k % 2 ? 22 : 10;
      svg("line", { class: "axis", x1: x, x2: x, y1: RAILS.top, y2: RAILS.high - RAILS.bottom }, host);
      const [edge, anchor] = k === 0 ? [0, "start"] : k === this.rails.length - 1 ? [RAILS.wide, "end"] : [x, "middle"];
      const label = svg("text", { x: edge, y: top, "text-anchor": anchor }, host);
      // Names of members begin alike, outputs end alike.
      const brief = page.swept.includes(name) ? `…${symbol.slice(-11)}` : `${symbol.slice(0, 10)}…${symbol.match(/[\d₀-₉]?$/)[0]}`;
      label.textContent = symbol.length > 12 ? brief : symbol;
      svg("title", {}, label).textContent = symbol;
      svg("text", { x, y: RAILS.high - 6, "text-anchor": "middle" }, host).textContent = short(ends[0], 3);
      if (range) {
        const [low, high] = range.map((value) => this.height((value - ends[0]) / (ends[1] - ends[0])));
        svg("rect", { class: "range", x: x - 6, width: 12, y: high, height: Math.max(low - high, 2) }, host);
      }
      const words = `${name}, ${short(ends[0])} to ${short(ends[1])}; arrows narrow the range, Delete clears it`;
      const hit = svg("rect", { class: "hit", x: x - 12, width: 24, y: RAILS.top - 4, height: RAILS.high - RAILS.top - RAILS.bottom + 8,
        tabindex: 0, role: "slider", "aria-label": words, "aria-valuetext": String(range ?? "all"), "data-axis": name }, host);
      hit.addEventListener("pointerdown", (event) => this.brush(event, name, hit));
      hit.addEventListener("keydown", (event) => this.narrow(event, name));
      if (this.focused === name) hit.focus({ preventScroll: true });
    });
  }

  // Draw along an axis to keep a range; a click on it clears it.
  brush(event, name, hit) {
    const { ends } = this.bands.axes[name], box = by("rails").getBoundingClientRect();
    const valueAt = (at) => {
      const y = ((at.clientY - box.top) / box.height) * RAILS.high, room = RAILS.high - RAILS.top - RAILS.bottom;
      return ends[0] + Math.min(Math.max((RAILS.high - RAILS.bottom - y) / room, 0), 1) * (ends[1] - ends[0]);
    };
    const from = valueAt(event);
    this.focused = name;
    delete this.ranges[name];
    const moved = (at) => {
      const to = valueAt(at);
      if (Math.abs(to - from) < 0.02 * (ends[1] - ends[0])) return;
      this.ranges[name] = [Math.min(from, to), Math.max(from, to)];
      this.load();
    };
    const ended = () => {
      window.removeEventListener("pointermove", moved);
      window.removeEventListener("pointerup", ended);
      this.load();
    };
    window.addEventListener("pointermove", moved);
    window.addEventListener("pointerup", ended);
    event.preventDefault();
  }

  narrow(event, name) {
    const { ends } = this.bands.axes[name], step = (ends[1] - ends[0]) / 10, [low, high] = this.ranges[name] ?? ends;
    const next = { ArrowUp: [low + step, high], ArrowDown: [low, high - step], Delete: null, Backspace: null }[event.key];
    if (next === undefined || (next && next[0] >= next[1])) return;
    event.preventDefault();
    this.focused = name;
    if (next) this.ranges[name] = next;
    else delete this.ranges[name];
    this.load();
  }

  // A click between two axes takes the best design of the nearest band.
  pick(event) {
    if (event.target.classList.contains("hit")) return;
    const box = by("rails").getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * RAILS.wide, y = ((event.clientY - box.top) / box.height) * RAILS.high;
    const k = this.rails.findIndex((_, n) => n > 0 && x < this.railAt(n)) - 1;
    if (k < 0) return;
    const share = (x - this.railAt(k)) / (this.railAt(k + 1) - this.railAt(k));
    const far = ([i, j]) => Math.abs((1 - share) * this.middle(k, i) + share * this.middle(k + 1, j) - y);
    const [best] = [...this.bands.pairs[k]].sort((a, b) => far(a) - far(b));
    if (best) this.take(best);
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
const picture = page.columns.length ? new Cells() : null;
