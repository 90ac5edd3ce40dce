// The plots of a page: panels of the figures that the page's data describe, all over one time axis.
import { unpack } from "terraglue/axes.js";
import { Plot, TimeAxis } from "terraglue/plot.js";
import { XyPlot } from "terraglue/xy.js";

// From the first to the last time of all curves.
function span(times) {
  const some = times.filter((t) => t.length);
  const low = some.length ? Math.min(...some.map((t) => t[0])) : 0;
  const high = Math.max(low, ...some.map((t) => t.at(-1)));
  return [low, high > low ? high : low + 1];
}

// A panel with its numbers unpacked.
function unpacked(panel, times) {
  const along = (curve) => (panel.x ? unpack(curve.x) : times[curve.t]);
  return { ...panel, curves: panel.curves.map((c) => ({ ...c, t: along(c), y: unpack(c.y) })) };
}

function show(figure, parent, axis, times, choice) {
  axis.plots = axis.plots.filter((plot) => !parent.contains(plot.box));
  parent.replaceChildren();
  const panels = figure.panels.filter((p) => p.choice === null || p.choice === choice);
  panels.forEach((panel, k) => {
    const last = k === panels.length - 1;
    const own = unpacked(panel, times);
    if (panel.x) new XyPlot(parent, own, last); else new Plot(parent, own, axis, last);
  });
}

/** Builds all figures of the page's data; returns the time axis that they share. */
export function buildFigures(data) {
  const times = data.times.map(unpack);
  const axis = new TimeAxis(...span(times));
  axis.events = data.events;
  for (const figure of data.figures) {
    const parent = document.querySelector(`[data-figure="${figure.id}"]`);
    show(figure, parent, axis, times, figure.chosen);
    const select = document.querySelector(`[data-choose="${figure.id}"]`);
    if (select) select.onchange = () => show(figure, parent, axis, times, Number(select.value));
  }
  return axis;
}
