"use strict";
// The mechanism in three dimensions. A link is a bar between two joints, or a plate with bars round it; bars are moved
// to the pose of an angle. Colours are the page's, so that light and dark follow the reader's choice.

const UP = new THREE.Vector3(0, 0, 1);

// Pixels of a name: its height, and where it may stand from its joint, the upper left corner of it.
const LINE = 14;
const AROUND = (wide) => [[8, -20], [8, 4], [-8 - wide, -20], [-8 - wide, 4], [-wide / 2, -30], [-wide / 2, 14], [12, -8], [-12 - wide, -8]];

function colourOf(name) {
  return new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
}

// Coordinates of a joint at a share of the turn, between two poses; a fixed joint has one pose.
function jointAt(path, share, closed, into) {
  const poses = path.length / 3;
  if (poses === 1) return into.set(path[0], path[1], path[2]);
  const along = share * (closed ? poses : poses - 1);
  const k = Math.min(Math.floor(along), poses - 1), next = closed ? (k + 1) % poses : Math.min(k + 1, poses - 1);
  const f = along - k;
  return into.set(...[0, 1, 2].map((i) => (1 - f) * path[3 * k + i] + f * path[3 * next + i]));
}

class MechanismView {
  constructor(host, data) {
    this.host = host;
    this.data = data;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    host.append(this.renderer.domElement);
    this.labels = host.appendChild(document.createElement("div"));
    this.labels.className = "labels";
    this.camera = new THREE.PerspectiveCamera(24, 1, 0.01 * data.size, 100 * data.size);
    this.controls = new THREE.OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    // One finger or the wheel alone scroll the page; two fingers, or the wheel with Ctrl, bring the mechanism nearer.
    this.renderer.domElement.style.touchAction = "pan-y";
    host.addEventListener("wheel", (event) => { this.controls.enableZoom = event.ctrlKey; }, { capture: true });
    this.share = 0;
    this.named = true;
    new ResizeObserver(() => this.resize()).observe(host);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.show(this.index));
  }

  // Build the design of a number; a later one is seen from where the camera is. Another design of the same parts moves
  // what stands there already.
  show(index) {
    const first = this.index === undefined, seen = [index, ...(this.data.ghosts ?? [])];
    const own = seen.flatMap((k) => this.data.designs[k].parts);
    const shape = JSON.stringify(own.map((part) => [part.label, part.links, part.kinds, Object.keys(part.joints)]));
    this.index = index;
    if (this.data.steady && shape === this.shape) {
      this.sources.forEach((source, k) => {
        source.group.position.set(...own[k].shift);
        for (const [name, text] of Object.entries(own[k].joints)) source.paths[name] = numbersOf(text);
        Object.assign(source.axes, own[k].axes);
      });
      for (const renew of this.renewals) renew();
      return;
    }
    this.shape = shape;
    [this.sources, this.renewals] = [[], []];
    this.scene?.traverse((old) => old.geometry?.dispose()); // programs of materials are kept: they take long to compile
    this.scene = new THREE.Scene();
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8090a0, 2.2));
    const sun = new THREE.DirectionalLight(0xffffff, 1.8);
    sun.position.set(0.4, 1, 1.2);
    this.scene.add(sun);
    this.labels.replaceChildren();
    this.movers = [];
    this.points = [];
    this.size = this.data.designs[index].size;
    this.thick = 0.012 * this.size;
    for (const part of this.data.designs[index].parts) this.addPart(part);
    for (const other of this.data.ghosts ?? []) for (const part of this.data.designs[other].parts) this.addGhost(part);
    if (first) this.look("space");
    // The eye stays where it is while a dimension changes, and the caller sets the angle.
    else if (!this.data.steady) this.fit(this.camera.position.clone().sub(this.controls.target));
  }

  // Paths and axes of a part, which change where the dimensions do.
  source(part, group) {
    group.position.set(...part.shift);
    this.scene.add(group);
    const paths = Object.fromEntries(Object.entries(part.joints).map(([name, text]) => [name, numbersOf(text)]));
    this.sources.push({ group, paths, axes: { ...part.axes } });
    return this.sources[this.sources.length - 1];
  }

  addPart(part) {
    const group = new THREE.Group();
    const { paths, axes } = this.source(part, group);
    const at = (name) => (share) => jointAt(paths[name], share, this.data.closed, new THREE.Vector3());
    part.links.forEach((link, k) => this.addLink(group, part, link, colourOf(`--link-${k % 6}`), at));
    for (const name of Object.keys(paths)) {
      this.addJoint(group, name, name in part.kinds, at(name), part.label);
      if (!(name in part.kinds)) this.addPath(group, () => paths[name]);
    }
    for (const name of Object.keys(axes)) this.addAxis(group, () => new THREE.Vector3(...axes[name]), at(name));
    if (part.label) {
      const low = new THREE.Vector3(Infinity, Infinity, 0);
      for (const path of Object.values(paths)) {
        for (let i = 0; i < path.length; i += 3) {
          if (path[i] < low.x) low.x = path[i];
          if (path[i + 1] < low.y) low.y = path[i + 1];
        }
      }
      low.y -= 0.08 * this.size;
      this.addLabel(part.label, group, () => low, "frame");
    }
  }

  // A design that is seen together with another one: thin lines in its own colour.
  addGhost(part) {
    const group = new THREE.Group();
    const { paths } = this.source(part, group);
    const material = new THREE.LineBasicMaterial({ color: colourOf("--orange") });
    for (const link of part.links) {
      const shape = new THREE.BufferGeometry(), ends = link.joints;
      const place = new THREE.Float32BufferAttribute(new Float32Array(3 * ends.length), 3);
      shape.setAttribute("position", place);
      const line = new THREE.LineLoop(shape, material);
      line.frustumCulled = false;
      group.add(line);
      const point = new THREE.Vector3();
      this.movers.push((share) => {
        ends.forEach((name, i) => place.setXYZ(i, ...jointAt(paths[name], share, this.data.closed, point)));
        place.needsUpdate = true;
      });
    }
  }

  addLink(group, part, link, colour, at) {
    const material = new THREE.MeshStandardMaterial({ color: colour, metalness: 0.15, roughness: 0.5 });
    const ends = link.joints.map(at);
    if (ends.length === 1) return this.addBlock(group, part, ends[0], material);
    const pairs = ends.slice(1).map((end, i) => [ends[i], end]);
    if (ends.length > 2) pairs.push([ends[ends.length - 1], ends[0]]);
    const shape = new THREE.CylinderGeometry(1, 1, 1, 20).translate(0, 0.5, 0).rotateX(Math.PI / 2);
    for (const [from, to] of pairs) {
      const bar = new THREE.Mesh(shape, material);
      group.add(bar);
      this.movers.push((share) => {
        const start = from(share), along = to(share).sub(start), length = along.length();
        bar.visible = length > 1e-9 * this.size;
        bar.position.copy(start);
        bar.scale.set(this.thick, this.thick, Math.max(length, 1e-12));
        if (bar.visible) bar.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
      });
    }
    if (ends.length === 3) this.addPlate(group, colour, ends);
    return undefined;
  }

  addPlate(group, colour, ends) {
    const shape = new THREE.BufferGeometry();
    const place = new THREE.Float32BufferAttribute(new Float32Array(9), 3);
    const normal = new THREE.Float32BufferAttribute(new Float32Array(9), 3);
    shape.setAttribute("position", place);
    shape.setAttribute("normal", normal);
    const material = new THREE.MeshStandardMaterial({
      color: colour, transparent: true, opacity: 0.35, side: THREE.DoubleSide, depthWrite: false,
    });
    const plate = new THREE.Mesh(shape, material);
    plate.frustumCulled = false;
    group.add(plate);
    this.movers.push((share) => {
      const [a, b, c] = ends.map((end) => end(share));
      [a, b, c].forEach((point, i) => place.setXYZ(i, point.x, point.y, point.z));
      const n = b.sub(a).cross(c.sub(a)).normalize();
      [0, 1, 2].forEach((i) => normal.setXYZ(i, n.x, n.y, n.z));
      place.needsUpdate = normal.needsUpdate = true;
    });
  }

  // A slider: a block that keeps the direction of the line it moves along.
  addBlock(group, part, at, material) {
    const slide = Object.keys(part.kinds).find((name) => part.kinds[name] === "slide");
    const block = new THREE.Mesh(new THREE.BoxGeometry(4, 4, 8), material);
    block.scale.setScalar(this.thick);
    const { axes } = this.sources[this.sources.length - 1];
    const stand = () => { if (slide !== undefined) block.quaternion.setFromUnitVectors(UP, new THREE.Vector3(...axes[slide])); };
    stand();
    this.renewals.push(stand);
    group.add(block);
    this.movers.push((share) => block.position.copy(at(share)));
  }

  // Let joints be dragged in the plane: told are label, joint, place in the part's frame, and whether it is the first.
  grab(told) {
    const canvas = this.renderer.domElement;
    let held = null;
    const near = (event) => {
      if (!this.data.draggable) return null;
      const box = canvas.getBoundingClientRect();
      const far = (point) => {
        const place = point.at(this.share).clone().applyMatrix4(point.group.matrixWorld).project(this.camera);
        return Math.hypot(((place.x + 1) * box.width) / 2 - event.clientX + box.left, ((1 - place.y) * box.height) / 2 - event.clientY + box.top);
      };
      const [best] = this.points.filter((point) => point.part !== undefined).sort((a, b) => far(a) - far(b));
      return best && far(best) < 16 ? best : null;
    };
    const under = (event) => {
      const box = canvas.getBoundingClientRect(), eye = this.camera.position;
      const x = ((event.clientX - box.left) / box.width) * 2 - 1, y = 1 - ((event.clientY - box.top) / box.height) * 2;
      const along = new THREE.Vector3(x, y, 0.5).unproject(this.camera).sub(eye), far = -eye.z / along.z;
      if (!(far > 0)) return null; // the plane is seen from its edge
      return [eye.x + far * along.x - held.group.position.x, eye.y + far * along.y - held.group.position.y];
    };
    canvas.addEventListener("pointerdown", (event) => {
      held = near(event);
      if (!held) return;
      this.controls.enabled = false;
      canvas.setPointerCapture(event.pointerId);
      told(null);
    }, { capture: true });
    canvas.addEventListener("pointermove", (event) => {
      canvas.style.cursor = held || near(event) ? "move" : "";
      const to = held && under(event);
      if (to) told({ part: held.part, joint: held.label.textContent, to });
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, () => { held = null; this.controls.enabled = true; });
    }
  }

  addJoint(group, name, fixed, at, part) {
    const material = new THREE.MeshStandardMaterial({ color: colourOf(fixed ? "--pivot" : "--joint"), roughness: 0.4 });
    const ball = new THREE.Mesh(new THREE.SphereGeometry((fixed ? 2 : 1.6) * this.thick, 24, 16), material);
    ball.name = name;
    group.add(ball);
    this.movers.push((share) => {
      const place = at(share);
      ball.visible = Number.isFinite(place.x + place.y + place.z);
      if (ball.visible) ball.position.copy(place);
    });
    this.addLabel(name, group, at, "joint", part);
  }

  addPath(group, path) {
    const shape = new THREE.BufferGeometry(), known = () => path().map((x) => (Number.isFinite(x) ? x : 0));
    const place = new THREE.Float32BufferAttribute(known(), 3);
    shape.setAttribute("position", place);
    this.renewals.push(() => { place.copyArray(known()); place.needsUpdate = true; });
    const material = new THREE.LineBasicMaterial({ color: colourOf("--path") });
    const line = this.data.closed ? new THREE.LineLoop(shape, material) : new THREE.Line(shape, material);
    line.frustumCulled = false;
    group.add(line);
  }

  addAxis(group, axis, at) {
    const material = new THREE.MeshStandardMaterial({ color: colourOf("--pivot") });
    const reach = 0.12 * this.size;
    const shape = new THREE.CylinderGeometry(0.35 * this.thick, 0.35 * this.thick, 2 * reach, 12).rotateX(Math.PI / 2);
    const rod = new THREE.Mesh(shape, material);
    group.add(rod);
    const stand = () => { rod.position.copy(at(0)); rod.quaternion.setFromUnitVectors(UP, axis()); };
    stand();
    this.renewals.push(stand);
  }

  addLabel(text, group, at, kind, part) {
    const label = this.labels.appendChild(document.createElement("span"));
    label.textContent = text;
    label.className = kind;
    this.points.push({ label, group, at, part });
  }

  // Move everything to a share of the turn, 0 to 1.
  pose(share) {
    this.share = share;
    for (const move of this.movers) move(share);
    this.draw();
  }

  // Turn the camera: "front" along z, "side" along x, "top" along y, "space" from a corner.
  look(from) {
    this.fit(new THREE.Vector3(...{ front: [0, 0, 1], side: [1, 0, 0.001], top: [0, 1, 0.001], space: [0.5, 0.4, 1] }[from]));
  }

  // Bring the design as near as the picture holds it over the whole turn, seen from a direction.
  fit(towards) {
    towards.normalize();
    const right = new THREE.Vector3(0, 1, 0).cross(towards).normalize(), up = towards.clone().cross(right);
    const sides = [right, up, towards], low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const place = new THREE.Vector3();
    const seen = [this.index, ...(this.data.ghosts ?? [])].flatMap((k) => this.data.designs[k].parts);
    for (const part of seen) {
      for (const path of Object.values(part.joints).map(numbersOf)) {
        for (let i = 0; i < path.length; i += 3) {
          place.set(path[i] + part.shift[0], path[i + 1] + part.shift[1], path[i + 2] + part.shift[2]);
          sides.forEach((side, k) => {
            const x = place.dot(side);
            if (x < low[k]) low[k] = x;
            if (x > high[k]) high[k] = x;
          });
        }
      }
    }
    const centre = new THREE.Vector3();
    sides.forEach((side, k) => centre.addScaledVector(side, (low[k] + high[k]) / 2));
    const half = sides.map((_, k) => (high[k] - low[k]) / 2 + 0.09 * this.size);
    const slope = Math.tan((this.camera.fov * Math.PI) / 360);
    const away = half[2] + Math.max(half[1] / slope, half[0] / (slope * this.camera.aspect));
    this.camera.position.copy(centre).addScaledVector(towards, away);
    this.controls.target.copy(centre);
    this.controls.update();
    this.pose(this.share);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    const before = this.camera.aspect;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (Math.abs(before - this.camera.aspect) > 0.01) this.look("space");
    else this.draw();
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
    const { clientWidth: width, clientHeight: height } = this.host;
    const taken = [];
    // Joints before the parts they belong to. A name that would cover another one stands beside it; what finds no free
    // place, or stands there already, is left out.
    for (const { label, group, at } of [...this.points].sort((a, b) => (a.part === undefined) - (b.part === undefined))) {
      const place = at(this.share).clone().applyMatrix4(group.matrixWorld).project(this.camera);
      const text = label.textContent, wide = 7.5 * text.length + 4;
      const x = ((place.x + 1) * width) / 2, y = ((1 - place.y) * height) / 2;
      const clear = ([dx, dy]) => x + dx >= 0 && x + dx + wide <= width && y + dy >= 0 && y + dy + LINE <= height &&
        !taken.some((other) => Math.abs(other.y - y - dy) < LINE && x + dx < other.x + other.wide && other.x < x + dx + wide);
      const known = taken.some((other) => other.text === text && Math.hypot(other.joint.x - x, other.joint.y - y) < 1.5 * LINE);
      const beside = this.named && Number.isFinite(place.x) && !known && AROUND(wide).find(clear);
      label.style.display = beside ? "" : "none";
      if (!beside) continue;
      taken.push({ x: x + beside[0], y: y + beside[1], wide, text, joint: { x, y } });
      label.style.transform = `translate(${x + beside[0]}px, ${y + beside[1]}px)`;
    }
  }
}
