// The particles of a run in 3-D: snapshots, colours, contacts, a cut, and the numbers of one.

import {
  BufferGeometry, Color, Float32BufferAttribute, LineDashedMaterial,
  LineSegments, OrthographicCamera, Scene, Vector3, Vector4, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { GREY, PICKED, PULLED, PUSHED, RIGID, ROD, ofClass, ofNumber, rodWidth } from "./colours.js";
import { unpack } from "./data.js";
import { panel, short } from "./panel.js";
import { rods, spheres } from "./shapes.js";
import { isDark, onTheme } from "./theme.js";
import { Triad } from "./triad.js";

const VIEWS = {
  oblique: [-0.45, -1, 0.45], front: [0, -1, 0], side: [1, 0, 0], top: [0, 0, 1], bottom: [0, 0, -1],
};
// twelve edges of a box by the corners at their ends, each the lower (0) or upper (1) side of x, y, z
const EDGES = [0, 1, 2].flatMap((axis) =>
  [[0, 0], [0, 1], [1, 0], [1, 1]].flatMap(([a, b]) =>
    [0, 1].map((end) => [0, 1, 2].map((n) => (n === axis ? end : n === (axis + 1) % 3 ? a : b))),
  ),
);
const EDGE = 36; // pixels above and below the particles, for what is written over them
const PAPER = { light: 0xffffff, dark: 0x171b21 }, LINES = { light: 0x777777, dark: 0x9aa3b1 };
const RIM = { light: 0, dark: 0.2 }; // light added at the edge of a sphere

export class Viewer {
  // host: an element; data: see dusttaichi/report/viewer_particles.py
  static async open(host, data) {
    const arrays = { position: await unpack(data.position), radius: await unpack(data.radius) };
    arrays.quantities = await Promise.all(data.quantities.map((q) => unpack(q.data)));
    if (data.pairs) {
      arrays.ends = await unpack(data.pairs.ends);
      arrays.force = data.pairs.force ? await unpack(data.pairs.force) : null;
    }
    return new Viewer(host, data, arrays);
  }

  constructor(host, data, arrays) {
    Object.assign(this, { host, data, arrays, count: data.count, frame: data.frames - 1 });
    this.state = {
      quantity: data.colour ?? 0, show: "particles", plane: "none", share: 0.5,
      playing: false, picked: -1,
    };
    this.shows = [["particles", data.word]]; // what may be shown, and its name
    if (data.pairs) this.shows.push(["contacts", "contacts"]);
    if (data.pairs?.force) this.shows.push(["forces", "force chains"]);
    this.held = {}; // what the buffers of the graphics card hold now
    this.firstPair = [0];
    for (const n of data.pairs ? data.pairs.counts : []) this.firstPair.push(this.firstPair.at(-1) + n);
    this.#openCanvas();
    this.panel = panel(this);
    this.endTheme = onTheme(() => this.#useTheme());
    this.#useTheme();
    this.look(data.view);
    this.update();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.canvas.parentElement);
  }

  #useTheme() {
    const name = isDark() ? "dark" : "light";
    this.renderer.setClearColor(new Color(PAPER[name]));
    this.room.material.color = new Color(LINES[name]);
    for (const shapes of [this.spheres, this.sphere]) shapes.uniforms.rim.value = RIM[name];
    this.draw();
  }

  close() {
    // a browser has room for some sixteen pictures in 3-D
    this.state.playing = false;
    this.closed = true;
    this.endTheme();
    this.observer.disconnect();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  #openCanvas() {
    const frame = document.createElement("div");
    frame.className = "viewer-frame";
    this.host.append(frame);
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.canvas = this.renderer.domElement;
    frame.append(this.canvas);
    this.triad = new Triad(frame);
    this.scene = new Scene();
    this.camera = new OrthographicCamera(-1, 1, 1, -1, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.spheres = spheres(this.count);
    const most = this.data.pairs ? Math.max(...this.data.pairs.counts, 1) : 1;
    this.rods = rods(most);
    this.room = this.#lines();
    this.sphere = spheres(1); // a rigid one among the grains
    this.scene.add(this.spheres, this.rods, this.room, this.sphere);
    let down = [0, 0];
    this.canvas.addEventListener("pointerdown", (e) => (down = [e.clientX, e.clientY]));
    this.canvas.addEventListener("pointerup", (e) => {
      if (Math.hypot(e.clientX - down[0], e.clientY - down[1]) < 4) this.pick(e);
    });
  }

  // The edges of the room, dashed where something is periodic.
  #lines() {
    const dash = 0.015 * new Vector3().subVectors(...this.ends()).length();
    const periodic = this.data.periodic.some(Boolean);
    const look = { color: 0x777777, dashSize: dash, gapSize: periodic ? dash : 0 };
    const lines = new LineSegments(new BufferGeometry(), new LineDashedMaterial(look));
    lines.frustumCulled = false;
    return lines;
  }

  // -- what is shown ----------------------------------------------------------------------------

  at(array, n) {
    // a number of particle n now: of an array with a row for each snapshot, or with one for all
    return array[(array.length > this.count ? this.frame * this.count : 0) + n];
  }

  centre(n, out = new Vector3()) {
    return out.fromArray(this.arrays.position, 3 * (this.frame * this.count + n));
  }

  update() {
    const { show } = this.state;
    const bare = show === "contacts" || show === "forces";
    this.#place(bare);
    this.#tint();
    this.#updateRods(bare, show === "forces");
    this.#updateSphere();
    this.#updateRoom();
    this.panel.refresh();
    this.draw();
  }

  // Whether a buffer of the graphics card holds something else than what is asked for.
  #stale(name, ...asked) {
    const key = asked.join();
    if (this.held[name] === key) return false;
    this.held[name] = key;
    return true;
  }

  // The snapshot, for an array that has one row for each of them; else nothing that changes.
  #row(array) {
    return array.length > this.count ? this.frame : -1;
  }

  #place(bare) {
    const { position, radius } = this.arrays;
    if (this.#stale("centre", this.frame)) {
      const first = 3 * this.frame * this.count;
      this.spheres.fill("centre", (to) => to.set(position.subarray(first, first + 3 * this.count)));
    }
    if (this.#stale("radius", bare, this.#row(radius))) {
      const share = bare ? 0.18 : 1;
      this.spheres.fill("radius", (to) => {
        for (let n = 0; n < this.count; n++) to[n] = share * this.at(radius, n);
      });
    }
    this.spheres.show(this.count);
  }

  #tint() {
    const { quantity, picked } = this.state;
    const about = this.data.quantities[quantity];
    const values = about && this.arrays.quantities[quantity];
    if (!this.#stale("tint", quantity, picked, about ? this.#row(values) : -1)) return;
    this.spheres.fill("tint", (tint) => {
      const [low, high] = about?.range || [0, 1];
      const gap = about?.data.gap ?? -Infinity; // below it there is none
      const scale = high > low ? 1 / (high - low) : 0;
      const first = about ? Math.max(this.#row(values), 0) * this.count : 0;
      for (let n = 0; n < this.count; n++) {
        const v = about ? values[first + n] : -Infinity;
        if (v < gap || !about) tint[n] = GREY;
        else tint[n] = about.kind === "class" ? ofClass(v) : ofNumber(scale ? (v - low) * scale : 0.5);
      }
      if (picked >= 0) tint[picked] = PICKED;
    });
  }

  #updateRods(there, byForce) {
    if (!there || !this.data.pairs) return this.rods.show(0);
    if (!this.#stale("rods", byForce, this.frame)) return this.rods.show(this.rodCount);
    const { ends, force, position, radius } = this.arrays;
    const most = this.data.pairs.largest || 1;
    const first = 3 * this.frame * this.count, x = position.subarray(first, first + 3 * this.count);
    const [from, to, width, tint] = ["from", "to", "width", "tint"].map((n) => this.rods.array(n));
    let rows = 0;
    for (let k = this.firstPair[this.frame]; k < this.firstPair[this.frame + 1]; k++) {
      const a = ends[2 * k], b = ends[2 * k + 1];
      const r1 = this.at(radius, a), r2 = b < this.count ? this.at(radius, b) : r1;
      const r = Math.min(r1, r2), reach = 1.5 * (r1 + r2);
      const end = b < this.count ? x.subarray(3 * b, 3 * b + 3) : this.#foot(x, a, b - this.count);
      let way = 0;
      for (let c = 0; c < 3; c++) {
        from[3 * rows + c] = x[3 * a + c];
        to[3 * rows + c] = end[c];
        way += (x[3 * a + c] - end[c]) ** 2;
      }
      if (way > reach * reach) continue; // through a periodic face
      const share = byForce && force ? Math.abs(force[k]) / most : -1;
      width[rows] = r * rodWidth(share);
      tint[rows] = share < 0 ? ROD : force[k] >= 0 ? PUSHED : PULLED;
      rows++;
    }
    this.rodCount = rows;
    this.rods.show(rows, "from", "to", "width", "tint");
  }

  // Where particle a touches a wall, or the rigid sphere, which has the number after theirs.
  #foot(x, a, wall) {
    const place = [x[3 * a], x[3 * a + 1], x[3 * a + 2]];
    if (wall < 6) {
      place[Math.floor(wall / 2)] = this.data.room[this.frame][wall];
      return place;
    }
    const { radius, centres } = this.data.sphere, middle = centres[this.frame];
    const branch = place.map((value, c) => value - middle[c]);
    const share = radius / Math.hypot(...branch);
    return middle.map((value, c) => value + share * branch[c]);
  }

  #updateSphere() {
    const { sphere } = this.data;
    if (!sphere || !this.#stale("sphere", this.frame)) return;
    this.sphere.fill("centre", (to) => to.set(sphere.centres[this.frame]));
    this.sphere.fill("radius", (to) => to.fill(sphere.radius));
    this.sphere.fill("tint", (to) => to.fill(RIGID));
    this.sphere.show(1);
  }

  #updateRoom() {
    if (!this.#stale("room", this.frame)) return;
    const faces = this.data.room && this.data.room[this.frame];
    this.room.visible = Boolean(faces) && faces.some((f) => f !== null);
    if (!this.room.visible) return;
    const side = (n, end) => faces[2 * n + end] ?? this.ends()[end].getComponent(n);
    const tilt = this.data.tilt ? this.data.tilt[this.frame] : 0;
    const places = EDGES.flatMap(([x, y, z]) => [side(0, x) + z * tilt, side(1, y), side(2, z)]);
    const { geometry } = this.room;
    geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
    this.room.computeLineDistances();
  }

  ends() {
    // the corners of all particles of now
    if (this.#stale("ends", this.frame)) this.corners = this.#endsOf(this.frame);
    return this.corners.map((corner) => corner.clone());
  }

  #endsOf(frame) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const x = this.arrays.position, last = 3 * (frame + 1) * this.count;
    for (let k = 3 * frame * this.count; k < last; k += 3) {
      for (let c = 0; c < 3; c++) {
        if (x[k + c] < low[c]) low[c] = x[k + c];
        if (x[k + c] > high[c]) high[c] = x[k + c];
      }
    }
    const r = this.data.largest_radius, { sphere } = this.data;
    const corners = [new Vector3(...low).subScalar(r), new Vector3(...high).addScalar(r)];
    if (sphere) {
      const centre = new Vector3(...sphere.centres[frame]);
      corners[0].min(centre.clone().subScalar(sphere.radius));
      corners[1].max(centre.addScalar(sphere.radius));
    }
    return corners;
  }

  // -- camera -----------------------------------------------------------------------------------

  // The corners of all that is there in any snapshot, the room included: nothing leaves the picture
  // while the snapshots are played.
  #around() {
    if (this.everything) return this.everything;
    const low = new Vector3(Infinity, Infinity, Infinity), high = low.clone().negate();
    for (let frame = 0; frame < this.data.frames; frame++) {
      const [first, last] = this.#endsOf(frame), faces = this.data.room?.[frame] ?? [];
      const tilt = this.data.tilt ? this.data.tilt[frame] : 0;
      low.min(first);
      high.max(last);
      faces.forEach((face, n) => {
        if (face === null) return;
        const axis = Math.floor(n / 2), lean = axis === 0 ? tilt : 0;
        low.setComponent(axis, Math.min(low.getComponent(axis), face, face + lean));
        high.setComponent(axis, Math.max(high.getComponent(axis), face, face + lean));
      });
    }
    this.everything = [low, high];
    return this.everything;
  }

  look(name) {
    const [low, high] = this.#around();
    const up = Math.abs(new Vector3(...VIEWS[name]).normalize().z) > 0.9 ? [0, 1, 0] : [0, 0, 1];
    const middle = low.clone().add(high).multiplyScalar(0.5);
    this.lookAlong(VIEWS[name], up, middle.toArray(), 1);
    // what is seen comes into the middle of the picture
    this.camera.matrixWorld.extractBasis(this.right ??= new Vector3(), this.above ??= new Vector3(), new Vector3());
    middle.addScaledVector(this.right, this.span.middle[0]).addScaledVector(this.above, this.span.middle[1]);
    this.lookAlong(VIEWS[name], up, middle.toArray(), 1);
  }

  // eye: direction from what is looked at; up; middle: place that is looked at
  lookAlong(eye, up, middle, zoom) {
    const [low, high] = this.#around(), { camera } = this;
    this.extent = Math.max(high.distanceTo(low), 1e-12);
    this.controls.target.set(...middle);
    camera.up.set(...up);
    const way = new Vector3(...eye).normalize();
    camera.position.copy(this.controls.target).addScaledVector(way, 2 * this.extent);
    camera.near = 0.01 * this.extent;
    camera.far = 5 * this.extent;
    camera.zoom = zoom;
    this.controls.update();
    this.span = this.#seen();
    this.resize();
  }

  // What all snapshots take up on the screen, the room included: {x, y, middle}, lengths and how far
  // their middle is from that of the picture.
  #seen() {
    this.camera.updateMatrixWorld();
    const { elements: m } = this.camera.matrixWorldInverse, { position } = this.arrays;
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity], r = this.data.largest_radius;
    const take = (x, y, z, size) => {
      for (let c = 0; c < 2; c++) {
        const place = m[c] * x + m[c + 4] * y + m[c + 8] * z + m[c + 12];
        if (place - size < low[c]) low[c] = place - size;
        if (place + size > high[c]) high[c] = place + size;
      }
    };
    for (let k = 0; k < position.length; k += 3) take(position[k], position[k + 1], position[k + 2], r);
    for (const centre of this.data.sphere?.centres ?? []) take(...centre, this.data.sphere.radius);
    if (this.data.room) {
      const corners = this.#around();
      for (let k = 0; k < 8; k++) take(corners[k & 1].x, corners[(k >> 1) & 1].y, corners[k >> 2].z, 0);
    }
    return { x: high[0] - low[0], y: high[1] - low[1], middle: [0, 1].map((c) => 0.5 * (low[c] + high[c])) };
  }

  resize() {
    const frame = this.canvas.parentElement;
    const width = Math.max(frame.clientWidth, 50), height = Math.max(frame.clientHeight, 50);
    this.renderer.setSize(width, height);
    // lengths that a pixel stands for, so that all is in the picture whatever its shape
    const free = Math.max(height - 2 * EDGE, 0.5 * height);
    this.perPixel = Math.max(this.span.y / free, (1.05 * this.span.x) / width, 1e-12);
    const [across, up] = [0.5 * this.perPixel * width, 0.5 * this.perPixel * height];
    Object.assign(this.camera, { left: -across, right: across, top: up, bottom: -up });
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  render() {
    this.#setPlane();
    this.renderer.render(this.scene, this.camera);
  }

  draw() {
    if (this.waiting || this.closed) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      if (this.closed) return;
      this.render();
      this.triad.show(this.camera);
      this.panel?.scale(this.perPixel / this.camera.zoom);
    });
  }

  #cut() {
    return [this.spheres, this.rods, this.sphere];
  }

  #setPlane() {
    const axis = ["x", "y", "z"].indexOf(this.state.plane);
    this.camera.updateMatrixWorld();
    for (const part of this.#cut()) part.uniforms.cut.value = axis >= 0;
    if (axis < 0) return;
    const [low, high] = this.ends();
    const at = low.getComponent(axis) + this.state.share * (high.getComponent(axis) - low.getComponent(axis));
    const normal = new Vector3().setComponent(axis, 1);
    const way = this.camera.position.getComponent(axis) - this.controls.target.getComponent(axis);
    const sign = way < 0 ? -1 : 1; // what lies towards the eye is cut away
    const point = new Vector3().copy(this.controls.target).setComponent(axis, at);
    point.applyMatrix4(this.camera.matrixWorldInverse);
    normal.multiplyScalar(sign).transformDirection(this.camera.matrixWorldInverse);
    const plane = new Vector4(normal.x, normal.y, normal.z, normal.dot(point));
    for (const part of this.#cut()) part.uniforms.plane.value.copy(plane);
  }

  // -- one particle -----------------------------------------------------------------------------

  pick(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = (2 * (event.clientX - box.left)) / box.width - 1;
    const y = 1 - (2 * (event.clientY - box.top)) / box.height;
    const spot = new Vector3(x, y, 0).unproject(this.camera).applyMatrix4(this.camera.matrixWorldInverse);
    const { value: plane } = this.spheres.uniforms.plane, cut = this.spheres.uniforms.cut.value;
    const p = new Vector3();
    let nearest = -Infinity, found = -1;
    for (let n = 0; n < this.count; n++) {
      this.centre(n, p).applyMatrix4(this.camera.matrixWorldInverse);
      const r = this.at(this.arrays.radius, n);
      const rest = r * r - (p.x - spot.x) ** 2 - (p.y - spot.y) ** 2;
      if (rest < 0) continue;
      const front = p.z + Math.sqrt(rest);
      if (cut && plane.x * spot.x + plane.y * spot.y + plane.z * (p.z - Math.sqrt(rest)) > plane.w) continue;
      if (front > nearest) [nearest, found] = [front, n];
    }
    this.choose(found);
  }

  choose(number) {
    this.state.picked = number;
    this.update();
  }

  numbers(n) {
    // rows (name, value) of what is known of particle n now
    const length = (v) => `${v.toPrecision(4)} ${this.data.length_unit}`;
    const rows = [["number", `${n}`], ["radius", length(this.at(this.arrays.radius, n))]];
    const place = this.centre(n).toArray().map((v) => v.toPrecision(4)).join(", ");
    rows.push(["position", `${place} ${this.data.length_unit}`]);
    this.data.quantities.forEach((about, k) => {
      const v = this.at(this.arrays.quantities[k], n);
      if (v < about.data.gap) return;
      const text = about.names ? about.names[v] ?? v : about.kind === "class" ? v : short(v);
      rows.push([about.label, `${text} ${about.unit || ""}`.trim()]);
    });
    return rows;
  }

  go(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.data.frames - 1);
    this.update();
  }

  play() {
    this.state.playing = !this.state.playing;
    let last = 0;
    const step = (now) => {
      if (!this.state.playing) return;
      if (now - last > 110) {
        last = now;
        this.go((this.frame + 1) % this.data.frames);
      }
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
    this.panel.refresh();
  }
}
