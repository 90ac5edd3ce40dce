// Lists beside the view: what happened, what the operator changed, and the modules of the run.
import { htmlElement, short } from "terraglue/axes.js";
import { kindOf } from "terraglue/timeline.js";

const MOST = 500;

/** Events, the newest first; a click goes there in time and selects. */
export class Events {
  constructor(parent, run) {
    this.run = run;
    const bar = htmlElement(parent, "div", "panel-bar");
    htmlElement(bar, "h2", "", "Events");
    this.count = htmlElement(bar, "span", "quiet");
    this.list = htmlElement(parent, "ol", "events-list");
    run.on("events", () => this.build());
  }

  build() {
    const { events, variables } = this.run;
    this.count.textContent = events.length ? String(events.length) : "";
    this.list.replaceChildren();
    for (const event of events.slice(-MOST).reverse()) {
      const button = htmlElement(htmlElement(this.list, "li"), "button", `event ${kindOf(event)}`);
      button.type = "button";
      htmlElement(button, "span", "num", `${event.t.toFixed(3)} s`);
      htmlElement(button, "span", "what", event.what);
      button.onclick = () => {
        this.run.tell("seek", event.t);
        const named = event.what.match(/[\w-]+(?:\.[\w\[\]-]+)+/g)?.find((id) => variables.has(id));
        if (named) this.run.select(named);
      };
    }
  }
}

/** Changes of the operator; each can be undone, and all be saved as a scenario. */
export class Changes {
  constructor(parent, run) {
    this.run = run;
    this.list = htmlElement(parent, "ul", "changes");
    this.save = htmlElement(parent, "button", "", "save as scenario");
    this.save.type = "button";
    this.save.onclick = () => this.export();
    run.on("changed", () => this.build());
    this.build();
  }

  build() {
    const { changed } = this.run;
    this.list.replaceChildren();
    this.save.hidden = !changed.length;
    if (!changed.length) htmlElement(this.list, "li", "empty", "Nothing was changed in this run.");
    for (const { id, value, was, t_s, pending } of changed) {
      const item = htmlElement(this.list, "li");
      const name = htmlElement(item, "button", "link", id);
      name.type = "button";
      name.onclick = () => this.run.select(id);
      htmlElement(item, "span", "quiet", `${show(was)} → ${show(value)} ${pending ? "when the run starts again" : `at ${t_s.toFixed(3)} s`}`);
      const undo = htmlElement(item, "button", "", "undo");
      undo.type = "button";
      undo.onclick = () => this.run.act("run.undo", { id });
    }
  }

  async export() {
    const answer = await this.run.act("run.changes");
    if (!answer) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([answer.scenario], { type: "application/toml" }));
    link.download = `${(this.run.state?.scenario ?? "run").replace(/\.toml$/, "")}_changed.toml`;
    link.click();
  }
}

const show = (value) => (typeof value === "number" ? short(value) : String(value));

/** The modules of the run: how much each shows, and whether it can go back in time. */
export class Modules {
  constructor(parent, run) {
    this.run = run;
    this.list = htmlElement(parent, "ul", "modules");
    run.on("variables", () => this.build());
    run.on("run", (state) => { const key = String(state.cannot_rewind); if (key !== this.key) { this.key = key; this.build(); } });
  }

  build() {
    const counts = new Map();
    for (const { id, subsystem } of this.run.variables.values()) {
      const name = subsystem ?? id.split(".")[0];
      counts.set(name, (counts.get(name) ?? 0) + 1);
    }
    this.list.replaceChildren();
    for (const [name, count] of counts) {
      const item = htmlElement(this.list, "li");
      const button = htmlElement(item, "button", "link", name);
      button.type = "button";
      button.onclick = () => this.run.select(name);
      const stuck = (this.run.state?.cannot_rewind ?? []).includes(name);
      htmlElement(item, "span", "quiet", `${count} variables${stuck ? "; cannot go back in time" : ""}`);
    }
  }
}
