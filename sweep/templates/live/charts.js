"use strict";
// Curves over the turn as small panels with one cursor. Pointing into a panel moves the cursor.

const WIDE = 340, HIGH = 172, LEFT = 46, RIGHT = 14, TOP = 8, BOTTOM = 34;
const TENTH = 0.1; // unit of the curves' paths: whole numbers are written in a tenth of the time

// Numbers that Python has packed as base64 of float32.
function numbersOf(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k += 1) bytes[k] = raw.charCodeAt(k); // Uint8Array.from takes twenty times as long
  return new Float32Array(bytes.buffer);
}

// Write what is new: an attribute or a text that is written again is laid out and painted again.
function write(element, name, value) {
  if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}

function tell(node, text) {
  if (node.data !== text) node.data = text;
}

function svg(name, attributes, parent) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (parent) parent.append(made);
  return made;
}

function short(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    const [mantissa, power] = value.toExponential(digits - 2).split("e");
    const raised = [...String(Number(power))].map((c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c])).join("");
    return `${Number(mantissa)}·10${raised}`.replace("-", "−");
  }
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

function withUnit(text, unit) {
  if (!unit || text === "–") return text;
  return unit === "°" ? text + unit : `${text} ${unit}`;
}

// Round numbers between two ends, three to seven of them: the widest step of 1, 2, 5 that has three.
function ticksBetween(low, high) {
  const power = 10 ** Math.floor(Math.log10(high - low));
  for (const step of [5, 2, 1, 0.5, 0.2].map((x) => x * power)) {
    const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
    if (last - first >= 2) return Array.from({ length: last - first + 1 }, (_, k) => (first + k) * step);
  }
  return [low, high];
}

class Panel {
  constructor(host, curve, data, chosen) {
    const box = host.appendChild(document.createElement("figure"));
    box.className = "panel";
    const head = box.appendChild(document.createElement("figcaption"));
    head.innerHTML = "<b></b> <output> </output>";
    head.firstChild.textContent = curve.unit ? `${curve.title} [${curve.unit}]` : curve.title;
    this.value = head.querySelector("output").firstChild;
    this.frame = svg("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, role: "img", "aria-label": curve.title }, box);
    this.turn = svg("g", {}, this.frame);
    this.grid = svg("path", { class: "grid" }, this.frame);
    this.scale = svg("g", {}, this.frame);
    this.shade = svg("path", { class: "shade" }, this.frame);
    const clip = `clip-${curve.name.replace(/[^a-z0-9]/gi, "-")}`;
    const field = svg("clipPath", { id: clip }, this.frame);
    svg("rect", { x: LEFT, y: TOP, width: WIDE - LEFT - RIGHT, height: HIGH - TOP - BOTTOM }, field);
    const inside = svg("g", { "clip-path": `url(#${clip})` }, this.frame);
    this.bounds = svg("path", { class: "limit" }, inside);
    this.curves = svg("g", { class: "curves", transform: `scale(${TENTH})` }, inside);
    this.lines = data.designs.map((design) => svg("path", { class: design.role }, this.curves));
    this.cursor = svg("line", { class: "cursor", y1: TOP, y2: HIGH - BOTTOM }, this.frame);
    this.dot = svg("circle", { class: "dot", r: 3.5 }, inside);
    this.frame.addEventListener("pointerdown", (event) => { this.follow(event, chosen); });
    this.frame.addEventListener("pointermove", (event) => { if (event.buttons) this.follow(event, chosen); });
    this.data = data;
    this.drawTurn();
    this.renew(curve, data);
  }

  // Draw the curve of later designs in the same panel: a slider calls for it many times a second.
  renew(curve, data) {
    [this.curve, this.data] = [curve, data];
    const [low, high] = curve.range;
    const room = high - low > 1e-12 * Math.max(Math.abs(low), Math.abs(high)) ? 0.06 * (high - low) : Math.abs(high) || 1;
    [this.low, this.high] = [low - room, high + room];
    this.drawScale();
    write(this.bounds, "d", this.across(curve.limits));
    this.lines.forEach((line, k) => write(line, "d", this.path(data.designs[k])));
  }

  follow(event, chosen) {
    const box = this.frame.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * WIDE;
    chosen(Math.min(Math.max((x - LEFT) / (WIDE - LEFT - RIGHT), 0), 1));
  }

  x(share) { return LEFT + share * (WIDE - LEFT - RIGHT); }

  y(value) { return TOP + ((this.high - value) / (this.high - this.low)) * (HIGH - TOP - BOTTOM); }

  // Lines from side to side.
  across(values) { return values.map((value) => `M${LEFT} ${this.y(value)}H${WIDE - RIGHT}`).join(""); }

  drawScale() {
    const marks = ticksBetween(this.low, this.high), texts = this.scale.children;
    write(this.grid, "d", this.across(marks));
    while (texts.length < marks.length) svg("text", { x: LEFT - 5, "text-anchor": "end" }, this.scale).append("");
    while (texts.length > marks.length) this.scale.lastChild.remove();
    marks.forEach((value, k) => {
      write(texts[k], "y", this.y(value) + 3.5);
      tell(texts[k].firstChild, short(value));
    });
  }

  drawTurn() {
    const { ends, closed } = this.data;
    const marks = closed ? [0, 90, 180, 270, 360] : ticksBetween(...ends);
    for (const mark of marks) {
      const x = this.x((mark - ends[0]) / (ends[1] - ends[0]));
      svg("line", { class: "grid", x1: x, x2: x, y1: TOP, y2: HIGH - BOTTOM }, this.turn);
      svg("text", { x, y: HIGH - BOTTOM + 14, "text-anchor": "middle" }, this.turn).textContent = short(mark);
    }
    const below = { x: (LEFT + WIDE - RIGHT) / 2, y: HIGH - 4, "text-anchor": "middle" };
    svg("text", below, this.turn).textContent = `${this.data.axis} [${this.data.unit}]`;
  }

  path(design) {
    const values = design.values[this.curve.name], last = this.data.closed ? values.length : values.length - 1;
    let text = "", pen = "M";
    for (let k = 0; k <= last; k += 1) {
      const value = values[k % values.length];
      // A position that turns fully does not close: its last step is left out.
      if (k === values.length && Math.abs(value - values[k - 1]) > 0.5 * (this.high - this.low)) break;
      if (Number.isFinite(value)) text += `${pen}${Math.round(this.x(k / last) / TENTH)} ${Math.round(this.y(value) / TENTH)}`;
      pen = Number.isFinite(value) ? "L" : "M";
    }
    return text;
  }

  show(index) {
    this.index = index;
    this.lines.forEach((line, k) => line.classList.toggle("chosen", k === index));
    if (this.curves.lastChild !== this.lines[index]) this.curves.append(this.lines[index]);
    if (this.curve.name !== "dev") return;
    const { phi, shaded } = this.data.designs[index], at = (pose) => this.x(pose / phi.length);
    const boxes = shaded.map(([first, last]) => `M${at(first)} ${TOP}H${at(last + 1)}V${HIGH - BOTTOM}H${at(first)}Z`);
    write(this.shade, "d", boxes.join(""));
  }

  pose(share) {
    const values = this.data.designs[this.index].values[this.curve.name];
    const value = between(values, share, this.data.closed, 0.5 * (this.high - this.low));
    const x = this.x(share), { unit, fast, range } = this.curve;
    // What is this small beside the curve is the rounding of zero.
    const shown = Math.abs(value) < 1e-9 * Math.max(...range.map(Math.abs)) ? 0 : value;
    write(this.cursor, "x1", x);
    write(this.cursor, "x2", x);
    this.dot.style.display = Number.isFinite(value) ? "" : "none";
    write(this.dot, "cx", x);
    write(this.dot, "cy", Number.isFinite(value) ? this.y(value) : 0);
    const also = fast && Number.isFinite(shown) ? ` = ${withUnit(short(shown * fast.factor), fast.unit)}` : "";
    tell(this.value, withUnit(short(shown), unit) + also);
  }
}

// A curve's value at a share of the turn, between two poses. A position that turns fully goes on beyond the last one: it
// would have to jump by more than `most` to close.
function between(values, share, closed, most = Infinity) {
  const along = share * (closed ? values.length : values.length - 1), k = Math.min(Math.floor(along), values.length - 1);
  const next = closed ? (k + 1) % values.length : Math.min(k + 1, values.length - 1);
  const goes = next === 0 && Math.abs(values[0] - values[k]) > most, end = goes ? 2 * values[k] - values[k - 1] : values[next];
  return (1 - along + k) * values[k] + (along - k) * end;
}
