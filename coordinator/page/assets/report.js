// Entry point of a report: builds the plots, the map and the replay when it is opened.
import { buildFigures } from "terraglue/figures.js";
import { GroundMap } from "terraglue/map.js";
import { showReplay, wishes } from "terraglue/replay.js";

const data = JSON.parse(document.getElementById("data").textContent);
// a picture of the view alone needs nothing else
const alone = wishes().has("alone");
const axis = alone ? null : buildFigures(data);
if (data.map && !alone) new GroundMap(data.map);
/** The replay, or null where there is none. */
export const ready = data.replay ? showReplay(data, axis) : Promise.resolve(null);
// a signal for programs that drive the page from outside: pictures are taken once it is ready
ready.then((replay) => {
  document.documentElement.dataset.ready = "yes";
  document.addEventListener("terraglue:go", (event) => replay?.go(event.detail));
});
