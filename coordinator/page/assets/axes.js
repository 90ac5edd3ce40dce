// Functions that plots and map share: packed numbers, SVG elements, ticks, numbers as text.

/** Numbers from base64 of little-endian f32. */
export function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

/** A new SVG element in `parent`. */
export function svgElement(parent, name, attributes = {}) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

/** A new HTML element in `parent`. */
export function htmlElement(parent, name, className, text = "") {
  const element = document.createElement(name);
  if (className) element.className = className;
  element.textContent = text;
  parent?.append(element);
  return element;
}

/** Colour of curve number k. */
export const colourOf = (k) => `var(--c${k % 8})`;

/** Round numbers in [low, high], about `count` of them. */
export function niceTicks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999) ?? raw;
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k++) ticks.push(k * step);
  return { ticks, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** Powers of ten in [low, high], thinned to about `count`. */
export function decadeTicks(low, high, count) {
  const [a, b] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
  const every = Math.max(1, Math.ceil((b - a + 1) / count));
  const ticks = [];
  for (let e = a; e <= b; e++) if ((e - b) % every === 0) ticks.push(10 ** e);
  return ticks;
}

/** The text with true minus signs. */
export const minus = (text) => text.replace(/-/g, "−");
const raised = (n) => String(n).replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);
/** A power of ten as text. */
export const decade = (v) => `10${raised(Math.round(Math.log10(v)))}`;

// Power to which the first factor of a unit is raised ("m^2": 2, "m/s": 1); 0 where it takes no prefix: kg has one already.
function prefixPower(unit) {
  const first = /^([A-Za-zµΩ°%]+)(?:\^(-?\d+)|([²³]))?(?=$|[\s*·/])/.exec(unit);
  if (!first || first[1] === "kg" || first[1] === "%" || first[1] === "°") return 0;
  const power = first[3] ? "²³".indexOf(first[3]) + 2 : Number(first[2] ?? 1);
  return Math.max(power, 0);
}

/** SI prefix in which a magnitude has few digits before the point; that of a squared unit is squared: 1 mm² = 1e-6 m². Pure
 * numbers get none. */
export function prefixFor(magnitude, unit) {
  const power = unit ? prefixPower(unit) : 0;
  if (power === 0 || !(magnitude > 0)) return { symbol: "", factor: 1 };
  const table = [["M", 1e6], ["k", 1e3], ["", 1], ["m", 1e-3], ["µ", 1e-6], ["n", 1e-9], ["p", 1e-12], ["f", 1e-15]]
    .map(([symbol, f]) => [symbol, f ** power]);
  const [symbol, factor] = table.find(([, f]) => magnitude >= f * 0.9) ?? table.at(-1);
  // Two digits behind the point read better than a prefix.
  return symbol === "m" && magnitude >= 0.1 ? { symbol: "", factor: 1 } : { symbol, factor };
}

/** A number as short text. */
export function short(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [mantissa, exponent] = value.toExponential(Math.max(digits - 2, 0)).split("e");
    return minus(`${mantissa}·10`) + raised(Number(exponent));
  }
  return minus(value.toPrecision(digits));
}
