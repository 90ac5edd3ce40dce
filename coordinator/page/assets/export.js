// Plots as files: a table of text, a picture. Made in the browser; nothing leaves it.

function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The table: a row for each time at which any curve has a value, the last value of the others. */
export function table(names, series, units) {
  const head = ["t (s)", ...names.map((n) => (units(n) ? `${n} (${units(n)})` : n))];
  const times = [...new Set(names.flatMap((n) => series.get(n).t))].sort((a, b) => a - b);
  const at = names.map(() => -1);
  const rows = times.map((t) => [t, ...names.map((n, k) => {
    const own = series.get(n);
    while (at[k] + 1 < own.t.length && own.t[at[k] + 1] <= t) at[k]++;
    const value = own.y[at[k]];
    return Number.isFinite(value) ? value : "";
  })].join(","));
  return [head.join(","), ...rows].join("\n") + "\n";
}

/** Saves curves as CSV. */
export function saveCsv(names, series, run) {
  if (!names.length) { run.say("There is no plot to save."); return; }
  const text = table(names, series, (n) => run.variables.get(n)?.unit ?? "");
  save(new Blob([text], { type: "text/csv" }), `${run.state?.scenario ?? "run"}.csv`);
}

/** Height of the head above a plot in its picture, pixels. */
const HEAD = 60;
const LOOKS = ["stroke", "fill", "stroke-width", "stroke-dasharray", "font-size", "font-family", "font-weight", "opacity", "text-anchor", "visibility"];

// The title of a plot and the names of its curves in their colours, as its head shows them.
function drawHead(context, plot, style) {
  context.fillStyle = style.color;
  context.font = `600 25px ${style.fontFamily}`;
  const title = plot.title.textContent;
  context.fillText(title, 20, HEAD - 20);
  let x = 50 + context.measureText(title).width;
  context.font = `24px ${style.fontFamily}`;
  for (const key of plot.box.querySelectorAll(".key:not(.off)")) {
    const name = key.firstChild.textContent;
    context.fillStyle = getComputedStyle(key, "::before").borderTopColor;
    context.fillRect(x, HEAD - 30, 28, 5);
    context.fillText(name, x + 38, HEAD - 20);
    x += 70 + context.measureText(name).width;
  }
}

/** Saves a plot as PNG, twice as large as on the screen. */
export function savePng(plot, name) {
  const { svg } = plot;
  const copy = svg.cloneNode(true);
  const [own, theirs] = [svg.querySelectorAll("*"), copy.querySelectorAll("*")];
  own.forEach((element, k) => {
    const style = getComputedStyle(element);
    for (const look of LOOKS) theirs[k].style.setProperty(look, style.getPropertyValue(look));
  });
  const { width, height } = svg.getBoundingClientRect();
  for (const [key, value] of [["xmlns", "http://www.w3.org/2000/svg"], ["width", 2 * width], ["height", 2 * height], ["viewBox", `0 0 ${width} ${height}`]]) {
    copy.setAttribute(key, value);
  }
  const picture = new Image();
  picture.onload = () => {
    const canvas = Object.assign(document.createElement("canvas"), { width: 2 * width, height: 2 * height + HEAD });
    const context = canvas.getContext("2d");
    const style = getComputedStyle(plot.box);
    context.fillStyle = style.backgroundColor;
    context.fillRect(0, 0, canvas.width, canvas.height);
    drawHead(context, plot, style);
    context.drawImage(picture, 0, HEAD);
    canvas.toBlob((blob) => save(blob, `${name.replace(/[^\w.-]+/g, "_").slice(0, 80)}.png`));
  };
  picture.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
}
