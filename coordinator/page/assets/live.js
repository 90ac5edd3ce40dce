// The page of a run: puts its parts together, and keeps in the address what a link should carry: selection, plots, camera, time.
import { htmlElement } from "terraglue/axes.js";
import { Beside } from "terraglue/beside.js";
import { Changes, Events, Modules } from "terraglue/lists.js";
import { Help, bindKeys } from "terraglue/keys.js";
import { Properties } from "terraglue/properties.js";
import { Run } from "terraglue/run.js";
import { Scope } from "terraglue/scope.js";
import { Stage } from "terraglue/stage.js";
import { Timeline } from "terraglue/timeline.js";
import { TopBar } from "terraglue/topbar.js";
import { Tree } from "terraglue/tree.js";
import { tabs } from "terraglue/tabs.js";

const at = (id) => document.getElementById(id);
const wish = new URLSearchParams(location.hash.slice(1));

function makeStage(run) {
  try { return new Stage(at("stage"), run); } catch (error) {
    htmlElement(at("stage"), "p", "notice", `This browser shows no 3-D view (${error.message}). Everything else works.`);
    return null;
  }
}

// Saves the picture of the view.
function shot(run, stage) {
  stage?.view.canvas.toBlob((blob) => {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${run.state?.scenario ?? "run"}_${run.shown.toFixed(2)}s.png` });
    link.click();
  });
}

// Messages that the page shows for a moment, and the banner while the connection is lost.
function messages(run) {
  const banner = at("banner");
  run.on("link", (on) => {
    banner.hidden = on;
    banner.textContent = `Connection lost: what you see is t = ${run.shown.toFixed(3)} s. Connecting again …`;
  });
  const toasts = at("toasts");
  run.on("told", ({ text, bad }) => {
    const toast = htmlElement(toasts, "p", bad ? "bad" : "", text);
    while (toasts.children.length > 4) toasts.firstChild.remove();
    setTimeout(() => toast.remove(), bad ? 9000 : 4000);
  });
}

// The layout that the scenario asks for; the address takes precedence.
function layout(run) {
  const text = run.link.info?.metadata?.page;
  return text ? JSON.parse(text) : {};
}

// Once the variables are known, selection and plots are restored from the address, else from the scenario, else from a default.
function restore(run, scope) {
  const done = { yes: false };
  run.on("variables", () => {
    if (done.yes || !run.variables.size) return;
    done.yes = true;
    const { select, plots } = layout(run);
    if (wish.get("select") ?? select) run.select(wish.get("select") ?? select);
    scope.text = wish.get("plots") ?? plots ?? firstPlots(run);
  });
}

// Motor and motion of the first joint, else the first number that moves.
function firstPlots(run) {
  const ids = [...run.variables.keys()];
  const torque = ids.find((id) => id.endsWith(".torque"));
  if (torque) {
    const joint = torque.slice(0, -"torque".length);
    return ["angle", "torque"].map((part) => joint + part).filter((id) => run.variables.has(id)).join(";");
  }
  return ids.find((id) => run.variables.get(id).kind === "real" && run.variables.get(id).causality === "output") ?? "";
}

function keepAddress(run, stage, scope) {
  setInterval(() => {
    const state = { select: run.selected, plots: scope.text, camera: stage?.view.camera.text, t: run.looked?.toFixed(3) };
    const known = Object.entries(state).filter(([, value]) => value !== null && value !== undefined && value !== "");
    const text = `#${new URLSearchParams(known)}`;
    if (run.variables.size && text !== location.hash) history.replaceState(null, "", text);
  }, 700);
}

function start() {
  const run = new Run(location, new URLSearchParams(location.search).get("token"));
  const model = tabs(at("model"), ["Model", "Changed", "Modules"], "model");
  const tree = new Tree(model.Model.panel, run);
  new Changes(model.Changed.panel, run);
  new Modules(model.Modules.panel, run);
  run.on("changed", () => { model.Changed.tab.textContent = run.changed.length ? `Changed ${run.changed.length}` : "Changed"; });
  const stage = makeStage(run);
  new Properties(at("props"), run);
  const scope = new Scope(at("scope"), run);
  new Events(at("events"), run);
  const timeline = new Timeline(at("timeline"), run);
  const help = new Help();
  new TopBar(at("top"), run, { shot: () => shot(run, stage), help: () => help.toggle() });
  bindKeys({ run, stage, tree, timeline, help });
  messages(run);
  restore(run, scope);
  run.on("staged", () => {
    const { camera, ground, layers } = layout(run);
    if (wish.get("camera") ?? camera) stage.view.camera.text = wish.get("camera") ?? camera;
    // of a ground that is known only later, too
    stage.colour = ground;
    if (ground) stage.view.colour(ground);
    if (layers) stage.view.menus.show(layers);
    if (wish.has("t")) timeline.restore(Number(wish.get("t")));
    document.documentElement.dataset.ready = "yes";
    stage.mark();
  });
  const beside = new Beside(run);
  run.on("beside", () => { if (stage) { stage.view.menus.offerGhost(beside.name); beside.follow(stage.view, () => stage.time); } });
  keepAddress(run, stage, scope);
  // for scripts that drive the page
  document.addEventListener("terraglue:frames", (event) => event.detail(stage?.view.frames ?? 0));
  document.addEventListener("terraglue:busy", (event) => event.detail(Boolean(!Object.keys(run.metadata).length || stage?.busy || stage?.scaling)));
}

start();
