// A video of the replay, frame by frame in simulated time: draws each picture with its legend and its time, has the browser encode
// it, and posts it to the program that opened this page. Without an encoder the pictures are posted as they are.
import { ready } from "terraglue/report.js";

/** Encoders of this browser in the order of preference: what WebM calls them, and what the browser does. */
const CODECS = [["V_VP9", "vp09.00.41.08"], ["V_VP8", "vp8"]];
/** Seconds of the video between pictures that need none before them. */
const WHOLE_EVERY_S = 2;
const BITS_PER_PIXEL = 0.12;

const wish = new URLSearchParams(location.hash.slice(1));
const number = (name) => Number(wish.get(name));

async function post(kind, body, query = "") {
  const answer = await fetch(`${kind}${query}`, { method: "POST", body });
  if (!answer.ok) throw new Error(`the program takes no more pictures (${answer.status})`);
}

// Colours in a style of the page, in their order.
const coloursOf = (style) => style.match(/rgba?\([^)]*\)/g) ?? [];

function fillAcross(paper, [x, y, w, h], colours, [dx, dy]) {
  const fill = paper.createLinearGradient(x, y, x + dx, y + dy);
  colours.forEach((colour, k) => fill.addColorStop(k / Math.max(colours.length - 1, 1), colour));
  paper.fillStyle = fill;
  paper.fillRect(x, y, w, h);
}

/** Puts the picture together as the page shows it: sky, view, scale of the colours, labels, time. */
class Composer {
  constructor(view, width, height) {
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    Object.assign(this, { view, canvas, width, height, paper: canvas.getContext("2d", { alpha: false, willReadFrequently: true }) });
    const style = getComputedStyle(view.box);
    this.sky = coloursOf(style.backgroundImage);
    this.ink = getComputedStyle(view.menus.legend).color;
    this.ground = getComputedStyle(view.menus.legend).backgroundColor;
    this.font = style.fontFamily;
  }

  plate(x, y, w, h) {
    this.paper.fillStyle = this.ground;
    this.paper.beginPath();
    this.paper.roundRect(x, y, w, h, 7);
    this.paper.fill();
    this.paper.fillStyle = this.ink;
  }

  text(text, x, y, size = 12, align = "left") {
    Object.assign(this.paper, { font: `${size}px ${this.font}`, textAlign: align, textBaseline: "middle" });
    this.paper.fillText(text, x, y);
  }

  legend() {
    const { legend } = this.view.menus;
    if (legend.hidden || !legend.children.length) return;
    const [x, y, w] = [10, this.height - 62, 190];
    this.plate(x, y, w, 52);
    const [title, bar, ticks] = legend.children;
    this.text(title.textContent, x + 12, y + 13);
    fillAcross(this.paper, [x + 12, y + 23, w - 28, 8], coloursOf(bar.style.background), [w - 28, 0]);
    this.paper.fillStyle = this.ink;
    for (const tick of ticks.children) this.text(tick.textContent, x + 12 + ((w - 28) * parseFloat(tick.style.left)) / 100, y + 41, 10.5, "center");
  }

  labels() {
    for (const label of this.view.labels.children) {
      const [x, y] = [label.style.left, label.style.top].map((part, k) => (parseFloat(part) * [this.width, this.height][k]) / 100);
      const half = this.paper.measureText(label.textContent).width / 2 + 5;
      this.plate(x - half, y - 26, 2 * half, 18);
      this.text(label.textContent, x, y - 17, 12, "center");
    }
  }

  picture(t) {
    fillAcross(this.paper, [0, 0, this.width, this.height], this.sky, [0, this.height]);
    this.paper.drawImage(this.view.canvas, 0, 0, this.width, this.height);
    this.legend();
    this.labels();
    this.plate(10, 10, 104, 24);
    this.text(`t = ${t.toFixed(2)} s`, 20, 22.5, 13);
    return this.canvas;
  }
}

async function codecOf(size) {
  if (typeof VideoEncoder === "undefined" || wish.get("encoder") === "none") return null;
  for (const [name, codec] of CODECS) {
    const config = { codec, ...size, bitrate: BITS_PER_PIXEL * size.width * size.height * size.framerate, latencyMode: "quality" };
    const { supported } = await VideoEncoder.isConfigSupported(config).catch(() => ({ supported: false }));
    if (supported) return { name, config };
  }
  return null;
}

/** Posts what the encoder makes, one after another; a failure comes out of `done`. */
function encoderOf(config) {
  let [posted, failure] = [Promise.resolve(), null];
  const output = (chunk) => {
    const bytes = new Uint8Array(chunk.byteLength);
    chunk.copyTo(bytes);
    posted = posted.then(() => post("picture", bytes, `?t=${chunk.timestamp}&whole=${chunk.type === "key" ? 1 : 0}`)).catch((error) => { failure ??= error; });
  };
  const encoder = new VideoEncoder({ output, error: (error) => { failure ??= error; } });
  encoder.configure(config);
  const check = () => { if (failure) throw failure; };
  return {
    async take(frame, keyFrame) {
      encoder.encode(frame, { keyFrame });
      frame.close();
      // as many pictures as are encoded at a time
      while (encoder.encodeQueueSize > 2 && !failure) await new Promise((again) => { setTimeout(again, 2); });
      await posted;
      check();
    },
    async done() { await encoder.flush(); await posted; check(); },
  };
}

async function film(replay) {
  const [width, height, framerate] = [number("width"), number("height"), number("fps")];
  const [from, speed, count] = [number("from"), number("speed"), number("count")];
  const { view } = replay;
  replay.setPlaying(false);
  Object.assign(view.box.style, { width: `${width}px`, height: `${height}px` });
  // each picture is drawn once, when it is its time
  view.waiting = true;
  const composer = new Composer(view, width, height);
  const codec = await codecOf({ width, height, framerate });
  await post("begin", JSON.stringify({ codec: codec?.name ?? null }));
  const encoder = codec && encoderOf(codec.config);
  for (let k = 0; k < count; k++) {
    const t = Math.min(from + (speed * k) / framerate, replay.end);
    replay.go(t);
    view.draw();
    const canvas = composer.picture(t);
    const timestamp = Math.round((1e6 * k) / framerate);
    if (encoder) await encoder.take(new VideoFrame(canvas, { timestamp, duration: Math.round(1e6 / framerate) }), k % Math.round(WHOLE_EVERY_S * framerate) === 0);
    else await post("raw", composer.paper.getImageData(0, 0, width, height).data, `?t=${timestamp}`);
  }
  await encoder?.done();
  await post("end", "");
}

ready.then((replay) => {
  if (!replay) throw new Error(document.querySelector("#replay .notice")?.textContent ?? "the run has no body with a shape: there is nothing to see");
  return film(replay);
}).catch((error) => post("failed", error.message));
