// The 3-D view of a live run: takes poses, shapes, forces, ground and sensors as they come, or as they were at the time that the
// reader looks at. A click selects, a drag with Ctrl pushes.
import { newtonsOf, takeScene } from "terraglue/bodies.js";
import { takeTiles } from "terraglue/frames.js";
import { add, minus3, times, turn } from "terraglue/math.js";
import { View } from "terraglue/view.js";

const HIT = [0.98, 0.45, 0.1, 0.95];
const OWN = [0.75, 0.2, 0.9, 0.95];
const RESCALE_MS = 1500;
const MOST_POINTS = 20_000;

const vector = (v) => [v.x, v.y, v.z];
const quaternion = (q) => [q.w, q.x, q.y, q.z];

/** The stage in `parent`. */
export class Stage {
  constructor(parent, run) {
    Object.assign(this, { run, joints: new Map(), efforts: new Map(), lattice: null, queue: Promise.resolve(), scaled: 0 });
    Object.assign(this, { clouds: new Map(), asked: null, busy: false, first: true, begun: false, t: 0 });
    this.view = new View(parent, { click: (event) => this.click(event), grab: (event) => (event.ctrlKey || event.metaKey ? this.grab(event) : null) });
    this.subscribed = new Set();
    run.link.addEventListener("channels", () => this.listen());
    run.on("channels", () => this.listen());
    run.on("select", () => this.mark());
    run.on("moment", (t) => this.show(t ?? run.t));
    run.on("branch", () => this.show(run.shown));
    // a run that stands still sends nothing: its last picture is asked for
    run.on("run", () => { if (!this.begun && this.subscribed.has("/tf")) { this.begun = true; this.show(run.shown); } });
    run.on("values", () => { this.takeCentre(); this.view.invalidate(); });
    run.on("link", (on) => { parent.classList.toggle("stale", !on); if (on) { this.joints.clear(); this.begun = false; } });
  }

  /** The time of the poses that are shown, s. */
  get time() { return this.run.looked ?? (this.run.playing ? this.t : this.run.t); }

  // How a topic is taken, by what it is; null: not shown.
  taker(topic) {
    const schema = this.run.link.byTopic.get(topic)?.schemaName ?? "";
    if (topic === "/scene") return (m) => this.takeShapes(m);
    if (topic === "/tf") return (m) => this.takePoses(m);
    if (topic === "/contact_forces") return (m) => this.takeForces(m);
    if (topic === "/ground/tiles") return (m) => this.takeGround(m);
    if (topic.startsWith("/joints/")) return (m) => this.takeJoints(topic, m);
    if (topic.startsWith("/overlays/")) return (m) => this.takeOverlay(topic, m);
    const drawn = topic.startsWith("/ground/") || topic.startsWith("/shapes/") || topic.startsWith("/contact_forces/");
    if (schema === "foxglove.PointCloud" && !drawn) return (m) => this.takeCloud(topic, m);
    if (schema === "foxglove.LaserScan") return (m) => this.takeScan(topic, m);
    return null;
  }

  listen() {
    const { link, metadata } = this.run;
    const header = metadata["/ground/tiles"];
    if (header && !this.lattice) this.lay(header);
    const known = this.subscribed.size;
    for (const topic of link.byTopic.keys()) {
      if (this.subscribed.has(topic)) continue;
      const take = this.taker(topic);
      if (!take || (topic === "/ground/tiles" && !this.lattice)) continue;
      this.subscribed.add(topic);
      // while the past is shown, only the shapes are taken
      link.subscribe(topic, (message, t) => {
        if (this.run.looked !== null && topic !== "/scene") return;
        take(message);
        if (topic === "/tf") this.t = t;
        this.view.invalidate();
      });
    }
    // the past was asked for before these topics were known
    if (this.run.looked !== null && this.subscribed.size > known) this.show(this.run.looked);
  }

  // The lattice of the ground from the metadata of its topic.
  lay(header) {
    const of = typeof header.header === "string" ? JSON.parse(header.header) : header;
    this.lattice = Object.fromEntries(Object.entries(of).map(([key, value]) => [key, Number(value)]));
    this.view.setGround(this.lattice);
    this.view.colour(this.colour ?? "sinkage");
  }

  takePoses({ transforms }) {
    for (const { child_frame_id: frame, translation, rotation } of transforms) {
      if (translation && rotation) this.view.poses.set(frame, { p: vector(translation), q: quaternion(rotation) });
    }
    this.takeCentre();
    this.beginView();
  }

  takeShapes(message) {
    takeScene(this.view.entities, message);
    this.beginView();
  }

  // The view begins once both shapes and poses are known, whichever come first: a run that stands still sends neither again.
  beginView() {
    const { poses, entities } = this.view;
    if (!this.first || !poses.size || !entities.size) return;
    this.first = false;
    this.view.body ??= poses.keys().next().value;
    this.view.fit();
    this.watchCentre();
    this.run.tell("staged");
  }

  // Centre of mass of the selected body, else of the one that is followed; its variables give it in the frame of the body.
  centreIds() {
    const frame = this.view.selected ?? this.view.body ?? "";
    return ["x", "y", "z"].map((c) => `${frame.replace("/", ".")}.force_at_${c}`);
  }

  watchCentre() { this.run.watch("centre", this.centreIds().filter((id) => this.run.variables.has(id))); }

  takeCentre() {
    const own = this.centreIds().map((id) => this.run.values.get(id));
    const pose = this.view.poses.get(this.view.selected ?? this.view.body);
    this.view.centre = pose && own.every(Number.isFinite) ? add(pose.p, turn(pose.q, own)) : null;
  }

  takeForces({ entities }) {
    const scale = Number(this.run.metadata["/contact_forces"]?.metres_per_newton) || 0.01;
    this.view.newtons = newtonsOf(scale);
    const force = (a) => times(turn(quaternion(a.pose.orientation), [1, 0, 0]), (a.shaft_length + a.head_length) / scale);
    this.view.forces = entities.flatMap((e) => e.arrows).map((a) => ({ p: vector(a.pose.position), f: force(a) }));
  }

  takeGround(message) {
    this.queue = this.queue.then(() => takeTiles(message, this.view.relief, this.lattice)).then(() => {
      // not for each of many tiles, but always after the last one
      const wait = Math.max(this.scaled + RESCALE_MS - performance.now(), 0);
      this.scaling ??= setTimeout(() => { this.scaling = null; this.scaled = performance.now(); this.view.rescale(true); }, wait);
      this.view.invalidate();
    }).catch((error) => this.run.say(`ground: ${error.message}`, true));
    return this.queue;
  }

  takeOverlay(topic, message) {
    if (!this.view.overlays.has(topic)) this.view.overlays.set(topic, new Map());
    takeScene(this.view.overlays.get(topic), message);
  }

  // The tree of the joints is in the metadata of their topic.
  tree(topic) {
    const text = this.run.metadata[topic]?.joints;
    if (!text) return null;
    if (!this.joints.has(topic)) this.joints.set(topic, new Map(JSON.parse(text).map((j) => [j.name, j])));
    return this.joints.get(topic);
  }

  takeJoints(topic, { joints }) {
    const [tree, subsystem] = [this.tree(topic), topic.slice("/joints/".length)];
    if (!tree) return;
    const torques = joints.filter((j) => j.effort !== null && tree.has(j.name)).map((j) => {
      const { parent, position_m: p, orientation_wxyz: q, axis } = tree.get(j.name);
      const name = `${subsystem}.${j.name}`;
      const id = `${name}.max_torque`;
      const known = this.run.values.get(id) ?? this.run.variables.get(id)?.start;
      const largest = Math.max(this.efforts.get(subsystem) ?? 1e-9, Math.abs(j.effort));
      this.efforts.set(subsystem, largest);
      return { frame: parent, p, axis: turn(q, axis), share: j.effort / (known > 0 ? known : largest) };
    });
    this.view.torques = torques;
  }

  // Points of a cloud in the world; those that hit the own body have another colour where the sensor marks them.
  takeCloud(topic, { frame_id: frame, pose, point_stride: stride, fields, data }) {
    const [view, place] = [new DataView(data.buffer, data.byteOffset, data.byteLength), this.placeOf(frame, pose)];
    if (!place || !stride) return;
    const offset = (name) => fields.find((f) => f.name === name)?.offset;
    const [x, y, z] = ["x", "y", "z"].map(offset);
    const own = offset("own") ?? offset("self");
    const step = stride * Math.max(1, Math.ceil(data.length / stride / MOST_POINTS));
    const points = [];
    for (let k = 0; k + stride <= data.length; k += step) {
      const at = [x, y, z].map((o) => view.getFloat32(k + o, true));
      const colour = own !== undefined && view.getUint8(k + own) ? OWN : HIT;
      if (at.every(Number.isFinite)) points.push({ p: place(at), colour });
    }
    this.hits(topic, points);
  }

  takeScan(topic, { frame_id: frame, pose, start_angle: a, end_angle: b, ranges }) {
    const place = this.placeOf(frame, pose);
    if (!place) return;
    const step = ranges.length > 1 ? (b - a) / (ranges.length - 1) : 0;
    const points = ranges.map((r, k) => ({ r, p: [r * Math.cos(a + k * step), r * Math.sin(a + k * step), 0] }));
    this.hits(topic, points.filter(({ r }) => Number.isFinite(r) && r > 0).map(({ p }) => ({ p: place(p), colour: HIT })));
  }

  hits(topic, points) {
    this.clouds.set(topic, points);
    this.view.points = [...this.clouds.values()].flat();
  }

  placeOf(frame, pose) {
    const at = frame === "world" || !frame ? { p: [0, 0, 0], q: [1, 0, 0, 0] } : this.view.poses.get(frame);
    if (!at) return null;
    const [p, q] = [pose?.position ? vector(pose.position) : [0, 0, 0], pose?.orientation ? quaternion(pose.orientation) : [1, 0, 0, 0]];
    return (own) => add(at.p, turn(at.q, add(p, turn(q, own))));
  }

  /** Shows everything at a time; of many wishes in a row only the last is fulfilled. */
  async show(t) {
    this.asked = t;
    if (this.busy) return;
    this.busy = true;
    while (this.asked !== null) {
      const now = this.asked;
      this.asked = null;
      const waits = [];
      try {
        await this.run.at(now, [...this.subscribed], (topic, message) => waits.push(this.taker(topic)?.(message)));
        await Promise.all(waits);
      } catch (error) { this.run.say(`t = ${now.toFixed(3)} s: ${error.message}`, true); }
      this.view.invalidate();
    }
    this.busy = false;
  }

  /** The frame of what is selected: a body, or the one that a joint moves. */
  frame(id = this.run.selected) {
    const [subsystem, part] = (id ?? "").split(".");
    if (this.view.entities.has(`${subsystem}/${part}`)) return `${subsystem}/${part}`;
    return this.tree(`/joints/${subsystem}`)?.get(part)?.child ?? null;
  }

  mark() {
    this.view.selected = this.frame();
    this.watchCentre();
    this.view.invalidate();
  }

  /** Turns the camera to what is selected. */
  focus() {
    const frame = this.frame();
    if (frame) this.view.camera.offset = [0, 0, 0];
    this.view.aim(frame ?? undefined);
  }

  async cast(event) {
    if (!this.run.link.services.has("world.cast_ray")) return null;
    const answer = await this.run.act("world.cast_ray", this.view.ray(event));
    return answer?.hit ?? null;
  }

  async click(event) {
    const hit = await this.cast(event);
    if (!hit) return;
    const { variables } = this.run;
    const own = hit.body ? `${hit.subsystem}.${hit.body}` : hit.subsystem;
    const has = (group) => [...variables.keys()].some((id) => id.startsWith(`${group}.`));
    // a body without variables is that of the joint which moves it
    const moved = [...(this.tree(`/joints/${hit.subsystem}`)?.values() ?? [])].find((j) => j.child === `${hit.subsystem}/${hit.body}`);
    this.run.select(moved ? `${hit.subsystem}.${moved.name}` : has(own) ? own : hit.subsystem);
  }

  // Pushes the body under the pointer towards where it is dragged, until it is let go.
  grab(event) {
    const { view, run } = this;
    const push = { body: null, from: null, force: [0, 0, 0], timer: 0, ended: false };
    const start = view.ray(event);
    this.cast(event).then((hit) => {
      if (!hit?.body || push.ended) return;
      Object.assign(push, { body: `${hit.subsystem}.${hit.body}`, from: hit.point });
      push.timer = setInterval(() => run.act("body.push", { body: push.body, force: push.force, moment: [0, 0, 0] }).then((ok) => { if (!ok) end(); }), 100);
    });
    const end = () => {
      push.ended = true;
      clearInterval(push.timer);
      if (push.body) run.link.call("body.push", { body: push.body, force: [0, 0, 0], moment: [0, 0, 0] }).catch(() => {});
      view.push = null;
      push.body = null;
      view.invalidate();
    };
    const move = (moved) => {
      if (!push.body) return;
      const { origin, direction } = view.ray(moved);
      const to = add(origin, times(direction, view.camera.reach(start.origin, direction, push.from)));
      // as far as the robot is large is as much as it weighs
      push.force = times(minus3(to, push.from), (view.newtons || 10) / view.reach);
      view.push = { from: push.from, to };
    };
    return { move, end };
  }
}
