// The properties of what is selected: value, unit, range, help, and whether a write takes effect; edits, refusals, undo.
import { htmlElement, short } from "terraglue/axes.js";

const EFFECTS = { live: "takes effect at the next step", "needs reset": "takes effect when the run starts again", "read only": "cannot be written" };

// Text of an edit as a value of the variable's kind; undefined where it is none.
function parsed(variable, text) {
  if (variable.kind === "string" || variable.kind === "enum") return text;
  const value = Number(text.trim().replace("−", "-").replace(",", "."));
  if (text.trim() === "" || !Number.isFinite(value)) return undefined;
  return value;
}

// A value as its field shows it; an enumeration may come as its number.
function textOf({ kind, choices }, value) {
  if (value === undefined || value === null) return "";
  if (typeof value === "number" && kind === "enum") return choices?.[value] ?? String(value);
  if (typeof value === "number" && kind === "real") return Number(value.toPrecision(7)).toString();
  if (!Array.isArray(value)) return String(value);
  return value.slice(0, 6).map((x) => short(x)).join(", ") + (value.length > 6 ? ` … (${value.length})` : "");
}

function rangeOf({ min, max }) {
  const [low, high] = [min, max].map((x) => (Number.isFinite(x) ? short(x) : null));
  if (low && high) return `${low} … ${high}`;
  return low ? `≥ ${low}` : high ? `≤ ${high}` : "";
}

/** The panel in `parent`. */
export class Properties {
  constructor(parent, run) {
    this.run = run;
    this.head = htmlElement(parent, "div", "props-head");
    this.list = htmlElement(parent, "div", "props");
    this.rows = new Map();
    this.build();
    run.on("select", () => this.build());
    run.on("variables", () => this.build());
    run.on("values", (names) => { for (const name of names) this.rows.get(name)?.show(); });
    run.on("changed", () => { for (const row of this.rows.values()) row.dot(); });
  }

  // The variables that belong to a selection: its own, else those beside it.
  ids(selected) {
    const { variables } = this.run;
    const group = variables.has(selected) ? selected.slice(0, selected.lastIndexOf(".")) : selected;
    const own = [...variables.keys()].filter((id) => id.startsWith(`${group}.`) && !id.slice(group.length + 1).includes("."));
    return { group, own };
  }

  build() {
    // a value that is being typed stays, as where the connection comes back meanwhile
    const typed = [...this.rows.values()].find((row) => row.editing);
    const focused = typed && document.activeElement === typed.field;
    if (typed) typed.editing = false;
    this.head.replaceChildren();
    this.list.replaceChildren();
    this.rows.clear();
    const { selected } = this.run;
    if (!selected) {
      htmlElement(this.list, "p", "hint", "Select a part: in the tree, or with a click on it in the view.");
      this.run.watch("selected", []);
      return;
    }
    const { group, own } = this.ids(selected);
    htmlElement(this.head, "h2", "", group);
    const below = (id) => id.startsWith(`${group}.`) && !id.slice(group.length + 1).includes(".");
    for (const action of this.run.actions.filter((a) => below(a.id))) this.action(action, group);
    this.weaken(`${group}.max_torque`);
    if (!own.length) htmlElement(this.list, "p", "hint", "It has parts, and no variables of its own.");
    // variables that can be changed come first
    const order = ["live", "needs reset", "read only"];
    own.sort((a, b) => order.indexOf(this.run.variables.get(a).effect) - order.indexOf(this.run.variables.get(b).effect));
    for (const id of own) this.rows.set(id, new Row(this.list, this.run, this.run.variables.get(id), group));
    this.run.watch("selected", own);
    this.rows.get(selected)?.box.scrollIntoView({ block: "nearest" });
    const again = typed && this.rows.get(typed.variable.id);
    if (again) {
      again.field.value = typed.field.value;
      again.editing = true;
      if (focused) again.field.focus();
    }
  }

  // A motor without torque, or with half of what it has: faults that take one click.
  weaken(id) {
    if (this.run.variables.get(id)?.effect !== "live" || this.run.state?.may_write === false) return;
    for (const [text, factor] of [["no torque", 0], ["half torque", 0.5]]) {
      const button = htmlElement(this.head, "button", "act", text);
      button.type = "button";
      button.title = `sets ${id} to ${factor} of what it is`;
      button.onclick = () => this.rows.get(id)?.write(factor * Number(this.run.values.get(id)));
    }
  }

  action(action, group) {
    const button = htmlElement(this.head, "button", "act", action.id.slice(group.length + 1));
    button.type = "button";
    button.title = action.help ?? "";
    button.onclick = async () => { if (await this.run.act(action.id)) this.run.say(`${action.id} done`); };
  }
}

// One variable.
class Row {
  constructor(parent, run, variable, group) {
    Object.assign(this, { run, variable });
    this.box = htmlElement(parent, "div", "prop");
    this.box.dataset.id = variable.id;
    this.box.classList.toggle("chosen", variable.id === run.selected);
    const name = htmlElement(this.box, "label", "prop-name", variable.id.slice(group.length + 1));
    name.title = variable.help ?? "";
    const value = htmlElement(this.box, "span", "prop-value");
    this.field = this.control(value);
    this.field.id = `prop-${variable.id}`;
    name.htmlFor = this.field.id;
    htmlElement(value, "span", "unit", variable.unit ?? "");
    const about = [variable.help, rangeOf(variable)].filter(Boolean).join("; ");
    this.note = htmlElement(this.box, "p", "prop-note", about);
    const effect = htmlElement(this.box, "span", `effect ${variable.effect.replace(" ", "-")}`, variable.effect);
    effect.title = variable.why ?? EFFECTS[variable.effect] ?? "";
    if (variable.kind !== "string") this.plotButton();
    this.trouble = htmlElement(this.box, "p", "refusal");
    this.trouble.setAttribute("role", "alert");
    this.show();
    this.dot();
  }

  plotButton() {
    const plot = htmlElement(this.box, "button", "plot-it", "plot");
    plot.type = "button";
    plot.setAttribute("aria-label", `plot ${this.variable.id}`);
    plot.onclick = () => this.run.tell("plot", this.variable.id);
    plot.draggable = true;
    plot.ondragstart = (event) => event.dataTransfer.setData("text/plain", this.variable.id);
  }

  get writable() { return this.variable.effect !== "read only" && this.run.state?.may_write !== false; }

  control(parent) {
    const { variable } = this;
    if (variable.array) return htmlElement(parent, "output");
    const choices = variable.kind === "bool" ? [false, true] : variable.choices;
    if (choices?.length) {
      const select = htmlElement(parent, "select");
      choices.forEach((c) => { htmlElement(select, "option", "", String(c)).value = String(c); });
      select.onchange = () => this.write(variable.kind === "bool" ? select.value === "true" : select.value);
      select.disabled = !this.writable;
      return select;
    }
    const input = htmlElement(parent, "input");
    Object.assign(input, { type: "text", inputMode: variable.kind === "string" ? "text" : "decimal", readOnly: !this.writable, spellcheck: false });
    input.onkeydown = (event) => {
      if (event.key === "Enter") { this.edit(input.value); input.select(); }
      if (event.key === "Escape") { this.editing = false; this.show(true); input.blur(); }
      event.stopPropagation();
    };
    input.oninput = () => { this.editing = true; };
    input.onblur = () => { if (this.editing) this.edit(input.value); else this.show(true); };
    return input;
  }

  edit(text) {
    this.editing = false;
    const value = parsed(this.variable, text);
    if (value === undefined) this.refuse(`“${text}” is no number`); else this.write(value);
  }

  async write(value) {
    const { id } = this.variable;
    this.trouble.textContent = "";
    if (this.run.values.get(id) === value) { this.show(true); return; }
    try {
      await this.run.write(id, value);
      this.box.classList.add("taken");
      setTimeout(() => this.box.classList.remove("taken"), 900);
    } catch (error) { this.refuse(error.message); }
    this.show(true);
  }

  refuse(reason) {
    this.trouble.textContent = `Refused: ${reason}`;
    this.show(true);
  }

  /** Shows the value as it is, not in a field that has the focus: what is selected or typed there would be lost. */
  show(force = false) {
    if (!force && (this.editing || document.activeElement === this.field)) return;
    const value = this.run.values.get(this.variable.id);
    const text = textOf(this.variable, value);
    if ("value" in this.field) this.field.value = text; else this.field.textContent = text;
    this.field.title = value === undefined || value === null ? "" : String(value);
  }

  dot() {
    const change = this.run.changed.find((c) => c.id === this.variable.id);
    this.box.classList.toggle("changed", Boolean(change));
    this.undo?.remove();
    if (!change) return;
    this.undo = htmlElement(null, "button", "undo", change.pending ? `${textOf(this.variable, change.value)} at the next reset; take back` : `undo (${textOf(this.variable, change.was)})`);
    this.undo.type = "button";
    this.undo.onclick = () => this.run.act("run.undo", { id: change.id });
    this.trouble.before(this.undo);
  }
}
