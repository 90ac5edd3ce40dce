// The oscilloscope: plots of variables as in the report, filled from the history and from then on by the run. Time or X-Y, one
// cursor for all, CSV and PNG.
import { htmlElement } from "terraglue/axes.js";
import { saveCsv, savePng } from "terraglue/export.js";
import { Plot, TimeAxis } from "terraglue/plot.js";
import { XyPlot } from "terraglue/xy.js";

const HEIGHT = 138;
const REDRAW_MS = 120;
const MOST_POINTS = 30_000;
const SPANS = [["2 s", 2], ["5 s", 5], ["10 s", 10], ["30 s", 30], ["all", Infinity]];

// Values of a variable over time; grows.
class Series {
  constructor() { this.t = []; this.y = []; }
  set(t, y) { this.t = Array.from(t); this.y = Array.from(y, (v) => (v === null ? NaN : Number(v))); }
  push(t, y) {
    if (this.t.length && t <= this.t.at(-1)) return;
    this.t.push(t);
    this.y.push(y);
    if (this.t.length > MOST_POINTS) { this.t.splice(0, MOST_POINTS / 10); this.y.splice(0, MOST_POINTS / 10); }
  }
}

/** The plots in `parent`. */
export class Scope {
  constructor(parent, run) {
    Object.assign(this, { run, series: new Map(), before: new Map(), others: new Map(), beside: null, plots: [], readers: new Map(), span: 10, dirty: false });
    this.axis = new TimeAxis(0, 1);
    this.axis.onPick = (t) => run.tell("seek", t);
    this.buildBar(parent);
    this.list = htmlElement(parent, "div", "scope-plots");
    this.hint = htmlElement(this.list, "p", "hint drop", "Drop a value here, double-click it in the tree, or press “plot” beside it.");
    this.bindDrop(parent);
    run.on("plot", (id) => this.add(id));
    run.on("beside", (beside) => { this.beside = beside; this.loadBeside(); });
    run.on("branch", () => this.leave());
    run.on("behind", () => { this.late ??= setTimeout(() => { this.late = null; this.reload(); }, 1000); });
    run.on("link", (on) => { this.readers.clear(); if (on) this.begin(); });
    run.on("channels", () => this.listen());
    run.on("events", () => { this.axis.events = run.events; this.dirty = true; });
    run.on("run", () => { this.dirty = true; });
    run.on("moment", (t) => { this.axis.mark(t); this.dirty = true; });
    setInterval(() => this.refresh(), REDRAW_MS);
  }

  buildBar(parent) {
    const bar = htmlElement(parent, "div", "panel-bar");
    htmlElement(bar, "h2", "", "Oscilloscope");
    const label = htmlElement(bar, "label", "", "show ");
    const select = htmlElement(label, "select");
    for (const [text, seconds] of SPANS) htmlElement(select, "option", "", text).value = seconds;
    select.value = "10";
    select.onchange = () => { this.span = Number(select.value); this.axis.was = null; this.dirty = true; };
    htmlElement(bar, "span", "spacer");
    const csv = this.button(bar, "CSV", "all curves as a table of text", () => saveCsv(this.names(), this.series, this.run));
    csv.classList.add("quietly");
  }

  button(parent, text, title, act) {
    const button = htmlElement(parent, "button", "", text);
    Object.assign(button, { type: "button", title, onclick: act });
    return button;
  }

  bindDrop(parent) {
    parent.ondragover = (event) => event.preventDefault();
    parent.ondrop = (event) => {
      event.preventDefault();
      const id = event.dataTransfer.getData("text/plain");
      const at = this.plots.find((p) => p.plot.box.contains(event.target));
      if (this.run.variables.has(id)) this.add(id, at);
    };
  }

  /** Adds a variable: to `into`, else to a plot of the same unit and quantity, else to a plot of its own. */
  add(id, into) {
    const variable = this.run.variables.get(id);
    if (!variable || variable.kind === "string") return;
    const quantity = id.split(".").at(-1);
    const fits = (p) => p.unit === (variable.unit ?? "") && !p.ids.includes(id);
    const at = into && fits(into) ? into : this.plots.find((p) => fits(p) && p.quantity === quantity && !p.across);
    if (this.plots.some((p) => p.ids.includes(id)) && !into) return;
    if (at) at.ids.push(id); else this.plots.push({ ids: [id], unit: variable.unit ?? "", quantity, across: null });
    if (!this.series.has(id)) { this.series.set(id, new Series()); this.load([id]); }
    this.rebuild();
    this.loadBeside();
  }

  remove(entry, id) {
    entry.ids = entry.ids.filter((other) => other !== id);
    if (!entry.ids.length || entry.across === id) this.plots = this.plots.filter((p) => p !== entry);
    for (const known of [...this.series.keys()]) if (!this.names().includes(known)) this.series.delete(known);
    this.rebuild();
  }

  names() { return [...new Set(this.plots.flatMap((p) => [...p.ids, ...(p.across ? [p.across] : [])]))]; }

  /** As text for an address, and back: plots by `;`, variables by `,`, the quantity along the axis after `@`. */
  get text() { return this.plots.map((p) => p.ids.join(",") + (p.across ? `@${p.across}` : "")).join(";"); }
  set text(text) {
    for (const plot of text.split(";").filter(Boolean)) {
      const [ids, across] = plot.split("@");
      const known = ids.split(",").filter((id) => this.run.variables.has(id));
      if (!known.length) continue;
      const [first] = known;
      this.plots.push({ ids: known, unit: this.run.variables.get(first).unit ?? "", quantity: first.split(".").at(-1), across: across ?? null });
    }
    for (const id of this.names()) if (!this.series.has(id)) this.series.set(id, new Series());
    this.reload();
    this.rebuild();
    this.loadBeside();
  }

  // The curves of the other run, of variables that it has, too.
  async loadBeside() {
    const ids = this.names().filter((id) => !this.others.has(id));
    if (!this.beside || !ids.length) return;
    try {
      const { names, t, values } = await this.beside.history(ids);
      names.forEach((id, k) => {
        const series = new Series();
        series.set(t, values[k]);
        this.others.set(id, series);
      });
      this.rebuild();
    } catch (error) { this.run.say(`the run beside this one: ${error.message}`, true); }
  }

  // Curves beside those of the run: the way that it took before it went back, and those of the other run.
  dashed(ids, curve, entry) {
    const one = (id, k, { t, y }, of) => ({ ...curve(id, k), t, y, id: null, name: `${this.shortName(id, entry)} ${of}`, dashed: true });
    const known = ({ y }) => y.some(Number.isFinite);
    return ids.flatMap((id, k) => {
      const [left, other] = [this.before.get(id), this.others.get(id)];
      return [...(left ? [one(id, k, left, "before")] : []), ...(other && known(other) ? [one(id, k + 4, other, `in ${this.beside.name}`)] : [])];
    });
  }

  // The run went back: what is plotted stays as it was, dashed, beside the way that it takes now.
  leave() {
    if (!this.run.replaying) this.before = new Map([...this.series].map(([id, { t, y }]) => [id, { t: [...t], y: [...y] }]));
    this.begin();
    this.rebuild();
  }

  // From the recording alone.
  begin() {
    for (const series of this.series.values()) series.set([], []);
    this.reload();
  }

  reload() { if (this.series.size) this.load([...this.series.keys()]); }

  // The past from the recording; what came in meanwhile stays.
  async load(ids) {
    try {
      const { names, t, values } = await this.run.history(ids);
      names.forEach((id, k) => {
        const series = this.series.get(id);
        if (!series) return;
        const [last, own] = [t.at(-1) ?? -Infinity, series];
        const later = own.t.map((x, n) => [x, own.y[n]]).filter(([x]) => x > last);
        series.set(t, values[k]);
        for (const [x, y] of later) series.push(x, y);
      });
    } catch (error) { this.run.say(`history: ${error.message}`, true); }
    this.listen();
    this.dirty = true;
  }

  // Subscribes to the subsystems whose variables are plotted.
  listen() {
    const subsystems = new Set([...this.series.keys()].map((id) => id.split(".")[0]));
    for (const subsystem of subsystems) {
      for (const topic of [`/${subsystem}`, `/${subsystem}/parameters`]) {
        if (this.readers.has(topic)) continue;
        const read = this.run.columns(topic);
        if (!read) continue;
        this.readers.set(topic, read);
        this.run.link.subscribe(topic, (message, t) => this.take(read(message, this.series), t));
      }
    }
  }

  take(pairs, t) {
    for (const [id, value] of pairs) this.series.get(id)?.push(t, value);
    this.dirty = true;
  }

  rebuild() {
    this.axis.plots = [];
    this.list.replaceChildren(...(this.plots.length ? [] : [this.hint]));
    this.plots.forEach((entry, k) => { entry.plot = this.build(entry, k === this.plots.length - 1); });
    this.dirty = true;
    this.run.tell("layout");
  }

  build(entry, last) {
    const curve = (id, k) => {
      const series = this.series.get(id);
      const along = entry.across ? this.matched(entry.across, id) : series.t;
      return { name: this.shortName(id, entry), id, colour: k, t: along, y: series.y, steps: this.run.variables.get(id)?.kind !== "real" };
    };
    const ids = entry.ids.filter((id) => id !== entry.across);
    const left = entry.across ? [] : this.dashed(ids, curve, entry);
    const panel = { quantity: entry.quantity.replace(/_/g, " "), unit: entry.unit, log: null, height: HEIGHT, curves: [...ids.map(curve), ...left] };
    const across = this.run.variables.get(entry.across);
    const plot = across
      ? new XyPlot(this.list, { ...panel, x: { quantity: entry.across, unit: across.unit ?? "" } }, true)
      : new Plot(this.list, panel, this.axis, last);
    plot.box.classList.add("scope-plot");
    this.tools(plot, entry);
    return plot;
  }

  // Without the quantity, where all share it: it is written next to the axis.
  shortName(id, entry) {
    const same = entry.ids.every((other) => other.endsWith(`.${entry.quantity}`));
    return same ? id.slice(0, -entry.quantity.length - 1) : id;
  }

  // Values of one variable at the times of another.
  matched(id, like) {
    const [from, to] = [this.series.get(id), this.series.get(like)];
    let k = 0;
    return to.t.map((t) => { while (k + 1 < from.t.length && from.t[k + 1] <= t + 1e-9) k++; return from.y[k] ?? NaN; });
  }

  tools(plot, entry) {
    const tools = htmlElement(plot.box.querySelector(".panel-head"), "span", "tools");
    if (entry.ids.length > 1 || this.names().length > 1) this.button(tools, entry.across ? "time" : "x–y", "over time, or over another curve", () => this.flip(entry));
    this.button(tools, "PNG", "picture of this plot", () => savePng(plot, entry.ids.join(" ")));
    const close = this.button(tools, "×", "close this plot", () => { for (const id of [...entry.ids]) this.remove(entry, id); });
    close.setAttribute("aria-label", "close this plot");
    for (const key of plot.box.querySelectorAll(".key")) key.title = "click: show or hide; right click: take away";
    plot.box.querySelectorAll(".key").forEach((key, k) => {
      key.oncontextmenu = (event) => { event.preventDefault(); this.remove(entry, plot.curves[k].id); };
    });
  }

  // Over the first curve of this plot, or the first of another one; and back.
  flip(entry) {
    if (entry.across) entry.across = null;
    else entry.across = entry.ids.length > 1 ? entry.ids[0] : this.names().find((id) => !entry.ids.includes(id)) ?? null;
    this.rebuild();
  }

  refresh() {
    if (!this.dirty || !this.plots.length || document.hidden) return;
    this.dirty = false;
    const { state } = this.run;
    const end = Math.max(state?.recorded_to_s ?? 0, ...[...this.series.values()].map((s) => s.t.at(-1) ?? 0));
    const begin = state?.recorded_from_s ?? 0;
    const same = (a, b) => a[0] === b[0] && a[1] === b[1];
    const { axis } = this;
    // what was zoomed stays; a double click goes back to all, and so to following
    if (!axis.was || same(axis.window, axis.was) || same(axis.window, axis.whole)) this.follow(begin, end);
    axis.whole = [begin, Math.max(end, begin + 0.1)];
    axis.now = this.run.looked ?? (this.run.replaying ? this.run.t : end);
    for (const { plot, across, ids } of this.plots) {
      plot.curves.forEach((curve) => {
        const series = this.series.get(curve.id);
        if (series) Object.assign(curve, { y: series.y, t: across ? this.matched(across, curve.id) : series.t });
      });
      if (across && ids.length) plot.fit?.();
      plot.draw();
    }
  }

  // The window that ends now, or that holds the moment which is looked at; a window that the reader chose stays.
  follow(begin, end) {
    const looked = this.run.looked;
    const right = looked === null ? end : Math.min(Math.max(looked + this.span / 2, begin + this.span), end);
    const window = this.span === Infinity ? [begin, end] : [Math.max(right - this.span, begin), right];
    this.axis.window = window[1] > window[0] ? window : [begin, begin + 0.1];
    this.axis.was = this.axis.window;
  }
}

