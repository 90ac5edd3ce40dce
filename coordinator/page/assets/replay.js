// The replay above a report: the view, a bar to play and scrub, and the address with its state (#t=4.2&camera=side).
import { htmlElement } from "terraglue/axes.js";
import { newtonsOf, takeScene } from "terraglue/bodies.js";
import { decoder } from "terraglue/protobuf.js";
import { GroundTrack, Track, inflate } from "terraglue/track.js";
import { View } from "terraglue/view.js";

/** The settings in an address after its #: `t`, `camera`, `ground`, `alone`. */
export const wishes = () => new URLSearchParams(location.hash.slice(1));

class Replay {
  constructor(parent, view) {
    Object.assign(this, { view, t: 0, playing: false, speed: 1, onTime: null });
    this.bar = htmlElement(parent, "div", "replay-bar");
    this.play = htmlElement(this.bar, "button", "play");
    this.play.type = "button";
    this.play.onclick = () => this.setPlaying(!this.playing);
    this.scrub = htmlElement(this.bar, "input", "scrub");
    Object.assign(this.scrub, { type: "range", min: 0, step: "any" });
    this.scrub.setAttribute("aria-label", "time of the replay, s");
    this.scrub.oninput = () => { this.setPlaying(false); this.go(Number(this.scrub.value)); };
    this.readout = htmlElement(this.bar, "output", "when");
    const speed = htmlElement(this.bar, "select");
    speed.setAttribute("aria-label", "speed of the replay");
    for (const x of [0.1, 0.25, 0.5, 1, 2, 4, 10]) htmlElement(speed, "option", "", `× ${x}`).value = x;
    speed.value = "1";
    speed.onchange = () => { this.speed = Number(speed.value); };
    this.setPlaying(false);
  }

  setPlaying(on) {
    this.playing = on;
    this.play.textContent = on ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", on ? "pause" : "play");
    if (!on) return;
    if (this.t >= this.end - 1e-6) this.go(this.start);
    this.last = performance.now();
    requestAnimationFrame(() => this.tick());
  }

  tick() {
    if (!this.playing) return;
    const now = performance.now();
    const t = this.t + (this.speed * (now - this.last)) / 1e3;
    this.last = now;
    this.go(Math.min(t, this.end));
    if (t >= this.end) this.setPlaying(false);
    requestAnimationFrame(() => this.tick());
  }

  /** Shows the run at a time. */
  go(t) {
    this.t = Math.min(Math.max(t, this.start), this.end);
    this.track.posesAt(this.t, this.view.poses);
    this.view.forces = this.track.forcesAt(this.t);
    if (this.ground) this.ground.go(this.view.relief, this.t);
    this.scrub.value = this.t;
    this.readout.textContent = `t = ${this.t.toFixed(3)} s`;
    this.view.invalidate();
    this.onTime?.(this.t);
  }

  async load(replay, nodes) {
    this.page = replay.page;
    this.track = await Track.read(replay);
    [this.start, this.end] = [this.track.t[0], this.track.t.at(-1)];
    Object.assign(this.scrub, { min: this.start, max: this.end });
    const read = decoder(await inflate(replay.schema), "foxglove.SceneUpdate");
    takeScene(this.view.entities, read(await inflate(replay.scene)));
    this.view.body = replay.body;
    this.view.newtons = newtonsOf(replay.metres_per_newton) || this.track.large;
    if (replay.ground && nodes) await this.loadGround(nodes, replay.ground);
    this.go(this.start);
    this.view.fit();
  }

  async loadGround(nodes, changes) {
    const [[nx, ny], [x0, y0]] = [nodes.size, nodes.origin];
    const relief = this.view.setGround({ nx, ny, spacing: nodes.spacing, x0, y0 });
    this.ground = await GroundTrack.read(nodes, changes);
    this.ground.begin(relief, nodes);
    // the scales of the colours are those of the end, so that they stay the same
    this.ground.go(relief, Infinity);
    relief.known = { 1: relief.extent(1), 2: relief.extent(2) };
    this.view.colour("sinkage");
  }

  bindKeys() {
    this.view.box.parentElement.addEventListener("keydown", (event) => {
      if (["INPUT", "SELECT", "BUTTON", "SUMMARY"].includes(event.target.tagName)) return;
      const step = { ArrowLeft: -0.05, ArrowRight: 0.05 }[event.key];
      if (event.key === " ") this.setPlaying(!this.playing);
      else if (step) { this.setPlaying(false); this.go(this.t + step); }
      else return;
      event.preventDefault();
    });
  }

  // Applies the settings in the address.
  obey() {
    const wish = wishes();
    const [camera, ground] = ["camera", "ground"].map((key) => wish.get(key) ?? this.page?.[key]);
    if (camera) this.view.camera.text = camera;
    if (ground) this.view.colour(ground);
    if (wish.has("t")) this.go(Number(wish.get("t")));
    else if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.setPlaying(true);
    // for pictures: edges are smooth without a graphics card, too
    this.view.smooth = wish.has("alone");
    document.documentElement.classList.toggle("alone", this.view.smooth);
  }
}

/** Shows the replay of a report's data in the element `replay`, along the time axis of its plots (or none); a sentence where the browser cannot. */
export async function showReplay(data, axis) {
  const parent = document.getElementById("replay");
  let view;
  try { view = new View(parent, { layers: ["forces", "grid"] }); } catch (error) {
    htmlElement(parent, "p", "notice", `This browser shows no 3-D view (${error.message}). All else of the report is below.`);
    return null;
  }
  const replay = new Replay(parent, view);
  await replay.load(data.replay, data.map?.nodes);
  if (data.replay.left_out) view.say(`${data.replay.left_out} large meshes are not in this file.`);
  replay.bindKeys();
  if (axis) {
    replay.onTime = (t) => axis.mark(t);
    axis.onPick = (t) => { replay.setPlaying(false); replay.go(t); };
  }
  replay.obey();
  addEventListener("hashchange", () => replay.obey());
  return replay;
}
