// What the page computes of the frames that nobody looked at yet: a torn frame or cloth that slips is
// told without anybody having come upon it.

import {besideOf, heightOf, median} from "./timeline.js";

const kRest = 1000;  // ms without a request, from which on work in the background disturbs nobody

/// Figures of all frames, file by file while nothing plays and nobody has asked for a frame of late, first of what
/// is shown; what stands out becomes a finding.
export async function survey(app) {
  if (app.surveying) {
    return;
  }
  app.surveying = true;
  const isLeft = timeline => !timeline.surveyed;
  for (let timeline; (timeline = [app.now, ...app.timelines].find(isLeft)) !== undefined;) {
    const layer = timeline.layers.find(one => !one.isTold);
    timeline.surveyed = layer === undefined;
    if (timeline.surveyed) {
      continue;
    }
    const isBusy = app.timeline.playing || app.loading || performance.now() - app.askedAt < kRest;
    await new Promise(resolve => setTimeout(resolve, isBusy ? 100 : 0));
    if (isBusy || await layer.surveyNext().catch(() => true)) {
      continue;
    }
    layer.isTold = true;
    const marks = marksOf(layer, timeline.info.marks);
    timeline.info.marks.push(...marks);
    marks.length > 0 ? app.setFindings() : app.timeline.chooseSeries();
  }
  app.surveying = false;
}

/// What the figures of a layer's frames tell, beside what is known.
function marksOf(layer, known) {
  const {info, figures, frames} = layer;
  const mark = (index, text, vertex, coloring = layer.coloring) => ({severity: "warning", stage: info.stage,
    text: `${info.name}: ${text}`, frame: frames[index], layer: info.name, coloring, vertex});
  const inRuns = (values, find) => layer.runs.flatMap(({first, end}) => find(values.slice(first, end)).map(i => i + first));
  const torn = inRuns(figures.deviation, tornFrames);
  return [
    ...layer.unreadable.filter(([frame]) => !known.some(mark => mark.frame === frame && mark.stage === info.stage &&
      mark.severity !== "note")).map(([frame, why]) => ({severity: "error", stage: info.stage, frame,
      text: `${info.name}: frame ${frame} cannot be read: ${why}`})),
    ...torn.map(i => mark(i, `torn: edges are up to ${(1000 * figures.deviation[i]).toFixed(0)} mm longer or shorter than in ` +
      "the frames beside", layer.worst.deviation[i])),
    ...inRuns(figures.strain, suddenRises).filter(i => !torn.includes(i) && !torn.includes(i - 1)).map(i => mark(i,
      `the strain jumps from ${percent(figures.strain[i - 1])} to ${percent(figures.strain[i])}: the cloth slips or a seam opens`,
      layer.worst.strain[i], "strain")),
  ];
}

const percent = share => `${(100 * share).toFixed(0)} %`;

/// Values that are so far above the others (heightOf) are none of them.
const kStandsOut = 8;

/// Frames whose edges are off by more than a centimetre, and by far more than in other frames, and that
/// stand alone: of what changes and stays, two frames are off alike. At the ends, and among a few frames,
/// where nobody can tell these apart, by more than three centimetres.
export function tornFrames(deviation) {
  const count = deviation.length;
  const least = i => i === 0 || i === count - 1 || count < kFew ? 0.03 : 0.01;  // m
  return deviation.flatMap((value, i) => value > least(i) &&
    value > 1.5 * Math.max(deviation[i - 1] || 0, deviation[i + 1] || 0) &&
    heightOf(deviation, i, besideOf(i, count)) > kStandsOut ? [i] : []);
}

const kFew = 7;  // frames

/// Frames in which the strain is more than 3 % above that of the frame before and above what it was until then
/// (its median: after one slack frame it does not jump but returns), and rises far more than elsewhere.
export function suddenRises(strain) {
  const rises = strain.map((value, i) => i > 0 && Number.isFinite(strain[i - 1]) ? Math.abs(value - strain[i - 1]) : NaN);
  const until = i => median(strain.slice(0, i).filter(Number.isFinite).sort((a, b) => a - b));
  return rises.flatMap((rise, i) => rise > 0.03 && strain[i] - Math.max(strain[i - 1], until(i)) > 0.03 &&
    heightOf(rises, i) > kStandsOut ? [i] : []);
}
