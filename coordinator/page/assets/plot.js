// Oscilloscope plots: one time axis for all, drag to zoom, double-click to go back, values at the cursor. Report and live page
// use the same.
import { colourOf, decade, decadeTicks, htmlElement, minus, niceTicks, prefixFor, short, svgElement } from "terraglue/axes.js";

/** The time window, the cursor and the events that all plots of the page share. */
export class TimeAxis {
  constructor(low, high) {
    this.whole = [low, high];
    this.window = [low, high];
    this.cursor = null;
    this.now = null;
    this.plots = [];
    this.events = [];
    this.onPick = null;
  }
  /** Shows where the picture of the run is. */
  mark(t) {
    this.now = t;
    for (const plot of this.plots) plot.drawNow();
  }
  zoom(low, high) {
    const least = (this.whole[1] - this.whole[0]) * 1e-5;
    this.window = high - low > least ? [low, high] : this.whole;
    for (const plot of this.plots) plot.draw();
  }
  point(t) {
    this.cursor = t;
    for (const plot of this.plots) plot.drawCursor();
  }
}

/** One pair of axes over time; `panel.curves` hold times `t` and values `y`, `panel.height` is in pixels. */
export class Plot {
  static height = 196;
  static made = 0;
  static margin = { left: 62, right: 14, top: 16, bottom: 22 };

  constructor(parent, panel, axis, last) {
    Object.assign(this, { panel, axis, last, height: panel.height ?? Plot.height, id: `plot${++Plot.made}` });
    this.curves = panel.curves.map((c) => ({ ...c, on: true }));
    // Curves that are zero throughout have no logarithm: they are shown as the zero line that they are.
    this.log = panel.log === true && this.curves.some((c) => c.y.some((v) => v > 0));
    this.box = htmlElement(parent, "figure", "panel");
    this.box.style.margin = "0";
    this.buildHead();
    this.svg = svgElement(this.box, "svg", { height: this.height + (last ? 14 : 0) });
    this.bindPointer();
    axis.plots.push(this);
    new ResizeObserver(() => this.draw()).observe(this.box);
  }

  buildHead() {
    const head = htmlElement(this.box, "div", "panel-head");
    this.title = htmlElement(head, "span", "quantity");
    const legend = htmlElement(head, "span", "legend");
    for (const curve of this.curves) this.buildKey(legend, curve);
    htmlElement(head, "span", "spacer");
    this.when = htmlElement(head, "span", "when");
    if (this.panel.log !== null) {
      const label = htmlElement(head, "label", "");
      const box = htmlElement(label, "input");
      Object.assign(box, { type: "checkbox", checked: this.log });
      box.onchange = () => { this.log = box.checked; this.draw(); };
      label.append(" log");
    }
  }

  buildKey(legend, curve) {
    const key = htmlElement(legend, "button", "key" + (curve.dashed ? " dashed" : ""), curve.name);
    key.type = "button";
    key.style.setProperty("--curve", colourOf(curve.colour));
    curve.output = htmlElement(key, "output");
    key.onclick = () => { curve.on = !curve.on; key.classList.toggle("off", !curve.on); this.draw(); };
    return key;
  }

  bindPointer() {
    let from = null;
    const time = (event) => this.timeAt(event.clientX - this.svg.getBoundingClientRect().left);
    this.svg.onpointerdown = (event) => { from = time(event); this.svg.setPointerCapture(event.pointerId); };
    this.svg.onpointermove = (event) => {
      this.axis.point(time(event));
      this.drawBrush(from, time(event));
    };
    this.svg.onpointerup = (event) => {
      const to = time(event);
      const start = from;
      from = null;
      this.drawBrush(null);
      if (start !== null && Math.abs(this.x(to) - this.x(start)) > 5) {
        this.axis.zoom(Math.min(start, to), Math.max(start, to));
      } else if (start !== null) this.axis.onPick?.(to);
    };
    this.svg.onpointercancel = () => { from = null; this.drawBrush(null); };
    this.svg.onpointerleave = () => { if (from === null) this.axis.point(null); };
    this.svg.ondblclick = () => this.axis.zoom(...this.axis.whole);
  }

  // Places in pixels.
  x(t) {
    const [low, high] = this.axis.window;
    return Plot.margin.left + ((t - low) / (high - low || 1)) * this.width;
  }
  timeAt(x) {
    const [low, high] = this.axis.window;
    const share = Math.min(Math.max((x - Plot.margin.left) / this.width, 0), 1);
    return low + share * (high - low);
  }
  y(value) {
    const [low, high] = this.range;
    const share = this.log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return Plot.margin.top + (1 - share) * this.inner;
  }

  // Smallest and largest visible value, with some air.
  findRange() {
    let [low, high] = [Infinity, -Infinity];
    const [from, to] = this.axis.window;
    for (const c of this.curves.filter((c) => c.on)) {
      for (let k = this.first(c, from); k < c.t.length && (k === 0 || c.t[k - 1] <= to); k++) {
        const v = c.y[k];
        if (!Number.isFinite(v) || (this.log && v <= 0)) continue;
        if (v < low) low = v;
        if (v > high) high = v;
      }
      if (c.steps && !this.log) low = Math.min(low, 0);
    }
    if (low > high) return this.log ? [0.1, 1] : [0, 1];
    if (this.log) {
      low = Math.max(low, high * 1e-14);
      return [10 ** Math.floor(Math.log10(low) - 0.02), 10 ** Math.ceil(Math.log10(high) + 0.02)];
    }
    const air = (high - low) * 0.07 || Math.abs(high) * 0.1 || 1;
    return [low === 0 ? 0 : low - air, high + air];
  }

  // Index of the last point at or before t.
  first(curve, t) {
    let [low, high] = [0, curve.t.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (curve.t[middle] <= t) low = middle + 1; else high = middle;
    }
    return Math.max(low - 1, 0);
  }

  draw() {
    const m = Plot.margin;
    this.width = Math.max(this.svg.clientWidth - m.left - m.right, 50);
    this.inner = this.height - m.top - m.bottom;
    this.range = this.findRange();
    const magnitude = Math.max(Math.abs(this.range[0]), Math.abs(this.range[1]));
    this.prefix = this.log ? { symbol: "", factor: 1 } : prefixFor(magnitude, this.panel.unit);
    const unit = this.prefix.symbol + this.panel.unit;
    this.title.innerHTML = "";
    this.title.append(this.panel.quantity[0].toUpperCase() + this.panel.quantity.slice(1));
    if (unit) htmlElement(this.title, "small", "", ` (${unit})`);
    this.svg.replaceChildren();
    this.drawGrid();
    this.drawCurves();
    this.drawEvents();
    this.brush = svgElement(this.svg, "rect", { class: "brush", y: m.top, height: this.inner, width: 0 });
    this.line = svgElement(this.svg, "line", { class: "cursor", y1: m.top, y2: m.top + this.inner, visibility: "hidden" });
    this.present = svgElement(this.svg, "line", { class: "now", y1: m.top, y2: m.top + this.inner, visibility: "hidden" });
    this.drawCursor();
    this.drawNow();
  }

  drawGrid() {
    const { left, top } = Plot.margin;
    const [right, bottom] = [left + this.width, top + this.inner];
    const label = (text, attributes) => { svgElement(this.svg, "text", attributes).textContent = text; };
    const across = this.acrossTicks();
    for (const [t, text] of across.ticks) {
      const x = Math.round(this.x(t)) + 0.5;
      svgElement(this.svg, "line", { class: "grid", x1: x, x2: x, y1: top, y2: bottom });
      label(text, { x, y: bottom + 15, "text-anchor": "middle" });
    }
    for (const [value, text] of this.valueTicks()) {
      const y = Math.round(this.y(value)) + 0.5;
      svgElement(this.svg, "line", { class: "grid", x1: left, x2: right, y1: y, y2: y });
      label(text, { x: left - 7, y: y + 4, "text-anchor": "end" });
    }
    svgElement(this.svg, "rect", { class: "frame", x: left + 0.5, y: top + 0.5, width: this.width, height: this.inner });
    if (this.last) label(across.title, { x: right, y: bottom + 30, "text-anchor": "end" });
  }

  acrossTicks() {
    const { ticks, decimals } = niceTicks(...this.axis.window, this.width / 90);
    return { ticks: ticks.map((t) => [t, minus(t.toFixed(decimals))]), title: "time (s)" };
  }

  valueTicks() {
    if (this.log) return decadeTicks(...this.range, 6).map((v) => [v, decade(v)]);
    const f = this.prefix.factor;
    let { ticks, decimals } = niceTicks(this.range[0] / f, this.range[1] / f, this.inner / 25);
    if (this.curves.every((c) => c.steps) && !this.panel.unit) {
      [ticks, decimals] = [ticks.filter(Number.isInteger), 0];
    }
    return ticks.map((v) => [v * f, minus(v.toFixed(decimals))]);
  }

  drawCurves() {
    const { left, top } = Plot.margin;
    const id = `clip-${this.id}`;
    const clip = svgElement(svgElement(this.svg, "defs"), "clipPath", { id });
    svgElement(clip, "rect", { x: left, y: top, width: this.width, height: this.inner });
    const group = svgElement(this.svg, "g", { "clip-path": `url(#${id})` });
    for (const curve of this.curves.filter((c) => c.on)) {
      const path = svgElement(group, "path", { class: "curve" + (curve.dashed ? " dashed" : ""), d: this.pathOf(curve) });
      path.style.stroke = colourOf(curve.colour);
    }
  }

  // First, lowest, highest and last value of every pixel column: no peak is lost. A point without neighbours
  // is a dot: the stroke of no length that every piece begins with.
  pathOf(curve) {
    const parts = [];
    let [pen, column, points] = [false, null, []];
    const put = (x, v) => {
      const y = this.y(v).toFixed(1);
      parts.push(pen ? (curve.steps ? `H${x.toFixed(1)}V${y}` : `L${x.toFixed(1)} ${y}`) : `M${x.toFixed(1)} ${y}h.01`);
      pen = true;
    };
    const flush = () => {
      if (points.length > 4) {
        const rest = points.slice(1, -1);
        const low = rest.reduce((a, b) => (b[1] < a[1] ? b : a));
        const high = rest.reduce((a, b) => (b[1] > a[1] ? b : a));
        const inner = low === high ? [low] : low[0] < high[0] ? [low, high] : [high, low];
        points = [points[0], ...inner, points.at(-1)];
      }
      for (const [x, v] of points) put(x, v);
      points = [];
    };
    const [from, to] = this.axis.window;
    for (let k = this.first(curve, from); k < curve.t.length; k++) {
      const v = curve.y[k];
      const x = this.x(curve.t[k]);
      if (Math.round(x) !== column) { flush(); column = Math.round(x); }
      if (Number.isFinite(v) && !(this.log && v <= 0)) points.push([x, v]);
      else { flush(); pen = false; }
      if (curve.t[k] > to) break;
    }
    flush();
    return parts.join("");
  }

  drawEvents() {
    const { left, top } = Plot.margin;
    this.axis.events.forEach((event, k) => {
      const x = this.x(event.t);
      if (x < left || x > left + this.width) return;
      const group = svgElement(this.svg, "g", { class: "flag" });
      svgElement(group, "line", { class: "mark", x1: x, x2: x, y1: top, y2: top + this.inner });
      svgElement(group, "circle", { cx: x, cy: top - 7, r: 7 });
      svgElement(group, "text", { x, y: top - 3.5 }).textContent = k + 1;
      svgElement(group, "title").textContent = `${short(event.t, 6)} s: ${event.what}`;
    });
  }

  drawBrush(from, to) {
    if (!this.brush) return;
    const [a, b] = from === null ? [0, 0] : [this.x(Math.min(from, to)), this.x(Math.max(from, to))];
    this.brush.setAttribute("x", a);
    this.brush.setAttribute("width", b - a);
  }

  // Values are those at the cursor, else those of the picture of the run.
  drawCursor() {
    const { cursor } = this.axis;
    const t = cursor ?? this.axis.now;
    if (!this.line) return;
    this.line.setAttribute("visibility", cursor === null ? "hidden" : "visible");
    this.when.textContent = cursor === null ? "" : `t = ${cursor.toFixed(3)} s`;
    if (cursor !== null) for (const end of ["x1", "x2"]) this.line.setAttribute(end, this.x(cursor));
    for (const curve of this.curves) {
      const value = t === null || !curve.t.length ? NaN : curve.y[this.nearest(curve, t)] / this.prefix.factor;
      curve.output.textContent = t === null ? "" : short(value);
    }
  }

  // Where the picture of the run is.
  drawNow() {
    const t = this.axis.now;
    if (!this.present) return;
    const [low, high] = this.axis.window;
    const inside = t !== null && t >= low && t <= high;
    this.present.setAttribute("visibility", inside ? "visible" : "hidden");
    if (inside) for (const end of ["x1", "x2"]) this.present.setAttribute(end, this.x(t));
    if (this.axis.cursor === null) this.drawCursor();
  }

  nearest(curve, t) {
    const k = this.first(curve, t);
    const closer = k + 1 < curve.t.length && !curve.steps && curve.t[k + 1] - t < t - curve.t[k];
    return closer ? k + 1 : k;
  }
}
