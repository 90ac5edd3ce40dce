// Tabs by the rules of ARIA: arrows move between them, each shows one panel.
import { htmlElement } from "terraglue/axes.js";

/** Tabs in `parent` by their names; gives the panels. */
export function tabs(parent, names, label) {
  const bar = htmlElement(parent, "div", "tabs");
  bar.setAttribute("role", "tablist");
  bar.setAttribute("aria-label", label);
  const made = names.map((name) => {
    const tab = htmlElement(bar, "button", "tab", name);
    const panel = htmlElement(parent, "div", "tab-panel");
    Object.assign(tab, { type: "button", id: `tab-${name}` });
    panel.id = `panel-${name}`;
    for (const [of, key, value] of [[tab, "role", "tab"], [tab, "aria-controls", panel.id], [panel, "role", "tabpanel"], [panel, "aria-labelledby", tab.id]]) {
      of.setAttribute(key, value);
    }
    return { tab, panel };
  });
  const show = (k) => made.forEach(({ tab, panel }, n) => {
    tab.setAttribute("aria-selected", String(n === k));
    tab.tabIndex = n === k ? 0 : -1;
    panel.hidden = n !== k;
  });
  made.forEach(({ tab }, k) => {
    tab.onclick = () => show(k);
    tab.onkeydown = (event) => {
      const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!by) return;
      const next = (k + by + made.length) % made.length;
      event.stopPropagation();
      show(next);
      made[next].tab.focus();
    };
  });
  show(0);
  return Object.fromEntries(names.map((name, k) => [name, made[k]]));
}
