// The replay of a report as numbers: unpacks poses, forces and changes of the ground, and gives them at any time.
import { unpack } from "terraglue/axes.js";
import { between } from "terraglue/math.js";
import { summed, unpackNodes, valueAt } from "terraglue/nodes.js";

/** Bytes of deflated base64. */
export async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Numbers that were packed as whole steps.
async function column({ low, step, data }) {
  const numbers = summed(new Uint16Array((await inflate(data)).buffer));
  return Float32Array.from(numbers, (n) => low + step * n);
}

// Where each time's rows begin.
function starts(counts) {
  const out = new Uint32Array(counts.length + 1);
  counts.forEach((n, k) => { out[k + 1] = out[k] + n; });
  return out;
}

/** Index of the last time at or before t, at least 0. */
export function rowAt(times, t) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1; else high = middle;
  }
  return Math.max(low - 1, 0);
}

/** Poses and forces over time. */
export class Track {
  static async read(replay) {
    const own = new Track();
    own.t = unpack(replay.t);
    own.frames = replay.frames;
    own.columns = await Promise.all(replay.poses.map(column));
    own.forceStarts = starts(unpack(replay.forces.counts));
    own.forceColumns = await Promise.all(replay.forces.columns.map(column));
    return own;
  }

  /** Puts the poses at a time into a map, between those that were recorded. */
  posesAt(t, into) {
    const row = rowAt(this.t, t);
    const next = Math.min(row + 1, this.t.length - 1);
    const share = next > row ? Math.min(Math.max((t - this.t[row]) / (this.t[next] - this.t[row]), 0), 1) : 0;
    this.frames.forEach((frame, k) => {
      const [a, b] = [row, next].map((r) => this.columns.map((c) => c[k * this.t.length + r]));
      const p = [0, 1, 2].map((n) => a[n] + share * (b[n] - a[n]));
      into.set(frame, { p, q: between(a.slice(3), b.slice(3), share) });
    });
  }

  /** Forces at a time: where (m) and what (N). */
  forcesAt(t) {
    const row = rowAt(this.t, t);
    const out = [];
    for (let k = this.forceStarts[row]; k < this.forceStarts[row + 1]; k++) {
      const [x, y, z, fx, fy, fz] = this.forceColumns.map((c) => c[k]);
      out.push({ p: [x, y, z], f: [fx, fy, fz] });
    }
    return out;
  }

  /** A force that only one in ten exceeds, N. */
  get large() {
    const [x, y, z] = this.forceColumns.slice(3);
    const sizes = Array.from(x, (f, k) => Math.hypot(f, y[k], z[k])).sort((a, b) => a - b);
    return sizes.at(Math.floor(0.9 * sizes.length)) ?? 1;
  }
}

/** The ground over time: heights at the start, and what each change made of it, forwards and backwards. */
export class GroundTrack {
  static async read(nodes, ground) {
    if (!nodes.height.numbers) await unpackNodes(nodes);
    const own = new GroundTrack();
    own.t = unpack(ground.t);
    own.starts = starts(unpack(ground.counts));
    const differences = new Uint32Array((await inflate(ground.nodes)).buffer);
    let sum = 0;
    own.nodes = differences.map((d) => { sum = (sum + d) >>> 0; return sum; });
    own.after = await column(ground.heights);
    own.before = new Float32Array(own.after.length);
    own.row = 0;
    own.nx = nodes.size[0];
    return own;
  }

  /** Fills a relief with the ground at the start. */
  begin(relief, nodes) {
    const { height, sinkage } = nodes;
    for (let k = 0; k < relief.height.length; k++) relief.height[k] = valueAt(height, k) + valueAt(sinkage, k);
    const now = relief.height.slice();
    this.nodes.forEach((node, k) => { this.before[k] = now[node]; now[node] = this.after[k]; });
    this.first = relief.height.slice();
    relief.load();
  }

  /** Brings a relief to a time, and loads the rectangle that changed. */
  go(relief, t) {
    const target = this.t.length && t >= this.t[0] ? rowAt(this.t, t) + 1 : 0;
    const { nx } = this;
    let [i0, j0, i1, j1] = [Infinity, Infinity, -1, -1];
    const set = (node, z) => {
      relief.height[node] = z;
      relief.sinkage[node] = this.first[node] - z;
      const [i, j] = [node % nx, Math.floor(node / nx)];
      [i0, j0, i1, j1] = [Math.min(i0, i), Math.min(j0, j), Math.max(i1, i), Math.max(j1, j)];
    };
    const [from, to] = [this.starts[this.row], this.starts[target]];
    for (let k = from; k < to; k++) set(this.nodes[k], this.after[k]);
    for (let k = from - 1; k >= to; k--) set(this.nodes[k], this.before[k]);
    this.row = target;
    if (i1 >= 0) relief.load(i0, j0, i1 - i0 + 1, j1 - j0 + 1);
  }
}
