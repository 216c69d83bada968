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

// One mechanism with its curves; later data may take the place of the first, and the angle stays.
class Moving {
  constructor(host, data) {
    this.host = host;
    [this.share, this.index, this.turning, this.back, this.before] = [0, 0, false, false, null];
    // The mechanism rests where the reader asks for little motion, and while it is out of sight.
    this.wanted = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    host.hidden = false;
    document.body.classList.add("alive");
    [this.slider, this.said, this.button] = ["input[type=range]", ".angle", ".play"].map((name) => this.find(name));
    if (data.size > 0 && hasWebGL()) {
      document.body.classList.add("spatial");
      this.view = host.view = new MechanismView(this.find(".view"), data); // of the host for whoever looks in
    }
    this.find(".designs")?.addEventListener("change", (event) => this.choose(Number(event.target.value)));
    this.slider.addEventListener("input", () => { this.rest(); this.set(Number(this.slider.value)); });
    this.button.addEventListener("click", () => { this.wanted = !this.turning; this.turn(this.wanted); });
    this.find(".names input").addEventListener("change", (event) => {
      this.view.named = event.target.checked;
      this.view.draw();
    });
    for (const look of host.querySelectorAll("[data-look]")) {
      look.addEventListener("click", () => this.view.look(look.dataset.look));
    }
    this.replace(data);
    new IntersectionObserver(([seen]) => this.turn(this.wanted && seen.isIntersecting)).observe(this.find(".stage"));
  }

  find(name) { return this.host.querySelector(name); }

  replace(data) {
    this.data = data;
    for (const design of data.designs) {
      design.phi = numbersOf(design.phi);
      design.values = Object.fromEntries(Object.entries(design.curves).map(([name, text]) => [name, numbersOf(text)]));
    }
    data.ends = data.closed ? [0, 360] : [data.designs[0].phi[0], data.designs[0].phi[data.designs[0].phi.length - 1]];
    const { axis, ends, designs } = data, roles = designs.map((design) => design.role);
    const asked = JSON.stringify([axis, ends, roles, data.curves.map(({ name, title, unit }) => [name, title, unit])]);
    if (asked === this.asked) this.panels.forEach((panel, k) => panel.renew(data.curves[k], data));
    else {
      this.find(".panels").replaceChildren();
      this.panels = data.curves.map((curve) => {
        return new Panel(this.find(".panels"), curve, data, (to) => { this.rest(); this.set(to); });
      });
    }
    this.asked = asked;
    if (this.view) this.view.data = data;
    this.choose(Math.min(this.index, data.designs.length - 1));
  }

  set(to) {
    this.share = to;
    this.slider.value = to;
    const { data } = this, phi = data.designs[this.index].phi, here = data.ends[0] + to * (data.ends[1] - data.ends[0]);
    const own = data.closed ? (((phi[0] + 360 * to) % 360) + 360) % 360 : between(phi, to, false);
    tell(this.said.firstChild, data.closed ? `${here.toFixed(1)}° (φ = ${own.toFixed(1)}°)` : `${short(own)} ${data.unit}`);
    if (this.view) this.view.pose(to);
    for (const panel of this.panels) panel.pose(to);
  }

  // Crank angle of the chosen design in the picture [rad]; the picture is turned to one.
  get phi() { return (this.data.designs[this.index].phi[0] * Math.PI) / 180 + 2 * Math.PI * this.share; }

  set phi(angle) {
    const share = (angle - (this.data.designs[this.index].phi[0] * Math.PI) / 180) / (2 * Math.PI);
    this.set(share - Math.floor(share));
  }

  choose(to) {
    this.index = to;
    tell(this.find(".note").firstChild, this.data.designs[to].note);
    if (this.view) this.view.show(to);
    for (const panel of this.panels) panel.show(to);
    this.set(this.share);
  }

  step(now) {
    if (!this.turning) return;
    const past = this.before === null ? 0 : Math.min((now - this.before) / 1000 / TURN_SECONDS, 0.1);
    this.before = now;
    let to = this.share + (this.back ? -past : past);
    if (this.data.closed) to %= 1;
    else if (to > 1 || to < 0) [this.back, to] = [to > 1, Math.min(Math.max(to, 0), 1)];
    this.set(to);
    requestAnimationFrame((later) => this.step(later));
  }

  turn(on) {
    if (this.turning === on) return;
    this.turning = on;
    this.before = null;
    this.button.textContent = on ? "pause" : "turn";
    this.button.setAttribute("aria-pressed", on);
    if (on) requestAnimationFrame((now) => this.step(now));
  }

  rest() {
    this.wanted = false;
    this.turn(false);
  }
}

const motion = jsonOf("motion-data"), lines = jsonOf("lines-data");
if (motion) new Moving(document.getElementById("live"), motion);
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
