// The address's last part: what is seen, for whoever opens it again.

/// Writes what is seen, a while from now: it costs as much as a picture.
export function writeAddress(app, now = false) {
  clearTimeout(app.writing);
  const write = () => {
    const pane = one => [one.timeline, [...one.hidden].filter(i => i >= 0).sort((a, b) => a - b).join("."), one.through].join("/");
    const words = new URLSearchParams({
      frame: String(app.frameId), view: app.orbit.text(), panes: app.panes.map(pane).join(","),
      active: String(app.active), split: app.isSplit ? "1" : "0", side: app.side.tab ?? "",
      color: app.now.layers.map(layer => layer.coloring).join(","),
      ...(app.light === null ? {} : {light: app.light.toFixed(2)}),
    });
    app.written = words.toString().replaceAll("%2C", ",").replaceAll("%2F", "/");
    history.replaceState(null, "", "#" + app.written);
  };
  now ? write() : app.writing = setTimeout(write, 250);
}

export function readAddress(app) {
  const words = new URLSearchParams(location.hash.slice(1));
  app.hasAddress = words.has("view");
  if (!app.hasAddress) {
    return;
  }
  app.orbit.read(words.get("view"));
  (words.get("panes") ?? "").split(",").slice(0, 2).forEach((text, i) => {
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
  (words.get("color") ?? "").split(",").forEach((coloring, i) => {
    const layer = app.now.layers[i];
    if (layer?.colorings().some(([name]) => name === coloring)) {
      layer.coloring = coloring;
    }
  });
  const {cameras, info} = app.now;
  if (cameras && cameras.cameras[app.panes[app.active].through]) {
    cameras.selected = app.panes[app.active].through;
  }
  app.wantedIndex = Math.max(info.frames.indexOf(Number(words.get("frame"))), 0);
}
