"use strict";
// Feasible designs as lines over their dimensions and outputs. A range is brushed by drawing along an axis and cleared
// by a click on it; the lines within all ranges stay, and the best of them are listed.

const ROOM = { top: 48, bottom: 34, side: 46, high: 344, step: 92 }, LISTED = 5, LETTERS = 14;

// A name that is too long for the room of its axis is broken at the space before its last words that have room.
function inTwo(name) {
  const at = name.length > LETTERS ? name.indexOf(" ", name.length - LETTERS - 1) : -1;
  return at < 0 ? [name] : [name.slice(0, at), name.slice(at + 1)];
}

class Lines {
  constructor(host, data) {
    this.data = data;
    this.values = numbersOf(data.values);
    this.count = data.axes.length;
    this.ranges = data.axes.map(() => null);
    this.wide = 2 * ROOM.side + ROOM.step * (this.count - 1);
    const marks = data.designs.map((design) => numbersOf(design.values));
    this.ends = data.axes.map((_, axis) => this.endsOf(axis, marks));
    const scroll = host.querySelector(".scroll");
    this.frame = svg("svg", { viewBox: `0 0 ${this.wide} ${ROOM.high}`, style: `min-width: ${0.62 * this.wide}px; max-width: ${1.35 * this.wide}px` }, scroll);
    this.said = host.querySelector("output");
    this.table = host.querySelector("tbody");
    const group = svg("g", { class: "all" }, this.frame);
    this.drawn = data.numbers.map((_, row) => svg("path", { d: this.path(this.rowOf(row)) }, group));
    this.paint();
    data.designs.forEach((design, k) => svg("path", { d: this.path(marks[k]), class: `mark ${design.role}` }, this.frame));
    this.brushes = data.axes.map((axis, k) => this.addAxis(axis, k));
    this.brush();
  }

  rowOf(row) { return this.values.subarray(row * this.count, (row + 1) * this.count); }

  endsOf(axis, marks) {
    let [low, high] = [Infinity, -Infinity];
    for (let k = axis; k < this.values.length; k += this.count) {
      low = Math.min(low, this.values[k]);
      high = Math.max(high, this.values[k]);
    }
    for (const mark of marks) {
      if (Number.isFinite(mark[axis])) [low, high] = [Math.min(low, mark[axis]), Math.max(high, mark[axis])];
    }
    // What is this small beside the other end is the rounding of zero.
    return [low, high].map((end) => (Math.abs(end) < 1e-12 * (high - low) ? 0 : end));
  }

  x(axis) { return ROOM.side + ROOM.step * axis; }

  y(axis, value) {
    const [low, high] = this.ends[axis];
    return ROOM.high - ROOM.bottom - ((value - low) / (high - low)) * (ROOM.high - ROOM.top - ROOM.bottom);
  }

  path(values) {
    let text = "", pen = "M";
    for (let axis = 0; axis < this.count; axis += 1) {
      const known = Number.isFinite(values[axis]);
      if (known) text += `${pen}${this.x(axis)} ${this.y(axis, values[axis]).toFixed(1)}`;
      pen = known ? "L" : "M";
    }
    return text;
  }

  // Colour by the rank of the objective: the better a design, the nearer to the colour of the optimum.
  paint() {
    const of = this.data.objective;
    this.order = this.data.numbers.map((_, row) => row);
    if (of < 0) return;
    this.order.sort((a, b) => Math.abs(this.rowOf(a)[of]) - Math.abs(this.rowOf(b)[of]));
    this.order.forEach((row, rank) => {
      const share = Math.round(100 * (1 - rank / Math.max(this.order.length - 1, 1)));
      this.drawn[row].style.stroke = `color-mix(in oklab, var(--good) ${share}%, var(--bad))`;
    });
    // The best are drawn last, above the others.
    this.drawn[0].parentNode.append(...[...this.order].reverse().map((row) => this.drawn[row]));
  }

  addAxis(axis, k) {
    const x = this.x(k), { top, bottom, high } = ROOM;
    svg("line", { class: "axis", x1: x, x2: x, y1: top, y2: high - bottom }, this.frame);
    const words = [[withUnit(short(this.ends[k][1], 3), axis.unit), top - 7, ""],
      [withUnit(short(this.ends[k][0], 3), axis.unit), high - bottom + 14, ""]];
    inTwo(axis.symbol).reverse().forEach((part, line) => words.push([part, top - 22 - 13 * line, "name"]));
    for (const [text, y, kind] of words) {
      const label = svg("text", { x, y, "text-anchor": "middle", class: kind }, this.frame);
      label.textContent = text.length > LETTERS + 2 ? `${text.slice(0, LETTERS + 1)}…` : text;
      if (kind) svg("title", {}, label).textContent = axis.symbol;
    }
    const range = svg("rect", { class: "range", x: x - 7, width: 14, y: top, height: 0 }, this.frame);
    const hit = { class: "hit", x: x - 16, width: 32, y: top - 8, height: high - top - bottom + 16, "data-axis": axis.name };
    const area = svg("rect", hit, this.frame);
    let from = null;
    const valueAt = (event) => {
      const box = this.frame.getBoundingClientRect();
      const y = ((event.clientY - box.top) / box.height) * high;
      const share = (high - bottom - y) / (high - top - bottom);
      return this.ends[k][0] + Math.min(Math.max(share, 0), 1) * (this.ends[k][1] - this.ends[k][0]);
    };
    area.addEventListener("pointerdown", (event) => {
      from = valueAt(event);
      area.setPointerCapture(event.pointerId);
      this.ranges[k] = null;
      this.brush();
    });
    area.addEventListener("pointermove", (event) => {
      if (from === null) return;
      const to = valueAt(event);
      if (Math.abs(to - from) < 0.01 * (this.ends[k][1] - this.ends[k][0])) return;
      this.ranges[k] = [Math.min(from, to), Math.max(from, to)];
      this.brush();
    });
    for (const end of ["pointerup", "pointercancel"]) area.addEventListener(end, () => { from = null; });
    return range;
  }

  brush() {
    this.ranges.forEach((range, k) => {
      const y = range ? this.y(k, range[1]) : 0;
      this.brushes[k].setAttribute("y", y);
      this.brushes[k].setAttribute("height", range ? Math.max(this.y(k, range[0]) - y, 2) : 0);
    });
    const kept = this.order.filter((row) => {
      const values = this.rowOf(row);
      return this.ranges.every((range, k) => !range || (values[k] >= range[0] && values[k] <= range[1]));
    });
    const inside = new Set(kept);
    this.drawn.forEach((line, row) => line.classList.toggle("out", !inside.has(row)));
    const drawn = this.data.numbers.length, all = this.data.of > drawn ? `, taken from ${this.data.of}` : "";
    this.said.textContent = `Within all ranges: ${kept.length} of ${drawn} designs${all}.`;
    this.table.replaceChildren(...kept.slice(0, LISTED).map((row) => this.listed(row)));
  }

  listed(row) {
    const line = document.createElement("tr");
    for (const text of [this.data.numbers[row], ...[...this.rowOf(row)].map((value) => short(value))]) {
      line.appendChild(document.createElement("td")).textContent = text;
    }
    return line;
  }
}
