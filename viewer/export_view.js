// Images and videos of what is seen, as files of the browser's downloads.

import {byId, element, say} from "./data.js";
import {dueAt} from "./timeline.js";

function download(name, blob) {
  const link = element("a", {href: URL.createObjectURL(blob), download: name});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function blobOf(canvas, type, quality) {
  return new Promise(resolve => canvas.toBlob(resolve, type, quality));
}

/// JPEGs as a video in an AVI file (RIFF, Motion JPEG), each frame at its time: a browser's own
/// recorder would tell how long the drawing took. Most players open it.
function aviOf(jpegs, width, height, fps) {
  const text = name => Uint8Array.from(name, c => c.charCodeAt(0));
  const numbers = (...values) => new Uint8Array(Uint32Array.from(values).buffer);
  const size = parts => parts.reduce((sum, part) => sum + part.byteLength, 0);
  const chunk = (name, parts) => {
    const bytes = size(parts);
    return [text(name), numbers(bytes), ...parts, ...(bytes % 2 ? [new Uint8Array(1)] : [])];
  };
  const list = (kind, parts) => chunk("LIST", [text(kind), ...parts]);
  const largest = Math.max(0, ...jpegs.map(jpeg => jpeg.byteLength));
  const rate = Math.round(1000 * fps);
  const main = numbers(Math.round(1e6 / fps), 0, 0, 0x10, jpegs.length, 0, 1, largest, width, height, 0, 0, 0, 0);
  const stream = [text("vids"), text("MJPG"), numbers(0, 0, 0, 1000, rate, 0, jpegs.length, largest, 0xffffffff, 0),
    new Uint8Array(new Uint16Array([0, 0, width, height]).buffer)];
  const format = [numbers(40, width, height), new Uint8Array(new Uint16Array([1, 24]).buffer), text("MJPG"),
    numbers(3 * width * height, 0, 0, 0, 0)];
  const header = list("hdrl", [...chunk("avih", [main]),
    ...list("strl", [...chunk("strh", stream), ...chunk("strf", format)])]);
  const index = [];
  let at = 4;
  const frames = [];
  for (const jpeg of jpegs) {
    frames.push(...chunk("00dc", [jpeg]));
    index.push(text("00dc"), numbers(0x10, at, jpeg.byteLength));
    at += 8 + jpeg.byteLength + jpeg.byteLength % 2;
  }
  return new Blob(chunk("RIFF", [text("AVI "), ...header, ...list("movi", frames), ...chunk("idx1", index)]),
    {type: "video/x-msvideo"});
}

export async function saveImage(app) {
  app.draw(true);
  download(`${app.now.info.name.replace(/[^\w-]+/g, "_")}-${app.frameId}.png`, await blobOf(byId("view"), "image/png"));
}

export async function saveVideo(app) {
  if (app.saving) {
    app.saving = false;
    return;
  }
  app.saving = true;
  app.timeline.setPlaying(false);
  const before = app.timeline.index;
  const jpegs = [];
  const {times, fps, seconds} = app.timeline;
  const count = Math.round(seconds * fps);
  for (let i = 0, shown = -1; i < count && app.saving; ++i) {
    const due = dueAt(times, i / fps);
    if (due !== shown) {
      await app.go(due);
      app.draw();
      jpegs.push(await (await blobOf(byId("view"), "image/jpeg", 0.92)).arrayBuffer());
      say(`Saving the video: ${i + 1} of ${count} frames (V ends it)`);
    } else {
      jpegs.push(jpegs.at(-1));  // of a slower take
    }
    shown = due;
  }
  if (app.saving) {
    const {width, height} = byId("view");
    download(`${app.now.info.name.replace(/[^\w-]+/g, "_")}.avi`, aviOf(jpegs, width, height, fps));
    document.documentElement.dataset.saved = jpegs.length;
  }
  app.saving = false;
  say("");
  app.go(before);
}
