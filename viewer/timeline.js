// The timeline: frames under their own numbers, each at its time, since takes have rates of their own; marks of
// findings; a figure of each frame as a curve.

import {element} from "./data.js";

const labelOf = one => [one.stage, one.name].filter(Boolean).join(": ");
const valuesOf = one => typeof one.values === "function" ? one.values() : one.values;

/// Of numbers in order.
export function median(sorted) {
  const half = sorted.length >> 1;
  return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
}

/// How far a value is above the median of the others, in median absolute deviations (scaled to the
/// standard deviation of a normal distribution) that are taken for a quarter of the median at least;
/// Infinity: the others are all the same. -1: of fewer than three values.
/// @param isLeftOut  of an index: it says nothing of how the others are
export function heightOf(values, index, isLeftOut = () => false) {
  const others = values.filter((value, i) => i !== index && !isLeftOut(i) && Number.isFinite(value)).sort((a, b) => a - b);
  if (others.length === 0 || values.filter(Number.isFinite).length < 3) {
    return -1;
  }
  const middle = median(others);
  const spread = median(others.map(value => Math.abs(value - middle)).sort((a, b) => a - b));
  return (values[index] - middle) / (1.4826 * Math.max(spread, Math.abs(middle) / 4)) || 0;
}

/// Of a frame, the frames beside it, which what is wrong with it raises, too: but for the first and the
/// last, which are compared to the nearer of two.
export function besideOf(index, count) {
  return i => Math.abs(i - index) === 1 && i > 0 && i < count - 1;
}

/// How high the largest of the values stands above the others (heightOf); where these are all the same, in
/// standard deviations of all. -1: of fewer than three values.
export function peakHeight(values) {
  const known = values.filter(Number.isFinite);
  const peak = values.indexOf(Math.max(...known));
  const height = heightOf(values, peak, besideOf(peak, values.length));
  if (height !== Infinity) {
    return height;
  }
  const mean = known.reduce((sum, value) => sum + value, 0) / known.length;
  const deviation = Math.sqrt(known.reduce((sum, value) => sum + (value - mean) ** 2, 0) / known.length);
  return (values[peak] - mean) / deviation;
}

/// Index of the frame whose number is nearest.
export function nearestFrame(frames, frameId) {
  let best = 0;
  frames.forEach((id, i) => {
    if (Math.abs(id - frameId) < Math.abs(frames[best] - frameId)) {
      best = i;
    }
  });
  return best;
}

/// When each frame begins, in seconds, and at last when the last one ends.
export function timesOf({frames, takes}) {
  const times = [0];
  takes.forEach(({first, fps}, i) => {
    const begin = times[first];
    for (let index = first; index < (takes[i + 1]?.first ?? frames.length); ++index) {
      times.push(begin + (index + 1 - first) / fps);
    }
  });
  return times;
}

/// The frame that is due at a time, in seconds; as many as there are frames: none, it is over.
export function dueAt(times, seconds) {
  const kRound = 1e-7;  // s
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    times[middle] <= seconds + kRound ? low = middle : high = middle - 1;
  }
  return low;
}

/// The take of a frame.
export function takeAt({takes}, index) {
  return takes.findLast(({first}) => first <= index);
}

const wordsOf = ({name, fps}) => `${name ? name + ", " : ""}${Number(fps.toPrecision(4))} fps`;

export class Timeline {
  /// @param changed  is told when another figure is chosen
  constructor(parts, go, changed) {
    this.parts = parts;  // {scrub, frame, time, play, loop, chart, marks, takes, series}
    this.go = go;
    this.frames = [0];
    this.takes = [{name: "", fps: 1, first: 0}];
    this.times = [0, 1];
    this.index = 0;
    this.playing = false;
    this.looping = true;
    parts.scrub.addEventListener("input", () => go(Number(parts.scrub.value)));
    parts.frame.addEventListener("change", () => {
      const wanted = Number(parts.frame.value);
      go(this.nearest(Number.isFinite(wanted) ? wanted : this.frames[this.index]));
    });
    parts.chart.addEventListener("pointerdown", event => {
      const share = (event.offsetX - 8) / Math.max(parts.chart.clientWidth - 16, 1);
      go(Math.round(Math.min(Math.max(share, 0), 1) * (this.frames.length - 1)));
    });
    parts.series.addEventListener("change", () => {
      this.chosen = labelOf(this.seriesList[Number(parts.series.value)]);
      this.drawChart();
      changed();
    });
  }

  nearest(frameId) {
    return nearestFrame(this.frames, frameId);
  }

  /// Frames a second of the fastest take.
  get fps() {
    return Math.max(...this.takes.map(take => take.fps));
  }

  get seconds() {
    return this.times.at(-1);
  }

  set({frames, takes, marks, series}, jump) {
    this.frames = frames;
    this.takes = takes;
    this.times = timesOf({frames, takes});
    this.seriesList = series;
    this.showTakes();
    this.parts.scrub.closest("footer").hidden = frames.length < 2 && marks.every(mark => mark.frame === undefined);
    this.parts.scrub.max = frames.length - 1;
    this.parts.marks.replaceChildren();
    const last = Math.max(frames.length - 1, 1);
    for (const mark of marks) {
      if (mark.frame !== undefined) {
        const button = element("button", {className: mark.severity, title: mark.text,
          ariaLabel: `Frame ${mark.frame}: ${mark.text}`, onclick: () => jump(mark)});
        button.style.left = `${100 * this.nearest(mark.frame) / last}%`;
        this.parts.marks.append(button);
      }
    }
    this.parts.series.replaceChildren(...series.map((one, i) =>
      element("option", {value: String(i)}, labelOf(one))));
    this.parts.series.closest("label").hidden = series.length === 0;
    this.parts.chart.hidden = series.length === 0;
    this.chooseSeries();
  }

  /// Where another take begins, which is gone to by a click.
  showTakes() {
    const {frames, takes, parts} = this;
    const last = Math.max(frames.length - 1, 1);
    parts.takes.hidden = takes.length < 2;
    parts.takes.replaceChildren(...(takes.length < 2 ? [] : takes).map((take, i) => {
      const words = wordsOf(take), {first} = take;
      const end = Math.min(takes[i + 1]?.first ?? last, last);
      const button = element("button", {title: `${words}: from frame ${frames[first]} on`, onclick: () => this.go(first)}, words);
      button.style.left = `${100 * first / last}%`;
      button.style.width = `${100 * (end - first) / last}%`;
      return button;
    }));
  }

  /// Shows the figure that was chosen, or else the one whose peak stands out most, but for those that
  /// another one sums up.
  chooseSeries() {
    const list = this.seriesList;
    let best = list.findIndex(one => labelOf(one) === this.chosen);
    if (best < 0 && list.length > 0) {
      const heights = list.map(one => one.isDetail ? -2 : peakHeight(valuesOf(one)));
      best = heights.indexOf(Math.max(...heights));
    }
    this.parts.series.value = String(Math.max(best, 0));
    this.drawChart();
  }

  show(index) {
    this.index = index;
    const now = performance.now();
    if (this.playing && now - (this.shown ?? 0) < 200) {
      return;  // numbers that nobody could read cost as much as the meshes where the CPU draws
    }
    this.shown = now;
    this.parts.scrub.value = index;
    this.parts.frame.value = String(this.frames[index]);
    const {times, takes} = this;
    this.parts.time.textContent = `${times[index].toFixed(2)} s of ${times.at(-2).toFixed(2)}` +
      (takes.length > 1 ? `, ${wordsOf(takeAt(this, index))}` : "");
    this.drawChart();
  }

  setPlaying(playing) {
    const ends = this.playing && !playing;
    this.playing = playing && this.frames.length > 1;
    this.parts.play.textContent = this.playing ? "Pause" : "Play";
    this.started = null;
    if (ends) {
      this.show(this.index);
    }
  }

  /// The frame that is due at a time (ms) while playing: frames are left out, never slowed down.
  due(now) {
    if (this.started === null) {
      this.started = now - 1000 * this.times[this.index];
    }
    let index = dueAt(this.times, (now - this.started) / 1000);
    if (index >= this.frames.length) {
      if (!this.looping) {
        this.setPlaying(false);
        return this.frames.length - 1;
      }
      this.started = now;
      index = 0;
    }
    return index;
  }

  drawChart() {
    const {chart, series} = this.parts;
    const one = this.seriesList?.[Number(series.value)];
    series.title = one ? labelOf(one) : "";
    const width = chart.clientWidth, height = chart.clientHeight;
    if (!one || width === 0) {
      return;
    }
    const ratio = devicePixelRatio || 1;
    if (chart.width !== Math.round(width * ratio)) {
      chart.width = Math.round(width * ratio);
      chart.height = Math.round(height * ratio);
    }
    const context = chart.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const values = valuesOf(one);
    if (!values.some(Number.isFinite)) {
      context.fillStyle = "#6b6f76";
      context.font = "10px system-ui, sans-serif";
      context.fillText("being computed of the frames", 8, height / 2);
      return;
    }
    const frames = one.frames ?? this.frames;
    let high = 0, low = 0;
    for (const value of values) {
      if (value !== null && Number.isFinite(value)) {
        high = Math.max(high, value);
        low = Math.min(low, value);
      }
    }
    const last = Math.max(this.frames.length - 1, 1);
    const first = this.frames[0], span = Math.max(this.frames.at(-1) - first, 1);
    const evenly = span === last;
    const x = id => 8 + (width - 16) * (evenly ? (id - first) / span : this.nearest(id) / last);
    const y = value => height - 13 - (height - 26) * (value - low) / (high - low || 1);
    context.strokeStyle = "#cfcbc3";
    for (const {first} of this.takes.slice(1)) {
      context.beginPath();
      context.moveTo(x(this.frames[first]), 0);
      context.lineTo(x(this.frames[first]), height);
      context.stroke();
    }
    context.strokeStyle = "#2f6f73";
    context.lineWidth = 1.3;
    context.beginPath();
    let drawing = false;
    values.forEach((value, i) => {
      if (value === null || !Number.isFinite(value)) {
        drawing = false;
        return;
      }
      drawing ? context.lineTo(x(frames[i]), y(value)) : context.moveTo(x(frames[i]), y(value));
      drawing = true;
    });
    context.stroke();
    context.fillStyle = "#6b6f76";
    context.font = "10px system-ui, sans-serif";
    context.textAlign = "left";
    context.fillText(`${Number(high.toPrecision(3))}${one.unit ? " " + one.unit : ""}`, 12, 9);
    const at = frames.indexOf(this.frames[this.index]);
    const now = at < 0 ? null : values[at];
    context.strokeStyle = "#23262b";
    context.beginPath();
    context.moveTo(x(this.frames[this.index]), 0);
    context.lineTo(x(this.frames[this.index]), height);
    context.stroke();
    if (now !== null && now !== undefined && Number.isFinite(now)) {
      const text = String(Number(now.toPrecision(3)));
      const place = x(this.frames[this.index]);
      context.fillStyle = "#23262b";
      context.textAlign = place > width - 70 ? "right" : "left";
      context.fillText(text, place + (place > width - 70 ? -5 : 5), height - 3);
    }
  }
}
