// The address's last part: what is seen, for whoever opens it again.

import {nearestFrame} from "./timeline.js";

/// What is shown of cameras: over the image, and in space.
function overlaysOf({overlays, showFrusta, showSkeleton}) {
  return Object.entries({...overlays, cameras: showFrusta, points: showSkeleton}).filter(([, on]) => on).map(([name]) => name);
}

/// Of each of the two views' captures the words that hold what is shown of its cameras: of the active view's,
/// and of another one beside it.
function cameraWords(app) {
  const beside = app.timelines[app.panes[1 - app.active].timeline];
  return [{cameras: app.now.cameras, camera: "camera", over: "over"},
    {cameras: app.isSplit && beside !== app.now ? beside.cameras : null, camera: "camera-beside", over: "over-beside"},
  ].filter(({cameras}) => cameras);
}

/// Writes what is seen, a while from now: it costs as much as a picture.
export function writeAddress(app, now = false) {
  clearTimeout(app.writing);
  const write = () => {
    const pane = one => [one.timeline, [...one.hidden].filter(i => i >= 0).sort((a, b) => a - b).join("."), one.through].join("/");
    const colors = one => one.layers.map(layer => layer.coloring).join(",");
    const ofCameras = cameraWords(app);
    const other = app.timelines[app.panes[1 - app.active].timeline];
    const words = new URLSearchParams({
      frame: String(app.frameId), view: app.orbit.text(), panes: app.panes.map(pane).join(","),
      active: String(app.active), split: app.isSplit ? "1" : "0", side: app.side.tab ?? "", color: colors(app.now),
      ...(app.isSplit && other !== app.now ? {beside: colors(other)} : {}),
      ...(app.light === null ? {} : {light: app.light.toFixed(2)}),
      ...(app.timeline.chosen ? {figure: app.timeline.chosen} : {}),
      ...(app.timeline.looping ? {} : {loop: "0"}),
      ...Object.fromEntries(ofCameras.flatMap(({cameras, camera, over}) =>
        [[camera, String(cameras.selected)], [over, overlaysOf(cameras).join(",")]])),
      ...(ofCameras.length > 0 ? {opacity: app.opacity.toFixed(2)} : {}),
    });
    app.written = words.toString().replaceAll("%2C", ",").replaceAll("%2F", "/");
    history.replaceState(null, "", "#" + app.written);
  };
  now ? write() : app.writing = setTimeout(write, 250);
}

/// Of an address without a view, as one that is typed, the frame alone counts: that of this number in what is
/// shown first, or in the first that has it, or else the nearest.
export function readAddress(app) {
  const words = new URLSearchParams(location.hash.slice(1));
  const number = words.get("frame") ? Number(words.get("frame")) : NaN;
  const frameOf = ({frames}) => Number.isFinite(number) ? nearestFrame(frames, number) : app.timeline.index;
  app.hasAddress = words.has("view");
  if (!app.hasAddress) {
    const owner = [app.now, ...app.timelines].find(({info}) => info.frames.includes(number));
    if (owner && owner !== app.now && !app.isSplit) {
      app.panes[app.active] = app.pane(owner.number);
    }
    app.wantedIndex = frameOf(app.now.info);
    return;
  }
  app.orbit.read(words.get("view"));
  (words.get("panes")?.split(",") ?? []).slice(0, 2).forEach((text, i) => {
    const [timeline, hidden, through] = text.split("/");
    const number = Number(timeline);
    if (app.timelines[number]) {
      app.panes[i] = {timeline: number, hidden: new Set((hidden ?? "").split(".").filter(Boolean).map(Number)),
        through: Number.isInteger(Number(through)) ? Number(through) : -1};
    }
  });
  app.active = words.get("active") === "1" ? 1 : 0;
  app.isSplit = words.get("split") === "1";
  app.side.tab = words.get("side") || null;
  app.light = words.has("light") && Number.isFinite(Number(words.get("light"))) ? Number(words.get("light")) : null;
  const other = app.timelines[app.panes[1 - app.active].timeline];
  for (const [name, {layers}] of [["beside", other], ["color", app.now]]) {
    (words.get(name) ?? "").split(",").forEach((coloring, i) => {
      if (layers[i]?.mayHave(coloring)) {
        layers[i].coloring = coloring;
      }
    });
  }
  app.timeline.chosen = words.get("figure") ?? app.timeline.chosen;
  if ((words.get("loop") === "0") === app.timeline.looping) {
    app.loop();
  }
  for (const one of cameraWords(app)) {
    readCameras(app, one, words);
  }
  const opacity = Number(words.get("opacity") ?? "");
  app.opacity = words.has("opacity") && opacity >= 0 && opacity <= 1 ? opacity : app.opacity;
  app.wantedIndex = frameOf(app.now.info);
}

function readCameras(app, {cameras, ...names}, words) {
  const number = Number(words.get(names.camera) ?? -1);
  cameras.selected = cameras.cameras[number] ? number : -1;
  for (const pane of app.panes) {
    const seen = app.timelines[pane.timeline].cameras;
    if (seen?.cameras[pane.through]) {
      seen.selected = pane.through;
    }
  }
  cameras.drawFrusta();
  if (words.has(names.over)) {
    const over = words.get(names.over).split(",");
    for (const name of Object.keys(cameras.overlays)) {
      cameras.overlays[name] = over.includes(name);
    }
    cameras.showFrusta = over.includes("cameras");
    cameras.showSkeleton = over.includes("points");
  }
}
