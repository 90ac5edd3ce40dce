// The time line: what is recorded, where the run is, where the reader looks, and what happened. Dragging it back shows the past;
// "run from here" goes on from there.
import { htmlElement, niceTicks, short } from "terraglue/axes.js";

/** The kind of an event by its text, for its colour. */
export function kindOf(event) {
  const what = event.what.toLowerCase();
  if (event.level >= 4 || /fail|error|fault|broken|blocked|diverg/.test(what)) return "bad";
  if (event.level === 3 || /warn/.test(what)) return "fair";
  return /contact|touch/.test(what) ? "good" : "set";
}

/** The line in `parent`. */
export class Timeline {
  constructor(parent, run) {
    this.run = run;
    this.track = htmlElement(parent, "div", "line-track");
    this.track.tabIndex = 0;
    for (const [key, value] of [["role", "slider"], ["aria-label", "time of the run, s"]]) this.track.setAttribute(key, value);
    this.done = htmlElement(this.track, "div", "line-done");
    this.ticks = htmlElement(this.track, "div", "line-ticks");
    this.marks = htmlElement(this.track, "div", "line-marks");
    this.cursor = htmlElement(this.track, "div", "line-cursor");
    const side = htmlElement(parent, "div", "line-side");
    this.follow = htmlElement(side, "button", "follow", "follow live");
    this.from = htmlElement(side, "button", "from-here", "run from here");
    for (const button of [this.follow, this.from]) button.type = "button";
    this.follow.onclick = () => run.look(null);
    this.from.onclick = () => this.branch();
    this.bind();
    for (const name of ["run", "moment"]) run.on(name, () => this.draw());
    run.on("events", () => { this.drawMarks(); this.draw(); });
    run.on("seek", (t) => this.seek(t));
    new ResizeObserver(() => { this.drawn = ""; this.draw(); }).observe(this.track);
  }

  /** End of what can be looked at, s. */
  get reached() { const { state } = this.run; return Math.max(state?.recorded_to_s ?? 0, state?.t_s ?? 0); }

  get range() {
    const { state } = this.run;
    return [0, Math.max(Number.isFinite(state?.duration_s) ? state.duration_s : 0, this.reached, 1e-3)];
  }

  share(t) { const [low, high] = this.range; return Math.min(Math.max((t - low) / (high - low), 0), 1); }

  bind() {
    const { track } = this;
    const time = (event) => {
      const box = track.getBoundingClientRect();
      const [low, high] = this.range;
      return low + ((event.clientX - box.left) / box.width) * (high - low);
    };
    let held = false;
    track.onpointerdown = (event) => { held = true; track.setPointerCapture(event.pointerId); this.seek(time(event)); };
    track.onpointermove = (event) => { if (held) this.seek(time(event)); };
    track.onpointerup = track.onpointercancel = () => { held = false; };
    track.onkeydown = (event) => {
      const step = { ArrowLeft: -0.1, ArrowRight: 0.1, PageDown: -1, PageUp: 1 }[event.key];
      if (step) this.seek(this.run.shown + step);
      else if (event.key === "Home") this.seek(0);
      else if (event.key === "End") this.run.look(null);
      else return;
      event.preventDefault();
      event.stopPropagation();
    };
  }

  /** Goes to a time: a replay there, a live run shows its past. */
  seek(t) {
    const { state } = this.run;
    if (!state) return;
    const [from, to] = [state.recorded_from_s ?? 0, this.reached];
    const at = Math.min(Math.max(t, from), to);
    if (this.run.replaying) this.run.act("run.seek", { t_s: at });
    else this.run.look(at >= state.t_s - 1e-9 && t >= to ? null : at);
  }

  /** Looks at a time from an address, where the run has reached it. */
  restore(t) {
    const { run } = this;
    if (!run.state) run.addEventListener("run", () => this.restore(t), { once: true });
    else if (t < this.reached) run.look(t);
  }

  async branch() {
    const { looked, state } = this.run;
    if (looked === null) return;
    const done = await this.run.act("run.rewind", { t_s: looked });
    if (done) { this.run.say(`The run goes on from t = ${looked.toFixed(3)} s (branch ${(state.branch ?? 0) + 1}).`); this.run.look(null); }
  }

  draw() {
    const { state, looked } = this.run;
    if (!state) return;
    const percent = (t) => `${100 * this.share(t)}%`;
    const [from, to] = [state.recorded_from_s ?? 0, this.reached];
    Object.assign(this.done.style, { left: percent(from), width: `${100 * (this.share(to) - this.share(from))}%` });
    this.cursor.style.left = percent(this.run.shown);
    this.cursor.classList.toggle("past", looked !== null);
    const live = !this.run.replaying;
    this.follow.hidden = !live;
    this.follow.setAttribute("aria-pressed", String(looked === null));
    const cannot = state.cannot_rewind ?? [];
    this.from.hidden = !live;
    this.from.disabled = looked === null || cannot.length > 0 || state.may_write === false;
    this.from.title = cannot.length ? `${cannot.join(", ")} cannot go back in time; the past can be looked at only` : "goes on from the time that is shown";
    for (const [key, value] of [["valuemin", 0], ["valuemax", this.range[1]], ["valuenow", this.run.shown], ["valuetext", `${this.run.shown.toFixed(3)} s`]]) {
      this.track.setAttribute(`aria-${key}`, value);
    }
    this.drawTicks();
  }

  drawTicks() {
    const key = `${this.range.join()} ${this.track.clientWidth} ${(this.run.state.snapshots ?? []).length}`;
    if (key === this.drawn) return;
    this.drawn = key;
    this.ticks.replaceChildren();
    const { ticks, decimals } = niceTicks(...this.range, this.track.clientWidth / 80);
    for (const t of ticks) htmlElement(this.ticks, "i", "", t.toFixed(decimals)).style.left = `${100 * this.share(t)}%`;
    for (const t of this.run.state.snapshots ?? []) {
      const mark = htmlElement(this.ticks, "b");
      mark.title = `snapshot at ${short(t)} s`;
      mark.style.left = `${100 * this.share(t)}%`;
    }
    this.drawMarks();
  }

  drawMarks() {
    this.marks.replaceChildren();
    for (const event of this.run.events.slice(-400)) {
      const mark = htmlElement(this.marks, "i", kindOf(event));
      mark.style.left = `${100 * this.share(event.t)}%`;
      mark.title = `${event.t.toFixed(3)} s: ${event.what}`;
    }
  }
}
