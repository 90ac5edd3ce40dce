// The tree of the model: variables by the parts of their names, opened piece by piece, searched by text; all by keyboard, too.
import { htmlElement } from "terraglue/axes.js";

const MOST_FOUND = 300;

// Nested maps by the parts between dots; a variable is a leaf.
function grown(ids) {
  const root = new Map();
  for (const id of ids) {
    let level = root;
    const parts = id.split(".");
    parts.slice(0, -1).forEach((part) => {
      if (!(level.get(part) instanceof Map)) level.set(part, new Map());
      level = level.get(part);
    });
    if (!level.has(parts.at(-1))) level.set(parts.at(-1), null);
  }
  return root;
}

/** The tree of a run in `parent`. */
export class Tree {
  constructor(parent, run) {
    this.run = run;
    this.search = htmlElement(parent, "input", "search");
    Object.assign(this.search, { type: "search", placeholder: "search ( / )" });
    this.search.setAttribute("aria-label", "search variables");
    this.list = htmlElement(parent, "ul", "tree");
    this.list.setAttribute("role", "tree");
    this.list.setAttribute("aria-label", "model");
    this.open = new Set();
    this.search.oninput = () => this.build();
    this.search.onkeydown = (event) => { if (event.key === "ArrowDown") this.items()[0]?.focus(); };
    this.list.onkeydown = (event) => this.key(event);
    run.on("variables", () => this.build());
    run.on("select", (id) => this.reveal(id));
    run.on("changed", () => this.dot());
  }

  build() {
    const words = this.search.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    this.list.replaceChildren();
    const ids = [...this.run.variables.keys()];
    if (words.length) {
      const found = ids.filter((id) => words.every((w) => id.toLowerCase().includes(w)));
      for (const id of found.slice(0, MOST_FOUND)) this.item(this.list, id, id, null);
      if (!found.length) htmlElement(this.list, "li", "empty", "nothing has this name");
    } else this.level(this.list, grown(ids), "");
    this.reveal(this.run.selected);
    this.dot();
  }

  level(list, tree, prefix) {
    for (const [name, below] of tree) this.item(list, name, prefix + name, below);
  }

  item(list, text, id, below) {
    const item = htmlElement(list, "li", below ? "branch" : "leaf");
    item.setAttribute("role", "treeitem");
    item.dataset.id = id;
    item.tabIndex = -1;
    const row = htmlElement(item, "span", "row", text);
    const unit = this.run.variables.get(id)?.unit;
    if (unit) htmlElement(row, "small", "", unit);
    row.onclick = () => { this.run.select(id); item.focus(); if (below && !this.open.has(id)) this.toggle(item, id, below); };
    if (below) this.branch(item, row, id, below);
    else this.draggable(row, id);
    return item;
  }

  branch(item, row, id, below) {
    item.below = below;
    item.setAttribute("aria-expanded", "false");
    const mark = htmlElement(null, "span", "twist");
    mark.setAttribute("aria-hidden", "true");
    row.prepend(mark);
    mark.onclick = (event) => { event.stopPropagation(); this.toggle(item, id, below); };
    if (this.open.has(id)) this.toggle(item, id, below, true);
  }

  draggable(row, id) {
    row.draggable = true;
    row.ondragstart = (event) => event.dataTransfer.setData("text/plain", id);
    row.ondblclick = () => this.run.tell("plot", id);
  }

  toggle(item, id, below, on = item.getAttribute("aria-expanded") !== "true") {
    item.setAttribute("aria-expanded", String(on));
    if (on) this.open.add(id); else this.open.delete(id);
    item.querySelector(":scope > ul")?.remove();
    if (!on) return;
    const list = htmlElement(item, "ul");
    list.setAttribute("role", "group");
    this.level(list, below, `${id}.`);
    this.mark();
    this.dot();
  }

  items() { return [...this.list.querySelectorAll('[role="treeitem"]')]; }

  key(event) {
    const [items, at] = [this.items(), document.activeElement];
    const item = at.closest?.('[role="treeitem"]');
    const k = items.indexOf(item);
    const expanded = item?.getAttribute("aria-expanded");
    const does = {
      ArrowDown: () => items[k + 1]?.focus(), ArrowUp: () => (items[k - 1] ?? this.search).focus(),
      ArrowRight: () => (expanded === "false" ? this.toggle(item, item.dataset.id, item.below) : items[k + 1]?.focus()),
      ArrowLeft: () => (expanded === "true" ? this.toggle(item, item.dataset.id, item.below) : item.parentElement.closest('[role="treeitem"]')?.focus()),
      Enter: () => this.run.select(item.dataset.id), Home: () => items[0]?.focus(), End: () => items.at(-1)?.focus(),
      p: () => { if (!item.below) this.run.tell("plot", item.dataset.id); },
    }[event.key];
    if (!does || !item) return;
    event.preventDefault();
    event.stopPropagation();
    does();
  }

  // Opens all above a selected one and shows it.
  reveal(id) {
    if (!id || this.search.value) { this.mark(); return; }
    const parts = id.split(".");
    for (let k = 1; k < parts.length; k++) {
      const above = this.find(parts.slice(0, k).join("."));
      if (above?.below && above.getAttribute("aria-expanded") !== "true") this.toggle(above, above.dataset.id, above.below, true);
    }
    this.mark();
    this.find(id)?.querySelector(".row").scrollIntoView({ block: "nearest" });
  }

  find(id) { return this.list.querySelector(`[data-id="${CSS.escape(id)}"]`); }

  mark() {
    for (const item of this.items()) item.setAttribute("aria-selected", String(item.dataset.id === this.run.selected));
    const first = this.items();
    if (first.length && !first.some((i) => i.tabIndex === 0)) first[0].tabIndex = 0;
  }

  // Changed items have a dot, and so have all items above them.
  dot() {
    const changed = this.run.changed.map((c) => c.id);
    for (const item of this.items()) {
      const id = item.dataset.id;
      item.classList.toggle("changed", changed.some((c) => c === id || c.startsWith(`${id}.`)));
    }
  }
}
