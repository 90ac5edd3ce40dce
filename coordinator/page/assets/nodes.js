// Height and sinkage of the nodes of the ground: unpacking, and the text under the pointer. No page is needed.

/** Differences of whole numbers modulo 2^16, added up. */
export function summed(differences) {
  const numbers = new Uint16Array(differences.length);
  let sum = 0;
  differences.forEach((d, k) => { numbers[k] = sum = (sum + d) & 0xffff; });
  return numbers;
}

/** Number of the node next to a place; -1 outside of the ground. */
export function nodeAt(nodes, x, y) {
  const [i, j] = [(x - nodes.origin[0]) / nodes.spacing, (y - nodes.origin[1]) / nodes.spacing].map(Math.round);
  const inside = i >= 0 && j >= 0 && i < nodes.size[0] && j < nodes.size[1];
  return inside ? j * nodes.size[0] + i : -1;
}

/** Value of a packed field at a node. */
export const valueAt = (field, node) => field.low + field.step * field.numbers[node];

/** Text about a place; with height and sinkage where they are known and the place is on the ground. */
export function groundText(nodes, x, y) {
  const signed = (value, digits) => {
    const text = value.toFixed(digits);
    return (Number(text) === 0 ? text.replace("-", "") : text).replace(/-/g, "−");
  };
  const place = `x = ${signed(x, 3)} m, y = ${signed(y, 3)} m`;
  const node = nodes?.height.numbers && nodes.sinkage.numbers ? nodeAt(nodes, x, y) : -1;
  if (node < 0) return place;
  const [height, sinkage] = [valueAt(nodes.height, node), valueAt(nodes.sinkage, node)];
  return `${place}: height ${signed(height, 4)} m, sinkage ${signed(1e3 * sinkage, 1)} mm`;
}

/** Unpacks both fields; browsers without DecompressionStream show places only. */
export async function unpackNodes(nodes) {
  const inflate = async (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint16Array(await new Response(stream).arrayBuffer());
  };
  for (const field of [nodes.height, nodes.sinkage]) field.numbers = summed(await inflate(field.data));
}
