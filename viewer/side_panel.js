// What stands at the side: cameras, the pattern, the video, findings.

import {byId, element, refill, say} from "./data.js";
import {labelSwatches} from "./panels.js";
import {patternView} from "./pattern.js";

/// A finding without its head: of "warning frames-few [person]: four frames", what and where. A word before a
/// colon may be a name as well: it is a head after a severity or before a place alone.
export function withoutHead(text) {
  const [head, frame, first, second] =
    text.match(/^(frame \d+: )?(?:(?:error|warning|note) [a-z0-9-]+(?: \[([^\]]*)\])?|[a-z0-9-]+ \[([^\]]*)\]): /) ?? [];
  const place = first ?? second;
  return head === undefined ? text : (frame ?? "") + (place ? place + ": " : "") + text.slice(head.length);
}

/// Findings, the worst first; of one severity, first what the page has found and shows where it is.
export function inOrder(marks) {
  const order = {error: 0, warning: 2, note: 4};
  const rank = mark => order[mark.severity] - (mark.vertex === undefined ? 0 : 1);
  return [...marks].sort((a, b) => rank(a) - rank(b));
}

/// How many findings of a timeline are more than notes, and the severity of its worst: "" of none.
export function warningsOf({info}) {
  const severities = info.marks.map(mark => mark.severity).filter(one => one !== "note");
  return {count: severities.length, worst: ["error", "warning"].find(one => severities.includes(one)) ?? ""};
}

export class SidePanel {
  constructor(app) {
    this.app = app;
    this.tab = null;  // what was chosen
  }

  /// What there is to say of the camera's image, and which of its overlays there are.
  tellOfImage(note) {
    if (this.imageNote) {
      this.imageNote.textContent = note;
      this.offerOverlays();
    }
  }

  offerOverlays() {
    const {found, overlays} = this.app.now.cameras;
    for (const [name, label] of Object.entries(this.overlayLabels)) {
      label.hidden = !found.has(name);
    }
    this.labelNames.hidden = !overlays.labels || !found.has("labels");
  }

  tabs() {
    const {info, cameras, layers} = this.app.now;
    const tabs = [];
    if (cameras) tabs.push(["cameras", "Cameras"]);
    if (layers.some(layer => layer.info.pattern)) tabs.push(["pattern", "Pattern"]);
    if (info.videos.length > 0) tabs.push(["video", "Video"]);
    tabs.push(["findings", `Findings (${info.marks.length})`]);
    return tabs;
  }

  showTabs() {
    const tabs = this.tabs();
    if (!tabs.some(([name]) => name === this.tab)) {
      this.tab = tabs[0][0];
    }
    refill(byId("side-tabs"), ...tabs.map(([name, words]) => element("button", {role: "tab",
      className: name === "findings" ? warningsOf(this.app.now).worst : "", ariaSelected: String(name === this.tab), onclick: () => {
        this.tab = name;
        this.app.writeAddress();
        this.show();
      }}, words)));
  }

  /// Findings that have come since; whoever looks at something else keeps it.
  showFindings() {
    this.showTabs();
    if (this.tab === "findings") {
      refill(byId("side-body"), ...this.findingsParts());
    }
  }

  show() {
    this.showTabs();
    this.darken();
    this.video = null;
    this.imageNote = null;
    const show = {cameras: () => this.camerasParts(), pattern: () => this.patternParts(),
      video: () => this.videoParts(), findings: () => this.findingsParts()}[this.tab];
    refill(byId("side-body"), ...show());
  }

  /// A pattern that goes from the side, or is drawn anew there, leaves no panel lit up that the pointer could
  /// not leave: under the pointer the new one lights up again.
  darken() {
    const lit = this.app.timelines.flatMap(({layers}) => layers).filter(layer => layer.lit >= 0);
    lit.forEach(layer => { layer.lit = -1; });
    if (lit.length > 0) {
      this.app.load();
    }
  }

  camerasParts() {
    const {cameras} = this.app.now;
    const buttons = cameras.cameras.map((camera, c) => element("button", {title: camera.held_out ? "held out" : "",
      ariaPressed: String(c === cameras.selected), onclick: () => this.app.select(c, c === cameras.selected)}, camera.id));
    const parts = [element("div", {className: "cameras"}, ...buttons)];
    if (cameras.selected >= 0) {
      const through = this.app.panes[this.app.active].through === cameras.selected;
      parts.push(element("button", {id: "through", ariaPressed: String(through),
        onclick: () => this.app.lookThrough(through ? -1 : cameras.selected)}, "Look through it (C)"));
      const opacity = element("input", {type: "range", min: "0", max: "100", value: String(100 * this.app.opacity), id: "opacity",
        oninput: () => {
          this.app.opacity = Number(opacity.value) / 100;
          this.app.writeAddress();
          this.app.touch();
        }});
      parts.push(element("label", {className: "slider"}, "Meshes over the image ", opacity));
      this.labelNames = element("div", {className: "toggles"}, ...labelSwatches());
      this.overlayLabels = Object.fromEntries([["keypoints", "detected keypoints"],
        ["projected", "keypoints in space"], ["mask", "mask"], ["labels", "labels"]].map(([name, words]) => {
        const check = element("input", {type: "checkbox", checked: cameras.overlays[name], onchange: () => {
          cameras.overlays[name] = check.checked;
          this.offerOverlays();
          this.app.writeAddress();
          this.app.load();
        }});
        return [name, element("label", {}, check, " ", words)];
      }));
      this.offerOverlays();
      parts.push(element("div", {className: "toggles"}, ...Object.values(this.overlayLabels)), this.labelNames, cameras.canvas);
      this.imageNote = element("p", {className: "quiet"});
      parts.push(this.imageNote);
    } else {
      parts.push(element("p", {className: "quiet"}, "Choose a camera for its image."));
    }
    const {agreement} = cameras;
    if (agreement?.cameras) {
      parts.push(element("h2", {}, "Keypoints to their detections, median px"));
      const worst = Math.max(cameras.worstResidual(), 1e-9);
      parts.push(element("div", {className: "bars"}, ...cameras.cameras.flatMap((camera, c) => {
        const residual = cameras.residual(c);
        const bar = element("span", {className: cameras.isOff(c) ? "bar off" : "bar"});
        bar.style.width = `${100 * (residual ?? 0) / worst}%`;
        return [element("button", {onclick: () => this.app.select(c, true)}, camera.id), bar,
          element("span", {}, residual === null ? "–" : residual.toFixed(1))];
      })));
      const off = cameras.cameras.filter((_, c) => cameras.isOff(c)).map(camera => camera.id);
      if (off.length > 0) {
        parts.push(element("p", {}, `Camera ${off.join(", ")} is more than twice as far off as the median camera: ` +
          "its calibration, its clock or its name may be wrong."));
      }
    } else if (cameras.info.agreement) {
      parts.push(element("p", {className: "quiet"}, "The residuals of the calibration are being computed."));
    }
    for (const problem of agreement?.problems ?? []) {
      parts.push(element("p", {}, problem));
    }
    return parts;
  }

  patternParts() {
    const box = element("div", {});
    const layers = this.app.now.layers.filter(layer => layer.info.pattern);
    Promise.all(layers.map(layer => layer.topology())).then(topologies => {
      topologies.forEach((topology, i) => {
        const layer = layers[i];
        box.append(element("h2", {}, layer.info.name), patternView(topology.arrays.pattern_faces,
          topology.arrays.pattern, layer.panels(topology).panels, panel => {
            layer.lit = panel;
            this.app.load();
          }));
      });
    }, error => say(error.message, true));
    return [box];
  }

  videoParts() {
    this.video = element("video", {src: this.app.now.info.videos[0], muted: true, preload: "auto", playsInline: true,
      ariaLabel: "The rendered images of these frames"});
    this.video.onloadeddata = () => this.syncVideo();
    this.video.onerror = () => {
      byId("side-body").replaceChildren(element("p", {}, "The video cannot be read: its file is damaged, or this browser " +
        "does not play it. If atelier status says that animate is damaged, run the stage again."));
    };
    return [this.video, element("p", {className: "quiet"}, "The images that the networks rendered, at the frame of the view.")];
  }

  syncVideo() {
    const {video} = this;
    if (!video || !Number.isFinite(video.duration) || video.duration === 0) {
      return;
    }
    const {times, index, seconds, playing} = this.app.timeline;
    const wanted = (times[index] + times[index + 1]) / 2 / seconds * video.duration;
    if (playing) {
      const speed = video.duration / seconds;
      if (Math.abs(video.currentTime - wanted) > 0.15) {
        video.currentTime = wanted;
      }
      if (video.paused) {
        video.playbackRate = Math.min(Math.max(speed, 0.1), 8);
        video.play().catch(() => {});
      }
    } else {
      video.pause();
      video.currentTime = wanted;
    }
  }

  /// Of what is shown all, of the rest what is more than a note.
  findingsParts() {
    const {now, timelines} = this.app;
    const own = now.info.marks.length === 0 ? [element("p", {className: "quiet"}, "Nothing was found.")]
      : inOrder(now.info.marks).map(mark => this.findingButton(mark, now));
    const others = timelines.filter(timeline => timeline !== now && warningsOf(timeline).count > 0);
    return [...own, ...others.flatMap(timeline => [element("h2", {}, timeline.info.name),
      ...inOrder(timeline.info.marks).filter(({severity}) => severity !== "note").map(mark => this.findingButton(mark, timeline))])];
  }

  findingButton(mark, timeline) {
    const leads = mark.frame !== undefined || mark.camera !== undefined || timeline !== this.app.now;
    return element("button", {className: "finding " + mark.severity, disabled: !leads, onclick: async () => {
      await this.app.choose(timeline.number);
      this.app.jump(mark);
    }}, mark.stage ? element("b", {}, mark.stage + ": ") : "", mark.text,
      mark.frame !== undefined ? element("small", {}, ` → frame ${mark.frame}`) : "",
      mark.camera !== undefined ? element("small", {}, ` → camera ${mark.camera}`) : "");
  }
}
