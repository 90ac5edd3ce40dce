// The bar on top: play, step, reset, pace, time, how fast the run goes, what it is, and whether the page is connected.
import { htmlElement } from "terraglue/axes.js";

const PACES = [["free", null], ["× 0.1", 0.1], ["× 0.25", 0.25], ["× 0.5", 0.5], ["× 1", 1], ["× 2", 2], ["× 5", 5], ["× 10", 10]];
const STATES = { playing: "playing", paused: "paused", ended: "ended", failed: "failed" };

/** The bar in `parent`; `shot()` saves a picture. */
export class TopBar {
  constructor(parent, run, { shot, help }) {
    this.run = run;
    htmlElement(parent, "span", "brand", "Terraglue");
    this.play = this.button(parent, "▶", "play or pause (space)", () => run.toggle());
    this.play.classList.add("play");
    this.step = this.button(parent, "step", "one step (right arrow)", () => run.act("run.step", { steps: 1 }));
    this.reset = this.button(parent, "reset", "from the start again", () => run.act("run.reset"));
    const pace = htmlElement(htmlElement(parent, "label", "pace", "pace "), "select");
    for (const [text, factor] of PACES) htmlElement(pace, "option", "", text).value = String(factor);
    pace.onchange = () => run.act("run.pace", { factor: pace.value === "null" ? null : Number(pace.value) });
    this.pace = pace;
    this.time = htmlElement(parent, "output", "time");
    this.time.setAttribute("aria-label", "simulated time");
    this.rtf = htmlElement(parent, "span", "quiet rtf");
    this.rtf.title = "real-time factor: simulated time over wall time";
    htmlElement(parent, "span", "spacer");
    this.name = htmlElement(parent, "h1", "scenario", "run");
    this.state = htmlElement(parent, "span", "pill");
    this.state.setAttribute("role", "status");
    this.button(parent, "shot", "picture of the view", shot).classList.add("quietly");
    this.button(parent, "?", "keys (?)", help).classList.add("quietly");
    const theme = this.button(parent, "◐", "light or dark", () => {});
    theme.id = "theme";
    run.on("run", () => this.show());
    run.on("moment", () => this.show());
    run.on("link", () => this.show());
    this.show();
  }

  button(parent, text, title, act) {
    const button = htmlElement(parent, "button", "", text);
    Object.assign(button, { type: "button", title, onclick: act });
    button.setAttribute("aria-label", title);
    return button;
  }

  show() {
    const { run } = this;
    const { state } = run;
    const past = run.looked !== null;
    this.time.textContent = `t = ${run.shown.toFixed(3)} s`;
    this.time.classList.toggle("past", past);
    if (!state) { this.pill("connecting", "fair"); return; }
    this.play.textContent = run.playing ? "❚❚" : "▶";
    for (const button of [this.play, this.step, this.reset, this.pace]) button.disabled = !run.connected || state.may_write === false;
    this.reset.hidden = run.replaying;
    this.pace.value = String(state.pace ?? null);
    this.rtf.textContent = Number.isFinite(state.rtf) ? `RTF ${state.rtf.toFixed(2)}` : "";
    this.name.textContent = state.scenario ?? "";
    document.title = `${state.scenario ?? "run"} · Terraglue`;
    this.tellState(state, past);
  }

  tellState(state, past) {
    const mode = state.mode === "replay" ? "replay" : "live";
    if (!this.run.connected) this.pill("not connected", "bad");
    else if (past) this.pill("past", "fair");
    else if (state.state === "failed") this.pill("failed", "bad");
    else this.pill(`${mode} · ${STATES[state.state] ?? state.state}`, state.state === "playing" ? "good" : "");
    this.state.title = state.error ?? "";
  }

  pill(text, kind) {
    this.state.textContent = text;
    this.state.className = `pill ${kind}`;
  }
}
