// Where the picture is taken from: around a target, which may be a body that moves. Mouse, touch and keys turn it.
import { add, cross, dot, length, lookAt, matrixProduct, minus3, perspective, times, unit } from "terraglue/math.js";

const ANGLE = 0.66;
/** Directions of the cameras by name: turn about z, and above the horizon, rad. */
const PLACES = { follow: [-0.95, 0.42], side: [-Math.PI / 2, 0.12], top: [-Math.PI / 2, 1.55], front: [0, 0.2], orbit: null };

/** The view of one picture. */
export class Sight {
  constructor(eye, target, aspect, pixels, reach) {
    this.eye = eye;
    const up = Math.abs(unit(minus3(target, eye))[2]) > 0.9995 ? [0, 1, 0] : [0, 0, 1];
    const near = Math.max(0.02 * reach, 0.005);
    this.looking = lookAt(eye, target, up);
    this.matrix = matrixProduct(perspective(ANGLE, aspect, near, near * 4000), this.looking);
    this.focal = pixels / (2 * Math.tan(ANGLE / 2));
    this.aspect = aspect;
  }
  distance(p) { return length(minus3(p, this.eye)); }
  // Whether a ball is in the picture; a little more than that counts as seen.
  sees(p, radius) {
    const m = this.looking;
    const [x, y, z] = [0, 1, 2].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
    const half = Math.tan(ANGLE / 2);
    const inside = (across, widest) => Math.abs(across) <= -z * widest + radius * Math.hypot(1, widest);
    return -z > -radius && inside(x, half * this.aspect) && inside(y, half);
  }
  /** Place in the picture (0 to 1 from the upper left), or null behind the camera. */
  project(p) {
    const m = this.matrix;
    const at = (r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r];
    return at(3) > 0 ? [0.5 + at(0) / at(3) / 2, 0.5 - at(1) / at(3) / 2] : null;
  }
  /** Direction through a place in the picture. */
  ray([u, v]) {
    const half = Math.tan(ANGLE / 2);
    const own = [(2 * u - 1) * half * this.aspect, (1 - 2 * v) * half, -1];
    const m = this.looking;
    return unit([0, 1, 2].map((k) => m[4 * k] * own[0] + m[4 * k + 1] * own[1] + m[4 * k + 2] * own[2]));
  }
}

/** The camera of a view. */
export class Camera {
  constructor() { Object.assign(this, { target: [0, 0, 0], offset: [0, 0, 0], away: 3, name: "follow", yaw: 0, pitch: 0 }); this.choose("follow"); }
  static names = Object.keys(PLACES);

  /** One of the named cameras. */
  choose(name) {
    const place = PLACES[name];
    this.name = name in PLACES ? name : "follow";
    if (place) { [this.yaw, this.pitch] = place; this.offset = [0, 0, 0]; }
  }

  /** Keeps a moving place in the middle; the camera `orbit` stays where it is. */
  follow(place) { if (this.name !== "orbit") this.target = place; }

  get centre() { return add(this.target, this.offset); }

  get eye() {
    const [c, s] = [Math.cos(this.pitch), Math.sin(this.pitch)];
    return add(this.centre, times([c * Math.cos(this.yaw), c * Math.sin(this.yaw), s], this.away));
  }

  sight(width, height) { return new Sight(this.eye, this.centre, width / height, height, this.away); }

  turn(dx, dy) {
    this.yaw -= dx * 0.006;
    this.pitch = Math.min(Math.max(this.pitch + dy * 0.006, -0.2), 1.55);
  }

  // By pixels of the picture, within its plane.
  pan(dx, dy, height) {
    const back = unit(minus3(this.eye, this.centre));
    const right = unit(cross(Math.abs(back[2]) > 0.9995 ? [0, 1, 0] : [0, 0, 1], back));
    const scale = (2 * this.away * Math.tan(ANGLE / 2)) / height;
    const by = add(times(right, -dx * scale), times(cross(back, right), dy * scale));
    this.offset = add(this.offset, by);
  }

  zoom(factor) { this.away = Math.min(Math.max(this.away * factor, 0.05), 400); }

  /** As text for an address, and back. */
  get text() { return [this.name, this.yaw, this.pitch, this.away].map((x) => (typeof x === "number" ? x.toFixed(3) : x)).join(","); }
  set text(text) {
    const [name, ...numbers] = text.split(",");
    this.choose(name);
    const [yaw, pitch, away] = numbers.map(Number);
    if (Number.isFinite(yaw) && Number.isFinite(pitch)) [this.yaw, this.pitch] = [yaw, pitch];
    if (away > 0) this.away = away;
  }

  /** How far along a ray a plane through `place`, square to the view, is. */
  reach(origin, ray, place) {
    const back = unit(minus3(this.centre, this.eye));
    return dot(minus3(place, origin), back) / dot(ray, back);
  }
}

/** Binds mouse, touch and wheel of an element; `changed` is called, `click(event)` where nothing was dragged, `grab(event)` may take a drag. */
export function bindCamera(element, camera, { changed, click, grab }) {
  const fingers = new Map();
  let [from, taken, spread] = [null, null, 0];
  const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY); };
  element.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, event);
    element.setPointerCapture(event.pointerId);
    from = { x: event.clientX, y: event.clientY };
    taken = fingers.size === 1 ? grab?.(event) ?? null : null;
    if (fingers.size === 2) spread = apart();
  });
  element.addEventListener("pointermove", (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.clientX, event.clientY - last.clientY];
    fingers.set(event.pointerId, event);
    if (taken) taken.move(event);
    else if (fingers.size === 2) { const now = apart(); camera.zoom(spread / now); spread = now; camera.pan(dx / 2, dy / 2, element.clientHeight); }
    else if (event.buttons & 6 || event.shiftKey) camera.pan(dx, dy, element.clientHeight);
    else camera.turn(dx, dy);
    changed();
  });
  const end = (event) => {
    const known = fingers.delete(event.pointerId);
    taken?.end(event);
    const still = known && from && Math.hypot(event.clientX - from.x, event.clientY - from.y) < 4;
    if (still && !taken && event.type === "pointerup" && event.button === 0) click?.(event);
    taken = null;
  };
  element.addEventListener("pointerup", end);
  element.addEventListener("pointercancel", end);
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 100) * 0.0015));
    changed();
  }, { passive: false });
}
