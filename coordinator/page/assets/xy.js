// A plot of one quantity over another, e.g. pressure over sinkage: curves may turn back, and time has no part in it.
import { minus, niceTicks, prefixFor, short } from "terraglue/axes.js";
import { Plot, TimeAxis } from "terraglue/plot.js";

/** The plot of a panel with an `x`. */
export class XyPlot extends Plot {
  constructor(parent, panel, last) {
    super(parent, panel, new TimeAxis(...XyPlot.span(panel.curves)), last);
  }

  // From 0 or the least to the greatest place of all curves, with some air.
  static span(curves) {
    const finite = curves.flatMap((c) => Array.from(c.t)).filter(Number.isFinite);
    const [low, high] = [Math.min(0, ...XyPlot.ends(finite, Math.min)), XyPlot.ends(finite, Math.max)[0] ?? 1];
    return [low, high > low ? high + 0.03 * (high - low) : low + 1];
  }

  /** Follows curves that grow, where the reader has not zoomed. */
  fit() {
    const { axis } = this;
    const whole = axis.window[0] === axis.whole[0] && axis.window[1] === axis.whole[1];
    axis.whole = XyPlot.span(this.curves);
    if (whole) axis.window = axis.whole;
  }

  // The least or the greatest of a long list; nothing of none.
  static ends(values, pick) { return values.length ? [values.reduce((a, b) => pick(a, b))] : []; }

  // Every point counts, as curves turn back.
  first() { return 0; }
  findRange() {
    const visible = (c) => Array.from(c.y).filter((v, k) => Number.isFinite(v) && this.inWindow(c.t[k]));
    const values = this.curves.filter((c) => c.on).flatMap(visible);
    if (!values.length) return [0, 1];
    const [low, high] = [XyPlot.ends(values, Math.min)[0], XyPlot.ends(values, Math.max)[0]];
    const air = (high - low) * 0.07 || Math.abs(high) * 0.1 || 1;
    return [low >= 0 && low < 0.5 * high ? 0 : low - air, high + air];
  }
  inWindow(x) { return x >= this.axis.window[0] && x <= this.axis.window[1]; }

  pathOf(curve) {
    let pen = "M";
    const parts = [];
    curve.y.forEach((v, k) => {
      if (!Number.isFinite(v) || !Number.isFinite(curve.t[k])) { pen = "M"; return; }
      parts.push(`${pen}${this.x(curve.t[k]).toFixed(1)} ${this.y(v).toFixed(1)}`);
      pen = "L";
    });
    return parts.join("");
  }

  acrossTicks() {
    const prefix = prefixFor(Math.max(...this.axis.window.map(Math.abs)), this.panel.x.unit);
    const [low, high] = this.axis.window.map((x) => x / prefix.factor);
    const { ticks, decimals } = niceTicks(low, high, this.width / 90);
    const unit = prefix.symbol + this.panel.x.unit;
    return {
      ticks: ticks.map((v) => [v * prefix.factor, minus(v.toFixed(decimals))]),
      title: unit ? `${this.panel.x.quantity} (${unit})` : this.panel.x.quantity,
    };
  }

  drawEvents() {}
  drawNow() {}

  // Where the pointer is along the axis; curves that turn back have no single value there.
  drawCursor() {
    const x = this.axis.cursor;
    if (!this.line) return;
    this.line.setAttribute("visibility", x === null ? "hidden" : "visible");
    this.when.textContent = x === null ? "" : `${this.panel.x.quantity} = ${short(x)} ${this.panel.x.unit}`;
    if (x === null) return;
    for (const end of ["x1", "x2"]) this.line.setAttribute(end, this.x(x));
  }
}
