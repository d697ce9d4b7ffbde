// The flat pattern of a garment: each panel a shape; the one under the pointer lights up in 3D.

import {element} from "./data.js";
import {numberColor} from "./color.js";

const kSvg = "http://www.w3.org/2000/svg";

/// @param light  is told the panel under the pointer or with the focus, -1: none
export function patternView(faces, places, panels, light) {
  const paths = new Map();
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (let i = 0; i < places.length; ++i) {
    low[i % 2] = Math.min(low[i % 2], places[i]);
    high[i % 2] = Math.max(high[i % 2], places[i]);
  }
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
    let path = "", at = start;
    while (next.has(at)) {
      path += `${path ? "L" : "M"}${places[2 * at].toFixed(4)} ${(low[1] + high[1] - places[2 * at + 1]).toFixed(4)}`;
      const edge = next.get(at);
      next.delete(at);
      at = edge[1];
    }
    paths.set(first[2], (paths.get(first[2]) ?? "") + path + "Z");
  }
  const margin = 0.02 * Math.max(high[0] - low[0], high[1] - low[1]);
  const svg = document.createElementNS(kSvg, "svg");
  svg.setAttribute("viewBox", [low[0] - margin, low[1] - margin, high[0] - low[0] + 2 * margin, high[1] - low[1] + 2 * margin].join(" "));
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
  const box = element("div", {}, element("p", {className: "quiet"},
    `${paths.size} panel${paths.size === 1 ? "" : "s"}, ${(high[0] - low[0]).toFixed(2)} by ${(high[1] - low[1]).toFixed(2)} m laid out. Point at one, or reach it with Tab, to see its place.`));
  box.append(svg);
  return box;
}
