// What can be done without a mouse.

import {element} from "./data.js";
import {saveImage, saveVideo} from "./export_view.js";

const kKeys = [
  ["Space", "play, pause"], ["← →", "a frame back, on (Page keys: ten)"], ["Home End", "first, last frame"],
  ["R", "repeat"], ["Shift+arrows ↑ ↓", "turn the view"], ["+ -", "nearer, farther"], ["F", "fit what is shown"],
  ["1 … 9", "show, hide a layer"], ["C Shift+C", "look through the chosen camera, the next, the one before"],
  ["Esc", "leave the camera"], ["N Shift+N", "next finding, the one before"],
  ["B P", "side by side; the other of the two views"],
  ["I", "save an image"], ["V", "save a video"], ["L", "copy the address of this view"],
];

/// Whether what has the focus does something of its own with a key.
function takesKey(target, key) {
  const kind = target.tagName === "INPUT" ? target.type : target.getAttribute?.("role") === "button" ? "button"
    : target.tagName.toLowerCase();
  const arrows = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];
  switch (kind) {
    case "text": case "select": case "textarea": return key !== "Escape";
    case "range": return (target.id === "scrub" ? ["ArrowUp", "ArrowDown"] : arrows).includes(key);
    case "checkbox": return key === " ";
    case "button": return key === " " || key === "Enter";
    default: return false;
  }
}

export function onKey(app, event) {
  if (event.ctrlKey || event.metaKey || event.altKey || takesKey(event.target, event.key)) {
    return;
  }
  const turn = 0.12;
  const step = event.shiftKey ? null : {ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10}[event.key];
  const actions = {
    " ": () => app.play(), Home: () => app.go(0), End: () => app.go(app.timeline.frames.length - 1),
    r: () => app.loop(), b: () => app.split(), i: () => saveImage(app), v: () => saveVideo(app),
    l: () => app.copyLink(), "?": () => app.help(), f: () => app.fit(), "+": () => app.zoom(0.85), "-": () => app.zoom(1.18),
    c: () => app.nextCamera(1), C: () => app.nextCamera(-1), Escape: () => app.escape(),
    n: () => app.nextMark(1), N: () => app.nextMark(-1), p: () => app.activate(1 - app.active),
  };
  const turns = {ArrowLeft: [turn, 0], ArrowRight: [-turn, 0], ArrowUp: [0, turn], ArrowDown: [0, -turn]};
  if (step !== null && step !== undefined) {
    app.timeline.setPlaying(false);
    app.go(app.timeline.index + step);
  } else if (turns[event.key] && (event.shiftKey || event.key === "ArrowUp" || event.key === "ArrowDown")) {
    app.orbit.turn(-turns[event.key][0], turns[event.key][1]);
    app.lookThroughNothing();
  } else if (/^[1-9]$/.test(event.key) && app.now.layers[Number(event.key) - 1]) {
    app.toggle(Number(event.key) - 1);
  } else if (actions[event.key]) {
    actions[event.key]();
  } else {
    return;
  }
  event.preventDefault();
}

export function keyTable() {
  return element("table", {}, ...kKeys.map(([keys, words]) => element("tr", {},
    element("td", {}, ...keys.split(" ").flatMap(key => [element("kbd", {}, key), " "])), element("td", {}, words))));
}
