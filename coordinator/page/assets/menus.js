// Menus over the 3-D view: camera, colours of the ground with their scale, layers.
import { htmlElement, minus, niceTicks } from "terraglue/axes.js";
import { Camera } from "terraglue/camera.js";
import { gradient } from "terraglue/palette.js";

/** Colours of the ground. */
export const COLOURS = ["plain", "height", "sinkage", "slope"];
const UNITS = ["", "m", "mm", "°"];
const FACTORS = [1, 1, 1e3, 180 / Math.PI];

/** Layers that can be shown beside bodies and ground: name, text, scale offered, on at first. */
export const LAYERS = [
  ["forces", "contact forces", true, true], ["torques", "motor torques", true, false], ["centre", "centre of mass of the body", false, false],
  ["support", "support polygon", false, false],
  ["overlays", "overlays of modules", false, true], ["hits", "rays and clouds of sensors", false, true],
  ["ghost", "the other run", false, true], ["grid", "metre grid", false, true],
];

/** The menus of a view; `offered` are names of layers. */
export class Menus {
  constructor(view, offered) {
    this.view = view;
    const bar = htmlElement(view.box, "div", "view-bar");
    this.cameras = this.select(bar, "camera", Camera.names, (name) => { view.camera.choose(name); view.aim(); });
    this.colours = this.select(bar, "ground", COLOURS, (name) => view.colour(name));
    this.colours.value = "sinkage";
    const details = htmlElement(bar, "details", "layers");
    htmlElement(details, "summary", "", "layers");
    const list = htmlElement(details, "div", "layer-list");
    for (const layer of LAYERS.filter(([name]) => offered.includes(name))) this.buildLayer(list, layer);
    this.legend = htmlElement(view.box, "div", "view-legend");
  }

  select(parent, label, names, change) {
    const select = htmlElement(htmlElement(parent, "label", "", `${label} `), "select");
    for (const name of names) htmlElement(select, "option", "", name).value = name;
    select.onchange = () => { change(select.value); this.view.invalidate(); };
    return select;
  }

  buildLayer(list, [name, text, scaled]) {
    const { view } = this;
    const row = htmlElement(list, "div", "layer");
    row.hidden = name === "ghost";
    const label = htmlElement(row, "label");
    const box = htmlElement(label, "input");
    Object.assign(box, { type: "checkbox", checked: view.layers[name].on });
    box.dataset.layer = name;
    label.append(` ${text}`);
    box.onchange = () => { view.layers[name].on = box.checked; view.invalidate(); };
    if (!scaled) return;
    const scale = htmlElement(row, "input");
    Object.assign(scale, { type: "range", min: -1, max: 1, step: 0.05, value: 0, title: `scale of ${text}` });
    scale.setAttribute("aria-label", `scale of ${text}`);
    scale.oninput = () => { view.layers[name].scale = 10 ** Number(scale.value); view.invalidate(); };
  }

  /** Turns these layers on and all others off. */
  show(names) {
    for (const box of this.view.box.querySelectorAll("[data-layer]")) {
      box.checked = names.includes(box.dataset.layer);
      this.view.layers[box.dataset.layer].on = box.checked;
    }
    this.view.invalidate();
  }

  /** Offers the layer of another run. */
  offerGhost(name) {
    const row = this.view.box.querySelector("[data-layer=ghost]")?.closest(".layer");
    if (!row) return;
    row.hidden = false;
    row.querySelector("label").lastChild.textContent = ` ghost of ${name}`;
  }

  drawLegend(layer) {
    this.legend.replaceChildren();
    this.legend.hidden = !layer;
    if (!layer) return;
    // heave is a small part of the scale
    const [from, to] = layer === 2 ? [0.35, 1] : [0, 1];
    const at = (share) => (this.view.relief.range[0] + share * (this.view.relief.range[1] - this.view.relief.range[0])) * FACTORS[layer];
    htmlElement(this.legend, "span", "", `${COLOURS[layer]} (${UNITS[layer]})`);
    const bar = htmlElement(this.legend, "span", "bar");
    bar.style.background = gradient(layer, from, to);
    const ticks = htmlElement(this.legend, "span", "ticks");
    const [low, high] = [at(from), at(to)];
    const nice = niceTicks(low, high, 4);
    for (const v of nice.ticks) {
      const tick = htmlElement(ticks, "i", "", minus(v.toFixed(nice.decimals)));
      tick.style.left = `${(100 * (v - low)) / (high - low)}%`;
    }
  }
}
