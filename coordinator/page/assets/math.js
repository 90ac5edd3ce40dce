// Vectors, quaternions (w, x, y, z) and matrices (column by column, as WebGL reads them). z is up.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const minus3 = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const unit = (a) => times(a, 1 / (length(a) || 1));

/** The vector turned by a quaternion. */
export function turn(q, v) {
  const u = [q[1], q[2], q[3]];
  const once = cross(u, v);
  return add(v, times(cross(u, add(once, times(v, q[0]))), 2));
}

/** The turn of b, then that of a. */
export function product(a, b) {
  const [p, x, y, z] = a;
  const [q, u, v, w] = b;
  return [
    p * q - x * u - y * v - z * w, p * u + x * q + y * w - z * v,
    p * v - x * w + y * q + z * u, p * w + x * v - y * u + z * q,
  ];
}

/** Between two quaternions; `share` 0 is the first. */
export function between(a, b, share) {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const q = a.map((x, k) => x + share * (sign * b[k] - x));
  const size = Math.hypot(...q) || 1;
  return q.map((x) => x / size);
}

/** The turn of the z axis to a direction. */
export function upTo(direction) {
  const [x, y, z] = unit(direction);
  if (z < -1 + 1e-9) return [0, 1, 0, 0];
  const q = [1 + z, -y, x, 0];
  const size = Math.hypot(...q);
  return q.map((c) => c / size);
}

/** Place, turn and size as a matrix. */
export function placed(p, [w, x, y, z], s) {
  return [
    (1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + w * z) * s[0], 2 * (x * z - w * y) * s[0], 0,
    2 * (x * y - w * z) * s[1], (1 - 2 * (x * x + z * z)) * s[1], 2 * (y * z + w * x) * s[1], 0,
    2 * (x * z + w * y) * s[2], 2 * (y * z - w * x) * s[2], (1 - 2 * (x * x + y * y)) * s[2], 0,
    p[0], p[1], p[2], 1,
  ];
}

/** A pose in the frame of another: `{ p, q }`. */
export const inFrame = (frame, own) => ({ p: add(frame.p, turn(frame.q, own.p)), q: product(frame.q, own.q) });

/** The product of two matrices. */
export function matrixProduct(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    for (let r = 0; r < 4; r++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + r] * b[4 * c + k];
      out[4 * c + r] = sum;
    }
  }
  return out;
}

/** View matrix of a camera at `eye` that looks at `target`. */
export function lookAt(eye, target, up) {
  const back = unit(minus3(eye, target));
  const right = unit(cross(up, back));
  const above = cross(back, right);
  return [
    right[0], above[0], back[0], 0, right[1], above[1], back[1], 0, right[2], above[2], back[2], 0,
    -dot(right, eye), -dot(above, eye), -dot(back, eye), 1,
  ];
}

/** A lens with this angle from top to bottom. */
export function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

/** A box around the origin of a light: half its width, and its depth. */
export const parallel = (half, depth) => [
  1 / half, 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -2 / depth, 0, 0, 0, -1, 1,
];

// Whether c lies to the left of the way from a to b, seen from above.
const left = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);

/** Corners of the convex polygon around points seen from above, anticlockwise (Andrew 1979). */
export function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  if (sorted.length < 3) return sorted;
  const half = (all) => {
    const out = [];
    for (const p of all) {
      while (out.length > 1 && left(out.at(-2), out.at(-1), p) <= 0) out.pop();
      out.push(p);
    }
    return out.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** Whether a place is above a convex polygon. */
export const inside = (corners, p) => corners.every((a, k) => left(a, corners[(k + 1) % corners.length], p) >= 0);
