// The connection to a run: the Foxglove WebSocket protocol (foxglove.websocket.v1), as every client of it speaks it. Connects again
// when it is lost; whoever subscribed stays subscribed.
import { decoder } from "terraglue/protobuf.js";

const MESSAGE = 1, TIME = 2, ANSWER = 3, CALL = 2;
const SILENT_TICKS = 10;
const AGAIN_MS = [300, 600, 1200, 2500];

const textOf = new TextDecoder();
const bytesOf = (base64) => Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));

/** The reader of the messages of a channel: Protobuf by its descriptors, JSON, or bytes as they are. */
export function readerOf(channel) {
  if (channel.encoding === "json") return (bytes) => JSON.parse(textOf.decode(bytes));
  if (channel.encoding !== "protobuf") return (bytes) => bytes;
  const read = decoder(bytesOf(channel.schema), channel.schemaName);
  return read;
}

/** Events: `open`, `lost`, `channels`, `status`, `values`; messages go to the functions of `subscribe`. */
export class Link extends EventTarget {
  constructor(address) {
    super();
    Object.assign(this, { address, channels: new Map(), byTopic: new Map(), wanted: new Map(), services: new Map() });
    Object.assign(this, { calls: new Map(), writes: new Map(), numbers: 0, attempts: 0, silent: 0, watched: [], open: false, info: null });
    this.connect();
    // a server that is silent is as good as gone: it sends its state five times a second. However long the page itself is too busy
    // to listen, that is one tick.
    setInterval(() => { if (this.open && this.silent++ >= SILENT_TICKS) this.socket.close(); }, 1000);
  }

  tell(name, detail) { this.dispatchEvent(new CustomEvent(name, { detail })); }

  connect() {
    const socket = new WebSocket(this.address, ["foxglove.websocket.v1"]);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onmessage = ({ data }) => {
      this.silent = 0;
      if (typeof data === "string") this.takeText(JSON.parse(data)); else this.takeBytes(new DataView(data));
    };
    socket.onclose = () => this.lose();
  }

  lose() {
    const was = this.open;
    this.open = false;
    for (const { reject } of [...this.calls.values(), ...this.writes.values()]) reject(new Error("the connection was lost"));
    this.calls.clear();
    this.writes.clear();
    this.channels.clear();
    this.byTopic.clear();
    if (was || this.attempts === 0) this.tell("lost");
    const wait = AGAIN_MS[Math.min(this.attempts++, AGAIN_MS.length - 1)];
    setTimeout(() => this.connect(), wait);
  }

  send(message) { if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message)); }

  takeText(message) {
    const take = {
      serverInfo: () => { this.open = true; this.attempts = 0; this.info = message; this.watch(this.watched); this.tell("open", message); },
      advertise: () => this.announce(message.channels),
      unadvertise: () => { for (const id of message.channelIds) this.forget(id); },
      advertiseServices: () => { for (const s of message.services) this.services.set(s.name, s.id); this.tell("services"); },
      unadvertiseServices: () => {},
      parameterValues: () => this.takeValues(message),
      status: () => this.takeStatus(message),
      serviceCallFailure: () => this.answer(message.callId, (call) => call.reject(new Error(message.message))),
    }[message.op];
    take?.();
  }

  announce(channels) {
    for (const channel of channels) {
      this.channels.set(channel.id, channel);
      this.byTopic.set(channel.topic, channel);
      if (this.wanted.has(channel.topic)) this.ask(channel);
    }
    this.tell("channels");
  }

  forget(id) {
    const channel = this.channels.get(id);
    if (channel && this.byTopic.get(channel.topic) === channel) this.byTopic.delete(channel.topic);
    this.channels.delete(id);
  }

  // The number of a subscription is that of its channel.
  ask(channel) { this.send({ op: "subscribe", subscriptions: [{ id: channel.id, channelId: channel.id }] }); }

  /** Calls `take(message, t_s, topic)` with every message of a topic from now on; a latched one arrives at once. */
  subscribe(topic, take) {
    this.wanted.set(topic, take);
    const channel = this.byTopic.get(topic);
    if (channel) this.ask(channel);
  }

  unsubscribe(topic) {
    const channel = this.byTopic.get(topic);
    if (this.wanted.delete(topic) && channel) this.send({ op: "unsubscribe", subscriptionIds: [channel.id] });
  }

  /** A message of a channel, read. */
  read(channel, bytes) {
    channel.reader ??= readerOf(channel);
    return channel.reader(bytes);
  }

  takeBytes(view) {
    const kind = view.getUint8(0);
    if (kind === MESSAGE) {
      const channel = this.channels.get(view.getUint32(1, true));
      const take = channel && this.wanted.get(channel.topic);
      if (!take) return;
      const bytes = new Uint8Array(view.buffer, 13);
      take(this.read(channel, bytes), Number(view.getBigUint64(5, true)) / 1e9, channel.topic);
    } else if (kind === TIME) this.tell("time", Number(view.getBigUint64(1, true)) / 1e9);
    else if (kind === ANSWER) {
      const size = view.getUint32(9, true);
      const body = textOf.decode(new Uint8Array(view.buffer, 13 + size));
      this.answer(view.getUint32(5, true), (call) => call.resolve(body ? JSON.parse(body) : {}));
    }
  }

  answer(id, act) {
    const call = this.calls.get(id);
    this.calls.delete(id);
    if (call) act(call);
  }

  /** Calls a service with a JSON request; gives its response, or throws with the reason. */
  call(name, request = {}) {
    const service = this.services.get(name);
    if (service === undefined) return Promise.reject(new Error(`this run offers no ${name}`));
    const id = ++this.numbers;
    const body = new TextEncoder().encode(JSON.stringify(request));
    const bytes = new Uint8Array(17 + body.length);
    const view = new DataView(bytes.buffer);
    view.setUint8(0, CALL);
    view.setUint32(1, service, true);
    view.setUint32(5, id, true);
    view.setUint32(9, 4, true);
    bytes.set(new TextEncoder().encode("json"), 13);
    bytes.set(body, 17);
    return new Promise((resolve, reject) => {
      this.calls.set(id, { resolve, reject });
      if (this.socket.readyState === WebSocket.OPEN) this.socket.send(bytes);
      else this.answer(id, (call) => call.reject(new Error("not connected")));
    });
  }

  /** Asks for these variables and for their changes. */
  watch(names) {
    if (this.watched.length) this.send({ op: "unsubscribeParameterUpdates", parameterNames: this.watched });
    this.watched = names;
    if (!names.length) return;
    this.send({ op: "subscribeParameterUpdates", parameterNames: names });
    this.send({ op: "getParameters", parameterNames: names, id: `get${++this.numbers}` });
  }

  /** Writes a variable; resolves with its value then, throws with the reason where it was refused. */
  write(name, value) {
    const id = `set${++this.numbers}`;
    return new Promise((resolve, reject) => {
      if (!this.open) { reject(new Error("not connected")); return; }
      this.writes.set(id, { name, resolve, reject, reason: null });
      this.send({ op: "setParameters", parameters: [{ name, value }], id });
    });
  }

  takeStatus(status) {
    const own = [...this.writes.values()].find((w) => w.name && status.message.includes(w.name)) ?? [...this.writes.values()][0];
    if (status.level >= 1 && own) own.reason = status.message;
    this.tell("status", status);
  }

  takeValues({ parameters, id }) {
    this.tell("values", parameters);
    const write = this.writes.get(id);
    if (!write) return;
    this.writes.delete(id);
    if (write.reason) write.reject(new Error(write.reason));
    else write.resolve(parameters.find((p) => p.name === write.name)?.value);
  }
}
