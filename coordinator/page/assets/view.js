// The 3-D view: canvas, camera, layers with their scales, legend of the ground, labels. Report and page use the same one.
import { htmlElement } from "terraglue/axes.js";
import { Drawing } from "terraglue/batch.js";
import { drawArc, drawArrow, drawBar, drawEntities } from "terraglue/bodies.js";
import { Camera, bindCamera } from "terraglue/camera.js";
import { add, hull, inside, length, minus3, times, turn } from "terraglue/math.js";
import { COLOURS, LAYERS, Menus } from "terraglue/menus.js";
import { Relief } from "terraglue/relief.js";
import { Renderer } from "terraglue/renderer.js";

/** After so long without another wish for a picture the view stands still. */
const STILL_MS = 600;
/** Where the processor draws: pixels of the picture to a pixel of the page while things move, and times between pictures, ms, from which on fewer or more are drawn. */
const MOVING = [0.6, 0.48, 0.38];
const SLOW_MS = 105;
const QUICK_MS = 55;
const FORCE = [0.84, 0.15, 0.16, 1];
const TORQUE = [0.13, 0.47, 0.78, 1];
const SATURATED = [0.86, 0.1, 0.1, 1];
const CENTRE = [0.96, 0.96, 0.94, 1];
const GHOST = [0.25, 0.55, 0.95, 0.38];

/** Makes a view inside `parent` that offers some of the layers; throws where there is no WebGL 2. */
export class View {
  constructor(parent, { click, grab, layers = LAYERS.map(([name]) => name) } = {}) {
    this.box = htmlElement(parent, "div", "view3d");
    this.canvas = htmlElement(this.box, "canvas");
    Object.assign(this.canvas, { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "3-D view of the run: drag turns, wheel zooms, shift-drag moves");
    this.renderer = new Renderer(this.canvas);
    this.camera = new Camera();
    this.drawing = new Drawing();
    Object.assign(this, { entities: new Map(), overlays: new Map(), poses: new Map(), forces: [], torques: [], points: [], ghost: { entities: new Map(), poses: new Map() } });
    Object.assign(this, { relief: null, body: null, selected: null, centre: null, newtons: 0, reach: 1, frames: 0, smooth: false, waiting: false, push: null, slow: 0, quick: 0, coarse: 0, moving: false, asked: -Infinity, drawn: -Infinity });
    this.layers = Object.fromEntries(LAYERS.map(([name, , , on]) => [name, { on, scale: 1 }]));
    this.labels = htmlElement(this.box, "div", "labels");
    this.menus = new Menus(this, layers);
    bindCamera(this.canvas, this.camera, { changed: () => this.invalidate(), click, grab });
    new ResizeObserver(() => this.invalidate()).observe(this.box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.invalidate());
    new MutationObserver(() => this.invalidate()).observe(document.documentElement, { attributeFilter: ["data-theme"] });
    this.canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); this.say("The graphics card was lost; reload the page."); });
  }

  say(text) { htmlElement(this.box, "p", "view-note", text).setAttribute("role", "alert"); }

  /** A new ground; see `Relief`. */
  setGround(lattice) {
    this.relief = new Relief(this.renderer.gl, lattice);
    return this.relief;
  }

  /** Colours the ground by a layer's name and sets its scale. */
  colour(name) {
    this.menus.colours.value = name;
    if (!this.relief) return;
    this.relief.colours = COLOURS.indexOf(name);
    this.rescale();
  }

  /** Fits the scale of the colours to the ground as it is; `most` widens it only. */
  rescale(widen = false) {
    const { relief } = this;
    if (!relief) return;
    const layer = relief.colours;
    if (layer) {
      const [low, high] = relief.known?.[layer] ?? relief.extent(layer);
      relief.range = widen ? [Math.min(low, relief.range[0]), Math.max(high, relief.range[1])] : [low, high];
    }
    this.menus.drawLegend(layer);
    this.invalidate();
  }

  /** Size of all bodies around the one that is followed, for camera, shadow and arrows. */
  fit() {
    const home = this.poses.get(this.body)?.p ?? [...this.poses.values()][0]?.p;
    if (!home) return;
    const [own] = (this.body ?? "").split("/");
    const near = [...this.poses].filter(([frame]) => frame.split("/")[0] === own && this.entities.has(frame));
    const far = near.map(([frame, pose]) => length(minus3(pose.p, home)) + this.extent(frame));
    this.reach = Math.min(Math.max(...far, 0.15), 50);
    this.camera.away = 2.9 * this.reach;
    this.aim();
  }

  // How far the parts of a body reach from its origin.
  extent(frame) {
    const parts = this.entities.get(frame)?.parts ?? [];
    return Math.max(0, ...parts.filter((part) => !part.triangles).map((part) => length(part.p) + 0.5 * Math.max(...part.s)));
  }

  /** Turns the camera to what is selected, else to the body of the report. */
  aim(frame = this.body) {
    const pose = this.poses.get(frame);
    if (pose) { this.camera.target = pose.p; this.body = frame; }
    this.invalidate();
  }

  /** Draws at the next chance; `still`: nothing has moved, only the picture is to be finer. */
  invalidate(still = false) {
    const now = performance.now();
    // what is asked for again and again moves, however long the pictures take
    this.moving = !still && now - this.asked < STILL_MS;
    if (!still) this.asked = now;
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => { this.waiting = false; this.draw(); });
  }

  // Pixels of the picture to a pixel of the page: without a graphics card fewer while things move, more once they stand still.
  detail() {
    const whole = Math.min(devicePixelRatio, 2);
    if (!this.renderer.slow) return whole;
    if (this.smooth) return 2;
    const now = performance.now();
    const gap = now - this.drawn;
    this.drawn = now;
    clearTimeout(this.settle);
    if (!this.moving) return Math.max(whole, 1.5);
    this.settle = setTimeout(() => this.invalidate(true), STILL_MS);
    this.pace(gap);
    return MOVING[this.coarse];
  }

  // Goes to fewer pixels after a few slow pictures, to more after many quick ones.
  pace(gap) {
    this.slow = gap > SLOW_MS ? this.slow + 1 : Math.max(this.slow - 1, 0);
    this.quick = gap < QUICK_MS ? this.quick + 1 : 0;
    const by = this.slow > 3 ? 1 : this.quick > 40 ? -1 : 0;
    if (!by) return;
    [this.slow, this.quick] = [0, 0];
    this.coarse = Math.min(Math.max(this.coarse + by, 0), MOVING.length - 1);
  }

  draw() {
    const ratio = this.detail();
    const [w, h] = [this.box.clientWidth, this.box.clientHeight];
    if (!w || !h) return;
    const [width, height] = [Math.round(w * ratio), Math.round(h * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const home = this.poses.get(this.body)?.p;
    if (home) this.camera.follow(home);
    this.menus.cameras.value = this.camera.name;
    this.renderer.dusk = getComputedStyle(this.box).colorScheme.includes("dark") ? 1 : 0;
    if (this.relief) this.relief.grid = this.layers.grid.on;
    const sight = this.camera.sight(w, h);
    sight.effort = !this.renderer.slow ? "card" : ratio < 1 ? "moving" : "still";
    const texts = this.fill();
    this.renderer.draw(this.drawing, this.relief, sight, home ?? this.camera.centre, 1.6 * this.reach);
    this.sight = sight;
    this.placeLabels(texts, sight);
    this.frames++;
  }

  // Everything but the ground; gives the texts.
  fill() {
    const { drawing, layers } = this;
    const texts = [];
    drawing.clear();
    drawEntities(drawing, this.entities, this.poses, { selected: this.selected });
    if (layers.ghost.on) drawEntities(drawing, this.ghost.entities, this.ghost.poses, { ghost: GHOST });
    if (layers.overlays.on) for (const layer of this.overlays.values()) drawEntities(drawing, layer, this.poses, { marks: true, texts });
    if (layers.forces.on) this.drawForces();
    if (layers.torques.on) this.drawTorques();
    if (layers.hits.on) for (const { p, colour } of this.points) drawing.points.push(p, colour);
    if (layers.centre.on && this.centre) this.drawCentre();
    if (layers.support.on) this.drawSupport();
    if (this.push) drawArrow(drawing, this.push.from, minus3(this.push.to, this.push.from), TORQUE, 0.02 * this.reach);
    return texts;
  }

  drawForces() {
    const scale = (0.6 * this.reach * this.layers.forces.scale) / (this.newtons || 1);
    for (const { p, f } of this.forces) drawArrow(this.drawing, p, times(f, scale), FORCE, 0.018 * this.reach);
  }

  drawTorques() {
    for (const { frame, p, axis, share } of this.torques) {
      const pose = this.poses.get(frame);
      if (!pose || !(Math.abs(share) > 0.01)) continue;
      const angle = Math.max(Math.min(share * this.layers.torques.scale, 1), -1) * 5;
      const tint = Math.abs(share) > 0.98 ? SATURATED : TORQUE;
      drawArc(this.drawing, add(pose.p, turn(pose.q, p)), turn(pose.q, axis), 0.09 * this.reach, angle, tint, 0.014 * this.reach);
    }
  }

  // The polygon around all points that the ground presses on; red where the centre of mass does not stand over it.
  drawSupport() {
    const corners = hull(this.forces.filter(({ f }) => f[2] > 0).map(({ p }) => p));
    const stands = !this.centre || corners.length < 3 || inside(corners, this.centre);
    const above = ([x, y, z]) => [x, y, z + 0.01 * this.reach];
    corners.forEach((p, k) => {
      const way = minus3(corners[(k + 1) % corners.length], p);
      if (length(way) > 1e-6) drawBar(this.drawing, above(p), way, stands ? CENTRE : SATURATED, 0.014 * this.reach);
    });
  }

  // A ball where the centre of mass is, and a plumb line to the ground.
  drawCentre() {
    const [x, y, z] = this.centre;
    const size = 0.06 * this.reach;
    this.drawing.marks.sphere.push([size, 0, 0, 0, 0, size, 0, 0, 0, 0, size, 0, x, y, z, 1], CENTRE, [1, 1]);
    const ground = this.relief?.heightAt(x, y);
    if (Number.isFinite(ground)) this.drawing.lines.push([x, y, z], CENTRE, [x, y, ground], CENTRE);
  }

  placeLabels(texts, sight) {
    this.labels.replaceChildren();
    for (const { p, text } of texts.slice(0, 60)) {
      const at = sight.project(p);
      if (!at) continue;
      const label = htmlElement(this.labels, "span", "", text);
      label.style.left = `${100 * at[0]}%`;
      label.style.top = `${100 * at[1]}%`;
    }
  }

  /** Place of a pointer in the picture, 0 to 1. */
  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  }

  /** Origin and direction of the ray under a pointer. */
  ray(event) { return { origin: this.sight.eye, direction: this.sight.ray(this.place(event)) }; }
}
