// The ground from above: picture, outlines, footprints, tracks and path in metres; drag a rectangle to zoom.
import { colourOf, htmlElement, minus, niceTicks, short, svgElement, unpack } from "terraglue/axes.js";
import { groundText, unpackNodes } from "terraglue/nodes.js";

/** The map of a report in the element `map`. */
export class GroundMap {
  static margin = { left: 46, right: 8, top: 8, bottom: 34 };

  constructor(map) {
    this.map = map;
    this.svg = document.getElementById("map-svg");
    this.readout = document.getElementById("map-readout");
    this.path = map.path && { x: unpack(map.path.x), y: unpack(map.path.y) };
    const line = (o) => ({ ...o, x: unpack(o.x), y: unpack(o.y) });
    this.outlines = map.outlines.map(line);
    this.marks = map.marks.map(line);
    this.tracks = map.tracks.map((t) => ({ ...line(t), end: line(t.end) }));
    if (map.nodes) unpackNodes(map.nodes).catch(() => {});
    this.view = map.image ? this.track() : this.whole();
    for (const button of document.querySelectorAll("#map [data-view]")) {
      button.onclick = () => this.show(button.dataset.view === "track" ? this.track() : this.whole());
    }
    this.buildLegend();
    this.buildScale();
    this.bindPointer();
    new ResizeObserver(() => this.draw()).observe(this.svg.parentElement);
  }

  whole() { return { x: [...this.map.x], y: [...this.map.y] }; }

  // The extent of path, marks and tracks, with a margin.
  track() {
    const touched = [...(this.path ? [this.path] : []), ...this.marks, ...this.tracks];
    const [xs, ys] = [touched.flatMap((l) => [...l.x]), touched.flatMap((l) => [...l.y])];
    if (!xs.length) return this.whole();
    const span = (values, limits) => {
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const air = 0.12 + 0.04 * (high - low);
      return [Math.max(low - air, limits[0]), Math.min(high + air, limits[1])];
    };
    return { x: span(xs, this.map.x), y: span(ys, this.map.y) };
  }

  show(view) { this.view = view; this.draw(); }

  // Equal scale on both axes: the view is centred in the frame.
  fit() {
    const m = GroundMap.margin;
    this.width = Math.max(this.svg.clientWidth - m.left - m.right, 50);
    const [w, h] = [this.view.x[1] - this.view.x[0], this.view.y[1] - this.view.y[0]];
    this.height = Math.min(Math.max((this.width * h) / w, 220), 560);
    this.scale = Math.min(this.width / w, this.height / h);
    const centre = [(this.view.x[0] + this.view.x[1]) / 2, (this.view.y[0] + this.view.y[1]) / 2];
    this.x0 = centre[0] - this.width / this.scale / 2;
    this.y1 = centre[1] + this.height / this.scale / 2;
    this.svg.setAttribute("height", this.height + m.top + m.bottom);
  }
  x(metres) { return GroundMap.margin.left + (metres - this.x0) * this.scale; }
  y(metres) { return GroundMap.margin.top + (this.y1 - metres) * this.scale; }
  at(event) {
    const box = this.svg.getBoundingClientRect();
    const m = GroundMap.margin;
    const clamp = (v, high) => Math.min(Math.max(v, 0), high);
    return [
      this.x0 + clamp(event.clientX - box.left - m.left, this.width) / this.scale,
      this.y1 - clamp(event.clientY - box.top - m.top, this.height) / this.scale,
    ];
  }

  draw() {
    this.fit();
    const { left, top } = GroundMap.margin;
    this.svg.replaceChildren();
    const clip = svgElement(svgElement(this.svg, "defs"), "clipPath", { id: "map-clip" });
    svgElement(clip, "rect", { x: left, y: top, width: this.width, height: this.height });
    const group = svgElement(this.svg, "g", { "clip-path": "url(#map-clip)" });
    const [x, y] = [this.map.x, this.map.y];
    const ground = {
      x: this.x(x[0]), y: this.y(y[1]), width: (x[1] - x[0]) * this.scale, height: (y[1] - y[0]) * this.scale,
    };
    if (this.map.image) svgElement(group, "image", { href: this.map.image, preserveAspectRatio: "none", ...ground });
    else svgElement(group, "rect", { class: "bare", ...ground });
    this.drawGrid(group);
    this.drawOutlines(group);
    this.drawPrints(group);
    this.drawPath(group);
    this.brush = svgElement(this.svg, "rect", { class: "brush", width: 0, height: 0 });
  }

  drawGrid(group) {
    const { left, top } = GroundMap.margin;
    const [right, bottom] = [left + this.width, top + this.height];
    const label = (text, attributes) => { svgElement(this.svg, "text", attributes).textContent = text; };
    const xs = niceTicks(this.x0, this.x0 + this.width / this.scale, this.width / 90);
    for (const v of xs.ticks) {
      const x = Math.round(this.x(v)) + 0.5;
      svgElement(group, "line", { class: "grid", x1: x, x2: x, y1: top, y2: bottom });
      label(minus(v.toFixed(xs.decimals)), { x, y: bottom + 15, "text-anchor": "middle" });
    }
    const ys = niceTicks(this.y1 - this.height / this.scale, this.y1, this.height / 70);
    for (const v of ys.ticks) {
      const y = Math.round(this.y(v)) + 0.5;
      svgElement(group, "line", { class: "grid", x1: left, x2: right, y1: y, y2: y });
      label(minus(v.toFixed(ys.decimals)), { x: left - 7, y: y + 4, "text-anchor": "end" });
    }
    svgElement(this.svg, "rect", { class: "frame", x: left + 0.5, y: top + 0.5, width: this.width, height: this.height });
    label("x (m)", { x: right, y: bottom + 30, "text-anchor": "end" });
    label("y (m)", { x: 10, y: top + 12, transform: `rotate(-90 10 ${top + 12})`, "text-anchor": "end" });
  }

  // Outlines of what was in the ground, and bands where it rolled or slid.
  drawPrints(group) {
    const said = (of) => {
      const depth = Number.isFinite(of.depth) ? `, ${short(1e3 * of.depth, 2)} mm deep at the end` : "";
      return `${this.map.legs[of.leg]}: ${of.from.toFixed(2)} s to ${of.to.toFixed(2)} s, up to ${short(of.force, 3)} N${depth}`;
    };
    const outline = (of, place) => {
      const d = `${this.line(place)}Z`;
      svgElement(group, "path", { class: "print-halo", d });
      const print = svgElement(group, "path", { class: "print", d });
      print.style.stroke = colourOf(of.leg);
      svgElement(print, "title").textContent = said(of);
    };
    for (const track of this.tracks) {
      const band = svgElement(group, "path", { class: "band", d: this.line(track) });
      band.style.stroke = colourOf(track.leg);
      band.style.strokeWidth = Math.max((track.width ?? 0) * this.scale, 3);
      svgElement(band, "title").textContent = said(track);
      outline(track, track.end);
    }
    for (const mark of this.marks) outline(mark, mark);
  }

  // The path of an SVG line through these places.
  line({ x, y }) {
    return `M${Array.from(x, (x, k) => `${this.x(x).toFixed(1)} ${this.y(y[k]).toFixed(1)}`).join("L")}`;
  }

  drawOutlines(group) {
    for (const outline of this.outlines) {
      const d = this.line(outline);
      svgElement(group, "path", { class: "halo", d });
      svgElement(svgElement(group, "path", { class: "outline", d }), "title").textContent = outline.name;
    }
  }

  drawPath(group) {
    if (!this.path || this.path.x.length < 2) return;
    const d = this.line(this.path);
    for (const name of ["halo", "path"]) svgElement(group, "path", { class: name, d });
    const dot = (k, fill) => svgElement(group, "circle", {
      cx: this.x(this.path.x.at(k)), cy: this.y(this.path.y.at(k)), r: 4.5, fill, stroke: "#16181b", "stroke-width": 1.6,
    });
    svgElement(dot(0, "#fff"), "title").textContent = "start of the body";
    svgElement(dot(-1, "#16181b"), "title").textContent = "end of the body";
  }

  bindPointer() {
    let from = null;
    this.svg.onpointerdown = (event) => { from = this.at(event); this.svg.setPointerCapture(event.pointerId); };
    this.svg.onpointermove = (event) => {
      const at = this.at(event);
      this.readout.textContent = groundText(this.map.nodes, ...at);
      this.drawBrush(from, at);
    };
    this.svg.onpointerup = (event) => {
      const [a, b] = [from, this.at(event)];
      from = null;
      this.drawBrush(null);
      const far = a && Math.hypot(b[0] - a[0], b[1] - a[1]) * this.scale > 8;
      const order = (u, v) => [Math.min(u, v), Math.max(u, v) + 1e-6];
      if (far) this.show({ x: order(a[0], b[0]), y: order(a[1], b[1]) });
    };
    this.svg.onpointercancel = () => { from = null; this.drawBrush(null); };
    this.svg.ondblclick = () => this.show(this.track());
  }

  drawBrush(a, b) {
    if (!this.brush) return;
    const box = a === null
      ? { x: 0, y: 0, width: 0, height: 0 }
      : {
        x: this.x(Math.min(a[0], b[0])), y: this.y(Math.max(a[1], b[1])),
        width: Math.abs(a[0] - b[0]) * this.scale, height: Math.abs(a[1] - b[1]) * this.scale,
      };
    for (const [key, value] of Object.entries(box)) this.brush.setAttribute(key, value);
  }

  buildLegend() {
    const legend = document.getElementById("map-legend");
    this.map.legs.forEach((leg, k) => {
      htmlElement(legend, "span", "key", leg).style.setProperty("--curve", colourOf(k));
    });
    if (this.outlines.length) {
      htmlElement(legend, "span", "key dashed", "stands still").style.setProperty("--curve", "var(--ink)");
    }
    if (this.path) htmlElement(legend, "span", "key", "path of the body").style.setProperty("--curve", "var(--ink)");
  }

  // Colour bar in millimetres below the picture.
  buildScale() {
    const scale = this.map.scale;
    if (!scale) return;
    const svg = svgElement(document.getElementById("map-scale"), "svg", { height: 44, viewBox: "0 0 360 44" });
    const gradient = svgElement(svgElement(svg, "defs"), "linearGradient", { id: "sinkage" });
    for (const [share, colour] of scale.stops) svgElement(gradient, "stop", { offset: share, "stop-color": colour });
    svgElement(svg, "rect", { x: 130, y: 8, width: 216, height: 10, rx: 2, fill: "url(#sinkage)" });
    const text = (value, x, y, anchor) => {
      svgElement(svg, "text", { x, y, "text-anchor": anchor }).textContent = value;
    };
    text("sinkage (mm)", 120, 17, "end");
    const [low, high] = [scale.low * 1e3, scale.high * 1e3];
    const { ticks, decimals } = niceTicks(low, high, 5);
    for (const v of ticks) text(minus(v.toFixed(decimals)), 130 + (216 * (v - low)) / (high - low), 33, "middle");
  }
}
