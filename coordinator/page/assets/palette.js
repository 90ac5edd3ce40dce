// Colours of the ground by height, sinkage and slope. Those of sinkage are the ones of the map: undisturbed ground is grey,
// sinkage runs through amber and red to violet, heave towards blue-green.

const STOPS = {
  1: ["#31465c", "#4f7480", "#8aa08c", "#c9bf9b", "#efe9dc"],
  2: ["#1d6f86", "#6fa3a8", "#bdb8ae", "#d89b4c", "#c45740", "#8b295c", "#2b1052"],
  3: ["#bdb8ae", "#d3bd76", "#d07f45", "#a33a3f", "#4d1c4f"],
};
// Where the stops stand; those of sinkage are grey in the middle.
const PLACES = { 2: [0, 0.25, 0.5, 0.625, 0.75, 0.875, 1] };

const channels = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));

/** The colour of a share of the scale (0 to 1) of a layer, as red, green, blue to 255. */
export function colourAt(layer, share) {
  const stops = STOPS[layer];
  const places = PLACES[layer] ?? stops.map((_, k) => k / (stops.length - 1));
  const next = Math.max(places.findIndex((p) => p >= share), 1);
  const f = (share - places[next - 1]) / (places[next] - places[next - 1]);
  const [a, b] = [channels(stops[next - 1]), channels(stops[next])];
  return a.map((x, k) => Math.round(x + f * (b[k] - x)));
}

/** The rows of the texture: layers 1 to 3. */
export function paletteRows() {
  const out = new Uint8Array(3 * 256 * 4);
  for (const layer of [1, 2, 3]) {
    for (let k = 0; k < 256; k++) out.set([...colourAt(layer, k / 255), 255], 4 * (256 * (layer - 1) + k));
  }
  return out;
}

/** The scale of a layer as the background of an element. */
export function gradient(layer, from = 0, to = 1) {
  const stop = (k) => `rgb(${colourAt(layer, from + ((to - from) * k) / 16).join(" ")})`;
  return `linear-gradient(to right, ${Array.from({ length: 17 }, (_, k) => stop(k)).join(", ")})`;
}
