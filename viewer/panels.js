// What stands round the view: its layers, the legend of their colours, which two are beside each other.

import {byId, element, refill} from "./data.js";
import {labelColor, labelCount, labelName, scaleColor} from "./color.js";

export function showLayers(app) {
  const pane = app.panes[app.active];
  const rows = [element("h2", {}, "Layers")];
  const hasRates = app.now.layers.some(layer => layer.end !== undefined);
  app.now.layers.forEach((layer, i) => {
    const check = element("input", {type: "checkbox", id: `layer${i}`, checked: !pane.hidden.has(i),
      onchange: () => app.toggle(i)});
    const swatch = element("span", {className: "swatch"});
    swatch.style.background = `rgb(${layer.color.join(",")})`;
    const label = element("label", {htmlFor: `layer${i}`}, swatch, layer.info.name, " ",
      element("small", {}, layer.info.stage, hasRates ? ` ${Number(layer.info.fps.toPrecision(4))} fps` : ""));
    const choices = layer.colorings();
    const select = element("select", {ariaLabel: `Colour of ${layer.info.name}`,
      onchange: () => app.recolor(layer, select.value)},
      ...choices.map(([name, words]) => element("option", {value: name}, words)));
    select.value = layer.coloring;
    rows.push(element("div", {className: "layer"}, check, label, ...(choices.length > 1 ? [select] : [])));
  });
  if (app.now.layers.length === 0) {
    rows.push(element("p", {className: "quiet"}, "A capture holds images; meshes are made of them by atelier run."));
  }
  const {cameras} = app.now;
  if (cameras) {
    rows.push(element("h2", {}, "Capture"));
    rows.push(toggleRow(app, "cameras", cameras.showFrusta, on => {
      cameras.showFrusta = on;
      app.load();
    }));
    if (cameras.info.agreement) {
      rows.push(toggleRow(app, "keypoints in space", cameras.showSkeleton, on => {
        cameras.showSkeleton = on;
        app.load();
      }, "The cross at each is as wide as one standard deviation of its place"));
    }
  }
  rows.push(element("h2", {}, "Light"));
  const angle = element("input", {type: "range", min: "-180", max: "180", step: "5", ariaLabel: "Direction of the light",
    value: app.light === null ? "0" : String(Math.round(app.light * 180 / Math.PI)), oninput: () => {
      app.light = Number(angle.value) * Math.PI / 180;
      app.writeAddress();
      app.touch();
    }});
  rows.push(angle, element("button", {onclick: () => {
    app.light = null;
    app.writeAddress();
    app.touch();
  }}, "With the viewer"));
  if (app.scene.notes.length > 0) {
    rows.push(element("h2", {}, "Notes"), ...app.scene.notes.map(note => element("p", {className: "quiet"}, note)));
  }
  refill(byId("layers"), ...rows);
}

function toggleRow(app, words, on, change, title = "") {
  const id = "toggle-" + words.replaceAll(" ", "-");
  const check = element("input", {type: "checkbox", id, checked: on, onchange: () => {
    change(check.checked);
    app.writeAddress();
  }});
  return element("div", {className: "layer"}, check, element("label", {htmlFor: id, title}, words));
}

/// The colours of labels with their names.
export function labelSwatches() {
  return Array.from({length: labelCount}, (_, n) => {
    const swatch = element("span", {className: "swatch"});
    swatch.style.background = `rgb(${labelColor(n).join(",")})`;
    return element("span", {}, swatch, labelName(n));
  });
}

export function showLegend(app) {
  const legends = [];
  for (const pane of app.shownPanes) {
    const timeline = app.timelines[pane.timeline];
    timeline.layers.forEach((layer, i) => {
      const legend = layer.legend();
      if (legend && !pane.hidden.has(i) && !legends.some(one => one.title === legend.title)) {
        legends.push(legend);
      }
      if (layer.coloring === "labels" && !pane.hidden.has(i)) {
        legends.push({title: layer.info.name + ": labels", labels: true});
      }
    });
  }
  byId("legend").hidden = legends.length === 0;
  byId("legend").replaceChildren(...legends.flatMap(legend => {
    if (legend.labels) {
      return [element("div", {}, legend.title), element("div", {className: "toggles"}, ...labelSwatches())];
    }
    const bar = element("canvas", {width: 220, height: 1});
    const context = bar.getContext("2d");
    for (let x = 0; x < 220; ++x) {
      context.fillStyle = `rgb(${scaleColor(x / 219).join(",")})`;
      context.fillRect(x, 0, 1, 1);
    }
    return [element("div", {}, legend.title), bar,
      element("div", {className: "ends"}, element("span", {}, legend.low), element("span", {}, legend.high))];
  }));
}

export function showPanes(app) {
  byId("split").setAttribute("aria-pressed", String(app.isSplit));
  if (!app.isSplit) {
    byId("panes").replaceChildren();
    return;
  }
  const selects = app.panes.map((pane, i) => {
    const select = element("select", {ariaLabel: i === 0 ? "Shown on the left" : "Shown on the right",
      className: i === app.active ? "active" : "", onchange: () => {
        app.activate(i);
        app.putTimeline(Number(select.value));
      }}, ...app.timelines.map((timeline, t) => element("option", {value: String(t)}, timeline.info.name)));
    select.value = String(pane.timeline);
    select.style.left = i === 0 ? "12px" : "calc(50% + 12px)";
    return select;
  });
  refill(byId("panes"), element("div", {className: "divider"}), ...selects);
}
