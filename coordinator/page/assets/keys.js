// Keys of the page, and the overlay that lists them.
import { htmlElement } from "terraglue/axes.js";

const KEYS = [
  ["Space", "play or pause"], ["→", "one step; in the past: 0.1 s on"], ["←", "0.1 s back into the past"], ["End", "follow live"],
  ["[  ]", "camera before, next camera"], ["F", "look at what is selected"], ["/", "search in the model"], ["P", "plot the selected variable"],
  ["Ctrl Z", "undo the last change"], ["Tab", "next control; arrows move in tree and time line"], ["?", "this list; Esc closes it"],
  ["drag", "turn the view; with Shift move it; wheel: zoom"], ["click", "select what is under the pointer"], ["Ctrl drag", "push the body under the pointer"],
];

/** The overlay with all keys. */
export class Help {
  constructor() {
    this.dialog = htmlElement(document.body, "dialog", "help");
    this.dialog.setAttribute("aria-label", "keys");
    htmlElement(this.dialog, "h2", "", "Keys");
    const list = htmlElement(this.dialog, "dl");
    for (const [key, what] of KEYS) { htmlElement(list, "dt", "", key); htmlElement(list, "dd", "", what); }
    const close = htmlElement(this.dialog, "button", "", "close");
    close.type = "button";
    close.onclick = () => this.dialog.close();
    this.dialog.onclick = (event) => { if (event.target === this.dialog) this.dialog.close(); };
  }
  toggle() { if (this.dialog.open) this.dialog.close(); else this.dialog.showModal(); }
}

const typing = (target) => target.matches?.("input:not([type=range]):not([type=checkbox]), select, textarea, [contenteditable]");

/** Binds the keys to a run, its stage, tree and time line. */
export function bindKeys({ run, stage, tree, timeline, help }) {
  const camera = (by) => {
    if (!stage) return;
    const { names } = stage.view.camera.constructor;
    stage.view.camera.choose(names[(names.indexOf(stage.view.camera.name) + by + names.length) % names.length]);
    stage.view.invalidate();
  };
  const does = {
    " ": () => run.toggle(), f: () => stage?.focus(), F: () => stage?.focus(), "/": () => tree.search.focus(), "?": () => help.toggle(),
    "[": () => camera(-1), "]": () => camera(1), End: () => run.look(null), ArrowLeft: () => timeline.seek(run.shown - 0.1),
    ArrowRight: () => (run.looked === null && !run.replaying ? run.act("run.step", { steps: 1 }) : timeline.seek(run.shown + 0.1)),
    p: () => { if (run.variables.has(run.selected)) run.tell("plot", run.selected); },
  };
  addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z" && !typing(event.target)) { event.preventDefault(); run.undo(); return; }
    const act = does[event.key];
    const own = event.key === " " && event.target.matches?.("button, summary, input, [role=treeitem], [role=tab]");
    if (!act || event.ctrlKey || event.metaKey || event.altKey || typing(event.target) || own || help.dialog.open && event.key !== "?") return;
    event.preventDefault();
    act();
  });
}
