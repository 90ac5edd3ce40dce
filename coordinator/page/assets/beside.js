// Another recording beside the run: its robot as a ghost in the view at the time that is shown, its variables in the oscilloscope.
import { takeScene } from "terraglue/bodies.js";
import { eachFrame } from "terraglue/frames.js";
import { readerOf } from "terraglue/link.js";

/** How often the ghost is brought to the time of the view, ms. */
const FOLLOW_MS = 50;

/** The recording that the server offers beside the run; sends `beside` once it is known. */
export class Beside {
  constructor(run) {
    Object.assign(this, { run, name: "", channels: new Map(), asked: NaN, busy: false });
    run.on("link", (on) => { if (on && run.link.info?.metadata?.beside && !this.name) this.load(); });
  }

  async ask(path, query) {
    const answer = await fetch(this.run.address(`beside/${path}`, query));
    if (!answer.ok) throw new Error(await answer.text());
    return answer;
  }

  async load() {
    try {
      const about = await (await this.ask("about", {})).json();
      Object.assign(this, { name: about.name, from: about.from_s, to: about.to_s });
      for (const channel of about.channels) this.channels.set(channel.id, { topic: channel.topic, read: readerOf(channel) });
      this.run.tell("beside", this);
    } catch (error) { this.run.say(`the run beside this one: ${error.message}`, true); }
  }

  /** The last messages of topics at a time: `take(topic, message)`. */
  async at(t, topics, take) {
    const within = Math.min(Math.max(t, this.from), this.to);
    const answer = await this.ask("at", { t: within, topics: topics.join(",") });
    eachFrame(await answer.arrayBuffer(), (id, _, bytes) => {
      const channel = this.channels.get(id);
      if (channel) take(channel.topic, channel.read(bytes));
    });
  }

  /** Times and values of variables, as `Run.history` gives them. */
  async history(names, points = 4000) { return (await this.ask("history", { names: names.join(","), points })).json(); }

  /** Lets a ghost in a view follow `time()`. */
  follow(view, time) {
    const haunt = async () => {
      const t = time();
      if (this.busy || t === this.asked || !view.layers.ghost.on || document.hidden) return;
      this.busy = true;
      this.asked = t;
      try {
        await this.at(t, ["/tf"], (_, { transforms }) => {
          for (const { child_frame_id: frame, translation: p, rotation: q } of transforms) {
            if (p && q) view.ghost.poses.set(frame, { p: [p.x, p.y, p.z], q: [q.w, q.x, q.y, q.z] });
          }
        });
        view.invalidate();
      } catch (error) { this.run.say(`the run beside this one: ${error.message}`, true); }
      this.busy = false;
    };
    this.at(this.from, ["/scene"], (_, scene) => takeScene(view.ghost.entities, scene)).then(() => setInterval(haunt, FOLLOW_MS));
  }
}
