// Bodies and other things in messages of the type foxglove.SceneUpdate: their shapes become places of solids in a drawing.
import { add, inFrame, length, minus3, placed, times, turn, upTo, product } from "terraglue/math.js";

const WORLD = { p: [0, 0, 0], q: [1, 0, 0, 0] };
const ENDS = [1, 1];
// The x axis turned up: arrows of messages point along x, cylinders along z.
const X_UP = [Math.SQRT1_2, 0, Math.SQRT1_2, 0];

const vector = (v) => (v ? [v.x, v.y, v.z] : [0, 0, 0]);
const pose = (m) => (m ? { p: vector(m.position), q: m.orientation ? [m.orientation.w, m.orientation.x, m.orientation.y, m.orientation.z] : WORLD.q } : WORLD);
const colour = (c) => (c ? [c.r, c.g, c.b, c.a] : [0.6, 0.6, 0.6, 1]);

function arrowParts(a) {
  const own = pose(a.pose);
  const along = (x) => add(own.p, turn(own.q, [x, 0, 0]));
  const q = product(own.q, X_UP);
  const [shaft, head] = [a.shaft_length, a.head_length];
  return [
    { solid: "cylinder", p: along(shaft / 2), q, s: [a.shaft_diameter, a.shaft_diameter, shaft], colour: colour(a.color), ends: ENDS },
    { solid: "cylinder", p: along(shaft + head / 2), q, s: [a.head_diameter, a.head_diameter, head], colour: colour(a.color), ends: [1, 0] },
  ];
}

// Lines as pairs of ends; types are a strip, a loop and a list of pairs.
function segments(line) {
  const own = pose(line.pose);
  const points = line.points.map((p) => add(own.p, turn(own.q, vector(p))));
  const order = line.indices.length ? line.indices : points.map((_, k) => k);
  const pairs = [];
  const step = line.type === 2 ? 2 : 1;
  for (let k = 0; k + 1 < order.length; k += step) pairs.push([points[order[k]], points[order[k + 1]]]);
  if (line.type === 1 && order.length > 2) pairs.push([points[order.at(-1)], points[order[0]]]);
  return { pairs, colour: colour(line.color) };
}

/** The force by which arrows are scaled, N, from the scale of a recording: page and report draw them alike. */
export const newtonsOf = (metresPerNewton) => 0.3 / metresPerNewton;

/** The parts of an entity in its frame. */
export function compile(entity) {
  const simple = (solid) => (m) => ({ ...pose(m.pose), solid, s: vector(m.size), colour: colour(m.color), ends: ENDS });
  const cylinder = (m) => ({ ...simple("cylinder")(m), ends: [m.bottom_scale, m.top_scale] });
  const mesh = (m) => ({ ...pose(m.pose), triangles: m, s: [1, 1, 1], colour: colour(m.color), ends: ENDS });
  return {
    frame: entity.frame_id,
    parts: [
      ...entity.cubes.map(simple("box")), ...entity.spheres.map(simple("sphere")), ...entity.cylinders.map(cylinder),
      ...entity.triangles.map(mesh), ...entity.arrows.flatMap(arrowParts),
    ],
    lines: entity.lines.map(segments),
    texts: entity.texts.map((t) => ({ p: pose(t.pose).p, text: t.text })),
  };
}

/** Takes a SceneUpdate into a map of entities by id. */
export function takeScene(entities, message) {
  for (const deletion of message.deletions) {
    if (deletion.type === 1) entities.clear(); else entities.delete(deletion.id);
  }
  for (const entity of message.entities) entities.set(entity.id, compile(entity));
}

// A little towards the colour of what is selected.
const chosen = ([r, g, b, a]) => [0.35 * r + 0.1, 0.35 * g + 0.42, 0.35 * b + 0.6, a];

/** Puts entities into a drawing; `poses` maps frames to `{ p, q }`, `ghost` is a colour that they are seen through in. */
export function drawEntities(drawing, entities, poses, { selected = null, marks = false, texts = null, ghost = null } = {}) {
  const [meshes, shapes] = ghost ? [drawing.ghostMeshes, drawing.ghosts] : [drawing.meshes, drawing.shapes];
  for (const { frame, parts, lines, texts: own } of entities.values()) {
    const at = frame === "world" || frame === "" ? WORLD : poses.get(frame);
    if (!at) continue;
    for (const part of parts) {
      const { p, q } = inFrame(at, part);
      const tint = ghost ?? (frame === selected ? chosen(part.colour) : part.colour);
      const numbers = [...placed(p, q, part.s), ...tint, ...part.ends];
      if (part.triangles) meshes.push({ triangles: part.triangles, numbers: new Float32Array(numbers) });
      else (marks && drawing.marks[part.solid] ? drawing.marks : shapes)[part.solid].push(numbers);
    }
    for (const { pairs, colour: tint } of lines) {
      for (const [a, b] of pairs) for (const p of [a, b]) drawing.lines.push(add(at.p, turn(at.q, p)), tint);
    }
    for (const text of own) texts?.push({ p: add(at.p, turn(at.q, text.p)), text: text.text });
  }
}

/** A bar from `tail` along `way`, m. */
export function drawBar(drawing, tail, way, tint, width) {
  drawing.marks.cylinder.push(placed(add(tail, times(way, 0.5)), upTo(way), [width, width, length(way)]), tint, ENDS);
}

/** An arrow from `tail` along `vector`, m. */
export function drawArrow(drawing, tail, way, tint, width) {
  const size = length(way);
  if (!(size > 1e-6)) return;
  const head = Math.min(3 * width, 0.4 * size);
  const [q, along] = [upTo(way), times(way, 1 / size)];
  const at = (x) => add(tail, times(along, x));
  drawing.marks.cylinder.push(
    placed(at((size - head) / 2), q, [width, width, size - head]), tint, ENDS,
    placed(at(size - head / 2), q, [2.6 * width, 2.6 * width, head]), tint, [1, 0],
  );
}

/** An arc about `axis` through an angle (rad), with a head: how a motor turns. */
export function drawArc(drawing, centre, axis, radius, angle, tint, width) {
  const pieces = Math.max(Math.ceil(Math.abs(angle) / 0.3), 1);
  const side = turn(upTo(axis), [1, 0, 0]);
  const normal = turn(upTo(axis), [0, 1, 0]);
  const at = (a) => add(centre, add(times(side, radius * Math.cos(a)), times(normal, radius * Math.sin(a))));
  for (let k = 0; k < pieces; k++) {
    const [a, b] = [at((angle * k) / pieces), at((angle * (k + 1)) / pieces)];
    const way = minus3(b, a);
    const middle = times(add(a, b), 0.5);
    drawing.marks.cylinder.push(placed(middle, upTo(way), [width, width, 1.02 * length(way)]), tint, ENDS);
  }
  const [end, ahead] = [at(angle), minus3(at(angle + Math.sign(angle) * 0.1), at(angle))];
  const q = upTo(ahead);
  const head = 3.2 * width;
  drawing.marks.cylinder.push(placed(add(end, turn(q, [0, 0, head / 2])), q, [2.8 * width, 2.8 * width, head]), tint, [1, 0]);
}
