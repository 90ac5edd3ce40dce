// The run that the page shows: its variables, their values, state, events and changes, and where in time the reader looks.
import { Link } from "terraglue/link.js";
import { eachFrame } from "terraglue/frames.js";
import { columnReader } from "terraglue/columns.js";

/** Events: `run`, `variables`, `values`, `changed`, `events`, `time`, `moment`, `select`, `link`, `told`, `branch`. */
export class Run extends EventTarget {
  constructor(place, token) {
    super();
    this.place = place;
    this.token = token;
    Object.assign(this, { variables: new Map(), actions: [], values: new Map(), state: null, changed: [], events: [], metadata: {} });
    Object.assign(this, { selected: null, looked: null, connected: false, t: 0, watching: {} });
    const scheme = place.protocol === "https:" ? "wss:" : "ws:";
    // of poses only the newest counts, as often as a screen shows them
    const wishes = new URLSearchParams({ rate_hz: 30, ...(token ? { token } : {}) });
    this.link = new Link(`${scheme}//${place.host}/ws?${wishes}`);
    this.listen();
  }

  tell(name, detail) { this.dispatchEvent(new CustomEvent(name, { detail })); }
  on(name, act) { this.addEventListener(name, ({ detail }) => act(detail)); }

  listen() {
    const { link } = this;
    const from = (name, act) => link.addEventListener(name, ({ detail }) => act(detail));
    from("open", () => { this.connected = true; this.tell("link", true); });
    from("lost", () => { this.connected = false; this.tell("link", false); });
    from("status", ({ id, level, message }) => { if (id === "behind") this.tell("behind"); else if (level >= 2) this.say(message, true); });
    from("values", (parameters) => this.takeValues(parameters));
    link.subscribe("/variables", (list) => this.takeVariables(list));
    link.subscribe("/actions", (list) => { this.actions = list; this.tell("variables"); });
    link.subscribe("/channels", (metadata) => { this.metadata = metadata; this.tell("channels"); });
    link.subscribe("/run", (state) => this.takeState(state));
    link.subscribe("/changed", (list) => { this.changed = list; this.tell("changed"); });
    link.subscribe("/events", (log, t) => this.takeEvent({ t, what: log.message, level: log.level }));
  }

  takeVariables(list) {
    this.variables = new Map(list.map((v) => [v.id, v]));
    this.tell("variables");
    this.loadEvents();
  }

  takeState(state) {
    const branched = this.state && state.branch !== this.state.branch;
    // a client that lags behind gets the newest state before older ones
    const back = this.state && state.mode === "replay" && state.t_s < this.state.t_s - 1e-9;
    this.state = state;
    this.t = state.t_s;
    if (branched || back) { this.loadEvents(); this.tell("branch"); }
    this.tell("run", state);
  }

  takeEvent(event) {
    if (this.events.some((e) => e.t === event.t && e.what === event.what)) return;
    this.events.push(event);
    this.events.sort((a, b) => a.t - b.t);
    this.tell("events");
  }

  takeValues(parameters) {
    for (const { name, value } of parameters) this.values.set(name, value);
    this.tell("values", parameters.map((p) => p.name));
  }

  address(path, query) {
    const all = new URLSearchParams({ ...query, ...(this.token ? { token: this.token } : {}) });
    return `${path}?${all}`;
  }

  /** All events so far: those before the page was opened, too. */
  async loadEvents() {
    const found = [];
    try {
      const answer = await fetch(this.address("/messages", { topic: "/events" }));
      if (!answer.ok) return;
      eachFrame(await answer.arrayBuffer(), (id, t, bytes) => {
        const channel = this.link.channels.get(id);
        if (!channel) return;
        const log = this.link.read(channel, bytes);
        found.push({ t, what: log.message, level: log.level });
      });
    } catch { return; }
    this.events = found;
    this.tell("events");
  }

  /** The last messages at a time: `take(topic, message, t_s)`. */
  async at(t, topics, take) {
    const answer = await fetch(this.address("/at", { t, topics: topics.join(",") }));
    if (!answer.ok) throw new Error(await answer.text());
    eachFrame(await answer.arrayBuffer(), (id, when, bytes) => {
      const channel = this.link.channels.get(id);
      if (channel) take(channel.topic, this.link.read(channel, bytes), when);
    });
  }

  /** Times and values of variables, thinned to so many points. */
  async history(names, points = 4000) {
    const answer = await fetch(this.address("/history", { names: names.join(","), points }));
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  }

  /** A reader of the variables in the messages of a topic; null where it has none. */
  columns(topic) {
    const [channel, metadata] = [this.link.byTopic.get(topic), this.metadata[topic]];
    if (!channel || !metadata?.columns) return null;
    channel.reader ?? this.link.read(channel, new Uint8Array());
    return columnReader(JSON.parse(metadata.columns), channel.reader.fields, metadata.subsystem);
  }

  /** Follows the values of variables for somebody; each has a list of its own. */
  watch(who, ids) {
    this.watching[who] = ids;
    this.link.watch([...new Set(Object.values(this.watching).flat())]);
  }

  select(id) {
    this.selected = id;
    this.tell("select", id);
  }

  /** Looks at a time of the past; null: follows the run. */
  look(t) {
    this.looked = t;
    this.tell("moment", t);
  }

  /** The time that is shown. */
  get shown() { return this.looked ?? this.t; }

  say(text, bad = false) { this.tell("told", { text, bad }); }

  /** Calls a service and says where it was refused. */
  async act(name, request) {
    try { return await this.link.call(name, request); } catch (error) { this.say(`${name}: ${error.message}`, true); return null; }
  }

  /** Writes a variable; throws with the reason where it was refused. */
  write(id, value) { return this.link.write(id, value); }

  get replaying() { return this.state?.mode === "replay"; }
  get playing() { return this.state?.state === "playing"; }
  toggle() { return this.act(this.playing ? "run.pause" : "run.play"); }
  undo() {
    const last = this.changed.reduce((a, b) => (!a || b.t_s >= a.t_s ? b : a), null);
    if (last) this.act("run.undo", { id: last.id }); else this.say("Nothing was changed.");
  }
}
