// The flat pattern of a garment: each panel a shape; the one under the pointer lights up in 3D.

import {element} from "./data.js";
import {numberColor} from "./color.js";

const kSvg = "http://www.w3.org/2000/svg";

/// Boxes of panels {panel, low, size} in m, in the order of their left sides.
function boxesOf(faces, places, panels) {
  const boxes = new Map();
  for (let i = 0; i < faces.length; ++i) {
    const panel = panels[Math.floor(i / 3)];
    const box = boxes.get(panel) ?? {panel, low: [Infinity, Infinity], high: [-Infinity, -Infinity]};
    boxes.set(panel, box);
    for (const k of [0, 1]) {
      const place = places[2 * faces[i] + k];
      box.low[k] = Math.min(box.low[k], place);
      box.high[k] = Math.max(box.high[k], place);
    }
  }
  return [...boxes.values()].map(({panel, low, high}) => ({panel, low, size: [high[0] - low[0], high[1] - low[1]]}))
    .sort((a, b) => a.low[0] - b.low[0]);
}

/// Where boxes go in rows of at most a width: {places: [x, y] of each, from the upper left, y down, width, height}.
function inRows(boxes, most, gap) {
  let x = 0, y = 0, row = 0, width = 0;
  const places = boxes.map(({size}) => {
    if (x > 0 && x + size[0] > most) {
      x = 0;
      y += row + gap;
      row = 0;
    }
    const place = [x, y];
    x += size[0] + gap;
    row = Math.max(row, size[1]);
    width = Math.max(width, x - gap);
    return place;
  });
  return {places, width, height: y + row};
}

/// Panels in as many rows as make them largest in a box that is so much higher than wide. A pattern is often laid out
/// in one long row.
function inView(boxes) {
  const kTall = 1.2;
  const gap = 0.04 * Math.max(...boxes.flatMap(({size}) => size));
  const scale = ({width, height}) => Math.max(width, height / kTall);
  let most = -gap;
  return boxes.map(({size}) => inRows(boxes, (most += size[0] + gap) + 1e-9, gap)).reduce((best, one) => scale(one) < scale(best) ? one : best);
}

/// @param light  is told the panel under the pointer or with the focus, -1: none
export function patternView(faces, places, panels, light) {
  const paths = new Map();
  const boxes = boxesOf(faces, places, panels);
  const view = inView(boxes);
  const shifts = new Map(boxes.map(({panel, low, size}, i) => [panel, [view.places[i][0] - low[0], view.places[i][1] + low[1] + size[1]]]));
  // The outline of a panel: edges of one face alone.
  const edges = new Map();
  for (let f = 0; f < panels.length; ++f) {
    for (let k = 0; k < 3; ++k) {
      const a = faces[3 * f + k], b = faces[3 * f + (k + 1) % 3];
      const key = a < b ? a * 2 ** 26 + b : b * 2 ** 26 + a;
      edges.has(key) ? edges.set(key, null) : edges.set(key, [a, b, panels[f]]);
    }
  }
  const next = new Map();
  for (const edge of edges.values()) {
    if (edge) {
      next.set(edge[0], edge);
    }
  }
  while (next.size > 0) {
    const [start, first] = next.entries().next().value;
    const [right, down] = shifts.get(first[2]);
    let path = "", at = start;
    while (next.has(at)) {
      path += `${path ? "L" : "M"}${(places[2 * at] + right).toFixed(4)} ${(down - places[2 * at + 1]).toFixed(4)}`;
      const edge = next.get(at);
      next.delete(at);
      at = edge[1];
    }
    paths.set(first[2], (paths.get(first[2]) ?? "") + path + "Z");
  }
  const margin = 0.02 * Math.max(view.width, view.height);
  const svg = document.createElementNS(kSvg, "svg");
  svg.setAttribute("viewBox", [-margin, -margin, view.width + 2 * margin, view.height + 2 * margin].join(" "));
  svg.setAttribute("role", "group");
  svg.setAttribute("aria-label", "Panels of the pattern");
  const fill = one => [...svg.children].forEach(shape => shape.setAttribute("fill",
    Number(shape.dataset.panel) === one ? "#ffc740" : numberColor(Number(shape.dataset.panel))));
  for (const [panel, d] of [...paths].sort((a, b) => a[0] - b[0])) {
    const shape = document.createElementNS(kSvg, "path");
    shape.setAttribute("d", d);
    shape.setAttribute("fill-rule", "evenodd");
    shape.setAttribute("stroke", "#4a4d52");
    shape.setAttribute("stroke-width", margin / 6);
    shape.setAttribute("tabindex", "0");
    shape.setAttribute("role", "button");
    shape.setAttribute("aria-label", `Panel ${panel + 1}`);
    shape.dataset.panel = panel;
    for (const [event, one] of [["pointerenter", panel], ["pointerleave", -1], ["focus", panel], ["blur", -1]]) {
      shape.addEventListener(event, () => {
        fill(one);
        light(one);
      });
    }
    svg.append(shape);
  }
  fill(-1);
  const {size: largest} = boxes.reduce((best, one) => one.size[0] * one.size[1] > best.size[0] * best.size[1] ? one : best);
  const box = element("div", {}, element("p", {className: "quiet"},
    `${paths.size} panel${paths.size === 1 ? "" : "s"}, the largest ${largest.map(side => side.toFixed(2)).join(" by ")} m. Point at one, or reach it with Tab, to see its place.`));
  box.append(svg);
  return box;
}
