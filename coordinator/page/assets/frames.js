// Answers of `/at` and `/messages`: messages of several channels one after another, each with its channel and time.

/** Calls `take(channel id, t_s, bytes)` for each. */
export function eachFrame(buffer, take) {
  const view = new DataView(buffer);
  let at = 0;
  while (at + 16 <= view.byteLength) {
    const size = view.getUint32(at + 12, true);
    take(view.getUint32(at, true), Number(view.getBigUint64(at + 4, true)) / 1e9, new Uint8Array(buffer, at + 16, size));
    at += 16 + size;
  }
}

/** Bytes without their zlib wrapping. */
export async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// One layer of a tile: the first number, then differences along each row; the first of a row differs from the first of the row before.
function layer(view, at, width, height) {
  const out = new Uint16Array(width * height);
  let first = 0;
  for (let j = 0, k = 0; j < height; j++) {
    let value = first;
    for (let i = 0; i < width; i++, k++) {
      value = (value + view.getUint16(at + 2 * k, true)) & 0xffff;
      out[k] = value;
      if (i === 0) first = value;
    }
  }
  return out;
}

/** Puts a message of `/ground/tiles` into a relief; gives how many tiles it had. */
export async function takeTiles(message, relief, { z0, dz }) {
  const bytes = await inflated(message);
  const view = new DataView(bytes.buffer);
  const count = view.getUint32(0, true);
  const { nx } = relief.lattice;
  let at = 4;
  for (let n = 0; n < count; n++) {
    const [i0, j0, width, height] = [0, 2, 4, 6].map((o) => view.getUint16(at + o, true));
    const size = 2 * width * height;
    const [z, s] = [layer(view, at + 8, width, height), layer(view, at + 8 + size, width, height)];
    for (let j = 0, k = 0; j < height; j++) {
      for (let i = 0; i < width; i++, k++) {
        const node = (j0 + j) * nx + i0 + i;
        relief.height[node] = z0 + dz * z[k];
        // heave is negative: numbers above the middle are below zero
        relief.sinkage[node] = dz * (s[k] > 0x7fff ? s[k] - 0x10000 : s[k]);
      }
    }
    if (count < 9) relief.load(i0, j0, width, height);
    at += 8 + 2 * size;
  }
  if (count >= 9) relief.load();
  return count;
}
