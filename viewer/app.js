// The page: what is seen is state, and the address's last part restores it.

import {byId, element, refill, say} from "./data.js";
import {Cameras, residualSeries} from "./cameras.js";
import {boundsOf, feetOf, frontOf, middleOf} from "./framing.js";
import {keyTable, onKey} from "./keyboard.js";
import {Layer} from "./layer.js";
import {Orbit} from "./orbit.js";
import {readAddress, writeAddress} from "./address.js";
import {saveImage, saveVideo} from "./export_view.js";
import {Scene3d} from "./scene3d.js";
import {showLayers, showLegend, showPanes} from "./panels.js";
import {inOrder, SidePanel, warningsOf, withoutHead} from "./side_panel.js";
import {survey} from "./survey.js";
import {dueAt, takeAt, Timeline, timesOf} from "./timeline.js";

const root = document.documentElement;
root.dataset.state = "loading";

class App {
  constructor(scene) {
    this.scene = scene;
    this.orbit = new Orbit();
    this.opacity = 0.6;  // of what is drawn over a camera's image
    this.light = null;  // angle of the key light; null: it goes with the viewer
    this.step = 1;      // frames from one that was shown to the next, while it plays
    this.asked = 0;     // counts what was asked for, so that late answers are dropped
    this.askedAt = -Infinity;  // ms, when a frame was asked for last
    this.dirty = true;
    try {
      this.view = new Scene3d(byId("view"));
    } catch (error) {
      say("This browser offers no WebGL, which the view needs. (" + error.message + ")", true);
      root.dataset.state = "no-webgl";
      return;
    }
    this.timelines = scene.timelines.map((info, i) => this.build(info, i));
    this.timeline = new Timeline({scrub: byId("scrub"), frame: byId("frame"), time: byId("time"), play: byId("play"),
      loop: byId("loop"), chart: byId("chart"), marks: byId("marks"), takes: byId("takes"), series: byId("series")}, index => this.go(index),
      () => this.writeAddress());
    this.panes = [this.pane(0), this.pane(Math.min(scene.beside || 0, this.timelines.length - 1))];
    this.active = 0;
    this.isSplit = scene.beside > 0;
    this.side = new SidePanel(this);
    this.listen();
    readAddress(this);
    document.title = scene.title + " · Atelier";
    byId("title").textContent = scene.title;
    byId("title").title = scene.title;
    this.setTimeline();
    this.start();
  }

  build(info, number) {
    const counts = {};
    const indices = new Map(info.frames.map((frame, i) => [frame, i]));
    const layers = info.layers.map(one => {
      counts[one.role] = (counts[one.role] ?? -1) + 1;
      const layer = new Layer(one, number, counts[one.role], frame => takeAt(info, indices.get(frame)));
      if (one.texture) {
        layer.coloring = "texture";
      } else if (one.role === "scan") {
        layer.coloring = "colors";
      }
      this.view.add(layer);
      return layer;
    });
    for (const mark of info.marks) {
      mark.text = withoutHead(mark.text);
    }
    const timeline = {info, number, layers, cameras: null, times: timesOf(info)};
    if (info.capture) {
      timeline.cameras = new Cameras(info.capture, this.view, number, () => this.touch());
      timeline.cameras.showFrusta = timeline.cameras.showSkeleton = layers.length === 0;
    }
    return timeline;
  }

  pane(timeline) {
    return {timeline, hidden: new Set(this.timelines[timeline].layers.map((l, i) => l.info.shown ? -1 : i)), through: -1};
  }

  get now() {
    return this.timelines[this.panes[this.active].timeline];
  }

  get shownPanes() {
    return this.isSplit ? this.panes : [this.panes[this.active]];
  }

  get frameId() {
    return this.timeline.frames[this.timeline.index];
  }

  /// The frame of another timeline at the same moment: of the same number where frames are the
  /// same, else by the time since the first.
  frameOf(timeline) {
    if (this.hasThisFrame(timeline)) {
      return this.frameId;
    }
    const {frames} = timeline.info;
    return frames[Math.min(dueAt(timeline.times, this.timeline.times[this.timeline.index]), frames.length - 1)];
  }

  hasThisFrame(timeline) {
    const index = timeline.info.frames.indexOf(this.frameId);
    return timeline === this.now ||
      (index >= 0 && takeAt(timeline.info, index).fps === takeAt(this.timeline, this.timeline.index).fps);
  }

  // What is shown.

  async start() {
    try {
      await this.load();
      if (!this.hasAddress) {
        this.fit();
        this.orbit.azimuth = frontOf(this.now.layers) ?? this.orbit.azimuth;
      }
      this.now.seen = true;
      this.draw();
      root.dataset.state = "ready";
      root.dataset.firstPicture = Math.round(performance.now());
    } catch (error) {
      say(error.message, true);
      root.dataset.state = "failed";
    }
    const loop = now => {
      this.tick(now);
      requestAnimationFrame(loop);
    };
    requestAnimationFrame(loop);
    this.loadRest();
  }

  tick(now) {
    if (this.timeline.playing && !this.loading) {
      const index = this.timeline.due(now);
      if (index !== this.timeline.index) {
        this.step = Math.max(index - this.timeline.index, 1);
        this.go(index, true);
      }
    }
    if (this.dirty || this.view.width !== byId("view").clientWidth || this.view.height !== byId("view").clientHeight) {
      this.draw();
    } else if (this.view.software && !this.timeline.playing && now - this.drawnAt > 250) {
      this.draw(true);
    }
  }

  /// Loads the frame for all that is seen.
  async load() {
    const asked = ++this.asked;
    const isStill = () => asked === this.asked;
    this.loading = true;
    try {
      const shown = new Map();
      for (const pane of this.shownPanes) {
        const timeline = this.timelines[pane.timeline];
        for (const layer of timeline.layers) {
          if (!pane.hidden.has(timeline.layers.indexOf(layer))) {
            shown.set(layer, this.frameOf(timeline));
          }
        }
      }
      const camera = this.cameraWork(isStill);
      await Promise.all([...shown].map(([layer, frame]) => layer.show(frame, isStill)));
      if (!isStill()) {
        return;
      }
      if ([...shown.keys()].filter(layer => layer.takeNews()).length > 0) {
        showLayers(this);
        showLegend(this);
      }
      const problems = [...shown.keys()].map(layer => layer.problem).filter(Boolean);
      this.problem = problems.join("; ");
      if (this.problem) {
        say(this.problem, true);
      } else if (byId("message").classList.contains("bad")) {
        say("");
      }
      for (const [layer, frame] of this.timeline.playing ? shown : []) {
        layer.prefetch(frame, this.step);
      }
      await camera;
    } finally {
      if (isStill()) {
        this.loading = false;
      }
    }
    if (this.timeline.playing) {
      this.draw();  // not at the next tick: what is shown would be late by one
    } else {
      this.touch();
    }
  }

  async cameraWork(isStill) {
    for (const timeline of new Set(this.shownPanes.map(pane => this.timelines[pane.timeline]))) {
      const {cameras} = timeline;
      const frame = this.frameOf(timeline);
      if (cameras?.showSkeleton) {
        cameras.drawSkeleton(frame);
      }
      if (cameras?.selected >= 0) {
        const note = await cameras.showImage(frame, isStill);
        if (isStill() && timeline === this.now) {
          this.side.tellOfImage(note);
        }
      }
      if (cameras?.showFrusta && !this.timeline.playing) {
        cameras.showThumbs(frame, isStill);
      }
    }
  }

  /// What may come after the first picture: how well the cameras agree, and findings of that.
  async loadRest() {
    for (const {cameras, info} of this.timelines) {
      const agreement = await cameras?.loadAgreement().catch(error => say(error.message, true));
      if (agreement) {
        for (const {severity, text, place} of agreement.findings ?? []) {
          const camera = cameras.cameras.find(one => one.id === place)?.id;
          info.marks.push({severity, text: withoutHead(text), stage: "", ...(camera ? {camera} : {})});
        }
        info.series.push(...residualSeries(cameras));
      }
    }
    this.setFindings();
    if (this.side.tab === "cameras") {
      this.side.show();
    }
    this.load();
    survey(this);
  }

  touch() {
    this.dirty = true;
  }

  draw(fine = false) {
    this.dirty = false;
    this.drawnAt = fine ? Infinity : performance.now();
    const cameraOf = pane => this.timelines[pane.timeline].cameras?.cameras[pane.through];
    const leading = cameraOf(this.panes[this.active]) ?? this.shownPanes.map(cameraOf).find(Boolean);
    const panes = this.shownPanes.map((pane, i) => {
      const timeline = this.timelines[pane.timeline];
      const own = cameraOf(pane);
      const camera = own ?? leading;  // a view beside it goes with it
      return {
        timeline: pane.timeline,
        x: this.isSplit ? i / 2 : 0,
        width: this.isSplit ? 0.5 : 1,
        through: camera ? {camera, texture: own ? timeline.cameras.texture : null} : null,
        opacity: own ? this.opacity : 1,
        feet: feetOf(timeline.layers.filter((_, k) => !pane.hidden.has(k))),
        shows: layer => layer.timeline === pane.timeline && !pane.hidden.has(timeline.layers.indexOf(layer)) &&
          layer.faces !== undefined,
      };
    });
    this.drawnPanes = panes;
    this.view.draw(panes, this.orbit, this.light, fine);
    root.dataset.frame = this.frameId;
    root.dataset.drawn = Number(root.dataset.drawn ?? 0) + 1;
  }

  go(index, playing = false) {
    const wanted = Math.min(Math.max(index, 0), this.timeline.frames.length - 1);
    this.askedAt = performance.now();
    this.timeline.show(wanted);
    if (!playing) {
      this.timeline.started = null;
      this.writeAddress();
    }
    this.side.syncVideo();
    return this.load().catch(error => {
      say(error.message, true);
      this.loading = false;
    });
  }

  /// All that is shown fills the view, or each of the two.
  fit() {
    const shown = this.shownPanes.flatMap(({timeline, hidden}) =>
      this.timelines[timeline].layers.filter((_, i) => !hidden.has(i)));
    const bounds = boundsOf(shown, this.shownPanes.map(({timeline}) => this.timelines[timeline].cameras));
    if (bounds) {
      const {clientWidth: width, clientHeight: height} = byId("view");
      this.orbit.frame(bounds.low, bounds.high, width / this.shownPanes.length / Math.max(height, 1));
      this.orbit.distance *= bounds.ofCameras ? 0.6 : 1;  // cameras stand round what matters
    }
    this.touch();
  }

  writeAddress(now) {
    writeAddress(this, now);
  }

  // What stands around the view.

  setTimeline() {
    const {info} = this.now;
    this.showTabs();
    this.timeline.set({frames: info.frames, takes: info.takes, marks: info.marks, series: this.seriesOf(this.now)},
      mark => this.jump(mark));
    this.timeline.show(Math.min(this.wantedIndex ?? 0, info.frames.length - 1));
    this.wantedIndex = null;
    showLayers(this);
    this.side.show();
    showPanes(this);
    showLegend(this);
  }

  /// What can be shown, each with the number of its warnings and errors.
  showTabs() {
    refill(byId("tabs"), ...this.timelines.map((timeline, i) => {
      const {count, worst} = warningsOf(timeline);
      return element("button", {role: "tab", id: `timeline${i}`, className: worst,
        title: count > 0 ? `Warnings and errors: ${count}` : "", ariaSelected: String(timeline === this.now), onclick: () => this.choose(i)},
        timeline.info.name + (count > 0 ? ` (${count})` : ""));
    }));
  }

  /// Findings and figures that have come while something is seen.
  setFindings() {
    const {info} = this.now;
    this.showTabs();
    this.timeline.set({frames: info.frames, takes: info.takes, marks: info.marks, series: this.seriesOf(this.now)},
      mark => this.jump(mark));
    this.timeline.show(this.timeline.index);
    this.side.showFindings();
  }

  /// Figures of files, and those that the page makes of frames it has seen.
  seriesOf({info, layers}) {
    return [...layers.flatMap(layer => layer.series()), ...info.series];
  }

  /// Of two views, the one that layers, tabs and frames are of.
  activate(number) {
    if (!this.isSplit || number === this.active) {
      return;
    }
    const frame = this.frameOf(this.timelines[this.panes[number].timeline]);
    this.active = number;
    this.wantedIndex = Math.max(this.now.info.frames.indexOf(frame), 0);
    this.timeline.started = null;
    this.setTimeline();
    this.writeAddress();
    this.load().catch(error => say(error.message, true));
    survey(this);
  }

  /// Goes to the view that shows a timeline, or shows it in the active one.
  async choose(number) {
    if (this.isSplit && this.panes[1 - this.active].timeline === number) {
      this.activate(1 - this.active);
    } else {
      await this.putTimeline(number);
    }
  }

  /// Shows a timeline in the active view.
  async putTimeline(number) {
    if (this.panes[this.active].timeline === number) {
      return;
    }
    const next = this.timelines[number];
    this.now.index = this.timeline.index;
    this.wantedIndex = this.hasThisFrame(next) ? next.info.frames.indexOf(this.frameId) : next.index ?? 0;
    this.panes[this.active] = this.pane(number);
    this.timeline.setPlaying(false);
    this.setTimeline();
    await this.go(this.timeline.index);
    if (!this.now.seen) {
      this.fit();
    }
    this.now.seen = true;
    survey(this);
  }

  /// Shows where a finding is: its camera, its frame, the layer in its colour, from the side where it is.
  async jump(mark) {
    this.mark = mark;
    if (mark.camera !== undefined && this.now.cameras) {
      this.select(this.now.cameras.cameras.findIndex(camera => camera.id === mark.camera), true);
    }
    if (mark.frame !== undefined) {
      this.timeline.setPlaying(false);
      this.go(this.timeline.nearest(mark.frame));
    }
    say(mark.text);
    const layer = this.now.layers.findIndex(({info}) => info.name === mark.layer && info.stage === mark.stage);
    if (layer >= 0) {
      this.panes[this.active].hidden.delete(layer);
      await this.recolor(this.now.layers[layer], mark.coloring);
      showLayers(this);
      const {places} = this.now.layers[layer];
      this.orbit.face([0, 1, 2].map(k => places[3 * mark.vertex + k]), middleOf(places));
      this.touch();
    }
  }

  toggle(i) {
    const {hidden} = this.panes[this.active];
    hidden.has(i) ? hidden.delete(i) : hidden.add(i);
    const check = byId(`layer${i}`);
    if (check) {
      check.checked = !hidden.has(i);
    }
    showLegend(this);
    this.writeAddress();
    this.load().catch(error => say(error.message, true));
  }

  recolor(layer, coloring) {
    layer.coloring = coloring;
    showLegend(this);
    this.writeAddress();
    return this.load().catch(error => say(error.message, true));
  }

  select(camera, through = false) {
    const {cameras} = this.now;
    if (!cameras || camera < 0) {
      return;
    }
    cameras.selected = camera;
    cameras.drawFrusta();
    this.side.tab = "cameras";
    if (through || this.panes[this.active].through >= 0) {
      this.setThrough(camera);
    }
    this.side.show();
    this.writeAddress();
    this.load().catch(error => say(error.message, true));
  }

  /// A view beside it looks through its own camera of the same name, if it has one.
  setThrough(camera) {
    const id = this.now.cameras?.cameras[camera]?.id;
    const other = this.panes[1 - this.active];
    const {cameras} = this.timelines[other.timeline];
    this.panes[this.active].through = camera;
    other.through = cameras?.cameras.findIndex(one => one.id === id) ?? -1;
    if (other.through >= 0) {
      cameras.selected = other.through;
    }
  }

  lookThrough(camera) {
    this.setThrough(camera);
    this.side.show();
    this.writeAddress();
    this.load();
  }

  // Keys, buttons.

  listen() {
    this.orbit.listen(byId("view"), () => {
      this.panes.forEach(pane => { pane.through = -1; });
      this.writeAddress();
      this.touch();
    });
    byId("view").addEventListener("click", event => this.pick(event));
    byId("play").onclick = () => this.play();
    byId("loop").onclick = () => this.loop();
    byId("split").onclick = () => this.split();
    byId("save").onclick = () => saveImage(this);
    byId("film").onclick = () => saveVideo(this);
    byId("link").onclick = () => this.copyLink();
    byId("help").onclick = () => this.help();
    addEventListener("keydown", event => onKey(this, event));
    addEventListener("resize", () => {
      this.timeline.drawChart();
      this.touch();
    });
    addEventListener("hashchange", () => {
      if (location.hash.slice(1) !== this.written) {
        this.timeline.setPlaying(false);
        readAddress(this);
        this.setTimeline();
        this.go(this.timeline.index);
      }
    });
    byId("keys").append(keyTable());
  }

  zoom(factor) {
    this.orbit.zoom(factor);
    this.lookThroughNothing();
  }

  lookThroughNothing() {
    this.panes.forEach(pane => { pane.through = -1; });
    this.writeAddress();
    this.touch();
  }

  escape() {
    this.help(false);
    if (this.shownPanes.some(pane => pane.through >= 0)) {
      this.lookThrough(-1);
    }
  }

  /// Through the chosen camera, or from the one that is looked through to the next.
  nextCamera(step) {
    const {cameras} = this.now;
    if (cameras) {
      const count = cameras.cameras.length;
      const isThrough = this.panes[this.active].through === cameras.selected;
      this.select(isThrough ? (cameras.selected + step + count) % count : cameras.selected, true);
    }
  }

  /// Of all that can be shown, in the order of its tabs: from what is shown on.
  async nextMark(step) {
    const marks = this.timelines.flatMap(timeline => inOrder(timeline.info.marks)
      .filter(mark => mark.frame !== undefined || mark.camera !== undefined).map(mark => ({timeline, mark})));
    if (marks.length === 0) {
      say("No finding here names a frame or a camera.");
      return;
    }
    const at = marks.findIndex(({mark}) => mark === this.mark);  // more may have been found since
    const own = marks.findIndex(({timeline}) => timeline === this.now);
    const first = step > 0 ? Math.max(own, 0) : marks.length - 1;
    const {timeline, mark} = marks[at < 0 ? first : (at + step + marks.length) % marks.length];
    await this.choose(timeline.number);
    this.jump(mark);
  }

  play() {
    this.timeline.setPlaying(!this.timeline.playing);
    if (this.timeline.playing && !this.timeline.looping && this.timeline.index === this.timeline.frames.length - 1) {
      this.go(0);
    }
    this.writeAddress();
    this.side.syncVideo();
  }

  loop() {
    this.timeline.looping = !this.timeline.looping;
    byId("loop").setAttribute("aria-pressed", String(this.timeline.looping));
    this.writeAddress();
  }

  split() {
    this.isSplit = !this.isSplit;
    this.setThrough(this.panes[this.active].through);
    showPanes(this);
    showLegend(this);
    this.writeAddress();
    this.load();
  }

  help(isShown = byId("keys").hidden) {
    byId("keys").hidden = !isShown;
    byId("help").setAttribute("aria-expanded", String(isShown));
  }

  /// A click on a camera in space chooses it, another one looks through it; one into the other of two
  /// views goes there.
  pick(event) {
    if (this.orbit.dragged > 0) {
      return;
    }
    const number = this.isSplit && event.offsetX >= this.view.width / 2 ? 1 : 0;
    this.activate(number);
    const {cameras} = this.now;
    const pane = this.drawnPanes?.[number];
    if (!cameras?.showFrusta || !pane || pane.through) {
      return;
    }
    const camera = cameras.cameraAt([event.offsetX, event.offsetY], place => this.view.pixelOf(place, pane, this.orbit));
    this.select(camera, camera === cameras.selected);
  }

  copyLink() {
    this.writeAddress(true);
    const copied = navigator.clipboard?.writeText(location.href);
    (copied ?? Promise.reject()).then(() => say("The address of this view is in the clipboard."),
      () => say("The browser's address line holds the address of this view."));
  }

}

globalThis.atelierScene = scene => {
  globalThis.atelier = new App(scene);
};
// What is wrong in a file of data is said by who asked for it; on a disk a browser says no more than "Script error.".
addEventListener("error", event => event.message === "Script error." || /\/data\/[^?]*\.js$/.test(event.filename ?? "") ||
  say(event.message, true));
addEventListener("unhandledrejection", event => say(String(event.reason?.message ?? event.reason), true));
