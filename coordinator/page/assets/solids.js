// The solids that all shapes are made of, one metre wide around the origin: corners and outward directions, three corners a face.

const TURN = 2 * Math.PI;

// Corners of a face that is given by its rim, with one direction for all.
function fan(out, rim, normal) {
  for (let k = 1; k + 1 < rim.length; k++) for (const p of [rim[0], rim[k], rim[k + 1]]) out.push(...p, ...normal);
}

function box() {
  const out = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [-0.5, 0.5]) {
      const at = (u, v) => { const p = [0, 0, 0]; p[axis] = side; p[(axis + 1) % 3] = u * side * 2; p[(axis + 2) % 3] = v; return p; };
      const normal = [0, 0, 0];
      normal[axis] = 2 * side;
      fan(out, [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)], normal);
    }
  }
  return out;
}

function sphere(columns, rows) {
  const out = [];
  const at = (c, r) => {
    const [a, b] = [(TURN * c) / columns, (Math.PI * r) / rows];
    return [Math.sin(b) * Math.cos(a), Math.sin(b) * Math.sin(a), -Math.cos(b)];
  };
  const put = (n) => out.push(n[0] / 2, n[1] / 2, n[2] / 2, ...n);
  for (let r = 0; r < rows; r++) {
    for (let c = 0; c < columns; c++) {
      const [a, b, d, e] = [at(c, r), at(c + 1, r), at(c + 1, r + 1), at(c, r + 1)];
      for (const n of [a, b, d, a, d, e]) put(n);
    }
  }
  return out;
}

function cylinder(sides) {
  const out = [];
  const rim = (z) => Array.from({ length: sides }, (_, k) => {
    const a = (TURN * k) / sides;
    return [Math.cos(a) / 2, Math.sin(a) / 2, z];
  });
  const [low, high] = [rim(-0.5), rim(0.5)];
  const put = (p) => out.push(...p, 2 * p[0], 2 * p[1], 0);
  for (let k = 0; k < sides; k++) {
    const next = (k + 1) % sides;
    for (const p of [low[k], low[next], high[next], low[k], high[next], high[k]]) put(p);
  }
  fan(out, low.slice().reverse(), [0, 0, -1]);
  fan(out, high, [0, 0, 1]);
  return out;
}

/** Corners with directions of each solid, by name; fewer where the processor draws. */
export const solids = (few) => ({ box: box(), sphere: few ? sphere(16, 9) : sphere(24, 14), cylinder: cylinder(few ? 20 : 28) });

/** The same for a list of triangles (`points` of `{x, y, z}`, `indices` three a face), flat faces. */
export function meshCorners(points, indices) {
  const order = indices.length ? indices : points.map((_, k) => k);
  const out = new Float32Array(order.length * 6);
  for (let f = 0; f + 2 < order.length; f += 3) {
    const [a, b, c] = [points[order[f]], points[order[f + 1]], points[order[f + 2]]];
    const [ux, uy, uz, vx, vy, vz] = [b.x - a.x, b.y - a.y, b.z - a.z, c.x - a.x, c.y - a.y, c.z - a.z];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const size = Math.hypot(...n) || 1;
    [a, b, c].forEach((p, k) => out.set([p.x, p.y, p.z, n[0] / size, n[1] / size, n[2] / size], (f + k) * 6));
  }
  return out;
}
