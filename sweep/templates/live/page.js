"use strict";
// Joins what moves: one angle for the mechanism, the slider and the cursors of all curves.

const TURN_SECONDS = 6;

function jsonOf(id) {
  const found = document.getElementById(id);
  return found && JSON.parse(found.textContent);
}

function hasWebGL() {
  return document.createElement("canvas").getContext("webgl2") !== null;
}

function startMotion(data) {
  const host = document.getElementById("live");
  const find = (name) => host.querySelector(name);
  for (const design of data.designs) {
    design.phi = numbersOf(design.phi);
    design.values = Object.fromEntries(Object.entries(design.curves).map(([name, text]) => [name, numbersOf(text)]));
  }
  data.ends = data.closed ? [0, 360] : [data.designs[0].phi[0], data.designs[0].phi[data.designs[0].phi.length - 1]];
  host.hidden = false;
  document.body.classList.add("alive");
  const slider = find("input[type=range]"), said = find(".angle"), button = find(".play");
  // The mechanism rests where the reader asks for little motion, and while it is out of sight.
  let wanted = !matchMedia("(prefers-reduced-motion: reduce)").matches;
  let share = 0, index = 0, turning = false, back = false, before = null, view = null;

  const set = (to) => {
    share = to;
    slider.value = share;
    const phi = data.designs[index].phi, here = data.ends[0] + share * (data.ends[1] - data.ends[0]);
    const own = data.closed ? (((phi[0] + 360 * share) % 360) + 360) % 360 : between(phi, share, false);
    said.textContent = data.closed ? `${here.toFixed(1)}° (φ = ${own.toFixed(1)}°)` : `${short(own)} ${data.unit}`;
    if (view) view.pose(share);
    for (const panel of panels) panel.pose(share);
  };
  const panels = data.curves.map((curve) => new Panel(find(".panels"), curve, data, (to) => { rest(); set(to); }));
  const choose = (to) => {
    index = to;
    find(".note").textContent = data.designs[index].note;
    if (view) view.show(index);
    for (const panel of panels) panel.show(index);
    set(share);
  };
  const step = (now) => {
    if (!turning) return;
    const past = before === null ? 0 : Math.min((now - before) / 1000 / TURN_SECONDS, 0.1);
    before = now;
    let to = share + (back ? -past : past);
    if (data.closed) to %= 1;
    else if (to > 1 || to < 0) [back, to] = [to > 1, Math.min(Math.max(to, 0), 1)];
    set(to);
    requestAnimationFrame(step);
  };
  const turn = (on) => {
    if (turning === on) return;
    turning = on;
    before = null;
    button.textContent = on ? "pause" : "turn";
    button.setAttribute("aria-pressed", on);
    if (on) requestAnimationFrame(step);
  };
  const rest = () => {
    wanted = false;
    turn(false);
  };

  if (data.size > 0 && hasWebGL()) {
    document.body.classList.add("spatial");
    view = new MechanismView(find(".view"), data);
    host.view = view; // for whoever looks in from the console
  }
  find(".designs").addEventListener("change", (event) => choose(Number(event.target.value)));
  slider.addEventListener("input", () => { rest(); set(Number(slider.value)); });
  button.addEventListener("click", () => { wanted = !turning; turn(wanted); });
  find(".names input").addEventListener("change", (event) => { view.named = event.target.checked; view.draw(); });
  for (const look of host.querySelectorAll("[data-look]")) {
    look.addEventListener("click", () => view.look(look.dataset.look));
  }
  choose(0);
  new IntersectionObserver(([seen]) => turn(wanted && seen.isIntersecting)).observe(find(".stage"));
}

const motion = jsonOf("motion-data"), lines = jsonOf("lines-data");
if (motion) startMotion(motion);
if (lines) {
  document.getElementById("lines").hidden = false;
  new Lines(document.getElementById("lines"), lines);
}
// What is folded on the screen is open on paper.
window.addEventListener("beforeprint", () => {
  for (const folded of document.querySelectorAll("details:not([open])")) {
    folded.open = true;
    window.addEventListener("afterprint", () => { folded.open = false; }, { once: true });
  }
});
