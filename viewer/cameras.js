// The cameras of a capture: frusta with their images, what was detected in them, and how well the
// calibration agrees with that.

import {chunkCache} from "./layer.js";
import {element, imageOf, loadData} from "./data.js";
import {labelColor} from "./color.js";

const kDepth = 0.28;  // m, of a frustum

/// Where a ray of the image's pixel is at a depth, in the world.
function unproject(camera, u, v, depth) {
  const x = (u - camera.cx) / camera.fx * depth, y = (v - camera.cy) / camera.fy * depth;
  const d = [x - camera.translation[0], y - camera.translation[1], depth - camera.translation[2]];
  const r = camera.rotation;
  return [0, 1, 2].map(k => r[k] * d[0] + r[3 + k] * d[1] + r[6 + k] * d[2]);
}

/// Pixel of a place in the world, distorted as the lens does; null behind the camera.
export function project(camera, place) {
  const r = camera.rotation, t = camera.translation;
  const [x, y, z] = [0, 1, 2].map(i => r[3 * i] * place[0] + r[3 * i + 1] * place[1] + r[3 * i + 2] * place[2] + t[i]);
  if (z <= 1e-6) {
    return null;
  }
  let a = x / z, b = y / z;
  const k = camera.distortion, r2 = a * a + b * b;
  if (camera.model === "brown") {
    const radial = (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
    [a, b] = [a * radial + 2 * k[2] * a * b + k[3] * (r2 + 2 * a * a), b * radial + k[2] * (r2 + 2 * b * b) + 2 * k[3] * a * b];
  } else if (camera.model === "fisheye") {
    const radius = Math.sqrt(r2), angle = Math.atan(radius), q = angle * angle;
    const bent = angle * (1 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3]))));
    [a, b] = radius > 1e-8 ? [a * bent / radius, b * bent / radius] : [a, b];
  }
  return [camera.fx * a + camera.cx, camera.fy * b + camera.cy];
}

export class Cameras {
  constructor(info, scene3d, timeline, changed) {
    this.info = info;
    this.cameras = info.cameras;
    this.timeline = timeline;
    this.changed = changed;
    this.selected = -1;
    this.overlays = {keypoints: true, projected: true, mask: false, labels: false};
    this.found = new Set(info.agreement ? ["projected"] : []);  // names of overlays that an image had
    this.canvas = element("canvas", {width: 2, height: 2});
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.frusta = new THREE.LineSegments(new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({vertexColors: true}));
    this.frusta.frustumCulled = false;
    this.planes = new THREE.Group();
    this.skeleton = new THREE.LineSegments(new THREE.BufferGeometry(),
      new THREE.LineBasicMaterial({color: 0xb3261e, depthTest: false}));
    this.skeleton.frustumCulled = false;
    this.skeleton.renderOrder = 2;
    this.showFrusta = true;
    this.showSkeleton = false;
    const here = pane => pane.timeline === timeline;
    scene3d.addDecor(this.frusta, pane => here(pane) && this.showFrusta && !pane.through);
    scene3d.addDecor(this.planes, pane => here(pane) && this.showFrusta && !pane.through);
    scene3d.addDecor(this.skeleton, pane => here(pane) && this.showSkeleton);
    this.buildPlanes();
    this.drawFrusta();
  }

  centre(index) {
    return unproject(this.cameras[index], this.cameras[index].cx, this.cameras[index].cy, 0);
  }

  corners(camera) {
    return [[0, 0], [camera.width, 0], [camera.width, camera.height], [0, camera.height]]
      .map(([u, v]) => unproject(camera, u, v, kDepth));
  }

  /// The camera whose frustum or image is at a pixel; -1: none.
  /// @param pixelOf  of a place in the world: [x, y], or null
  cameraAt([x, y], pixelOf) {
    const kNear = 18;  // px from the centre
    let best = -1, least = Infinity;
    this.cameras.forEach((camera, c) => {
      const centre = pixelOf(this.centre(c)), corners = this.corners(camera).map(pixelOf);
      let away = centre ? Math.hypot(centre[0] - x, centre[1] - y) : Infinity;
      away = away < kNear ? away : Infinity;
      if (corners.every(Boolean) && isInside([x, y], corners)) {
        const middle = [0, 1].map(k => corners.reduce((sum, corner) => sum + corner[k] / 4, 0));
        away = Math.min(away, Math.hypot(middle[0] - x, middle[1] - y));
      }
      if (away < least) {
        best = c;
        least = away;
      }
    });
    return best;
  }

  drawFrusta() {
    const places = [], colors = [];
    const worst = this.worstResidual();
    this.cameras.forEach((camera, c) => {
      const centre = this.centre(c), corners = this.corners(camera);
      const color = c === this.selected ? [0.10, 0.45, 0.47]
        : this.isOff(c) ? [0.75, 0.13, 0.10] : camera.held_out ? [0.72, 0.70, 0.66] : [0.34, 0.36, 0.40];
      for (let i = 0; i < 4; ++i) {
        places.push(...centre, ...corners[i], ...corners[i], ...corners[(i + 1) % 4]);
      }
      const up = [0, 1, 2].map(k => (corners[0][k] + corners[1][k]) / 2 + 0.25 * (corners[0][k] - corners[3][k]));
      places.push(...corners[0], ...up, ...up, ...corners[1]);
      for (let i = 0; i < 20; ++i) {
        colors.push(...color);
      }
    });
    this.worst = worst;
    this.frusta.geometry.dispose();
    this.frusta.geometry = new THREE.BufferGeometry();
    this.frusta.geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(places), 3));
    this.frusta.geometry.setAttribute("color", new THREE.BufferAttribute(Float32Array.from(colors), 3));
  }

  buildPlanes() {
    for (const camera of this.cameras) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(this.corners(camera).flat()), 3));
      geometry.setAttribute("uv", new THREE.BufferAttribute(Float32Array.from([0, 1, 1, 1, 1, 0, 0, 0]), 2));
      geometry.setIndex([0, 1, 2, 0, 2, 3]);
      const material = new THREE.ShaderMaterial({
        side: THREE.DoubleSide,
        uniforms: {map: {value: null}},
        vertexShader: "varying vec2 p; void main() { p = uv; gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0); }",
        fragmentShader: "uniform sampler2D map; varying vec2 p; void main() { gl_FragColor = texture2D(map, p); }",
      });
      const mesh = new THREE.Mesh(geometry, material);
      mesh.frustumCulled = false;
      mesh.visible = false;
      this.planes.add(mesh);
    }
  }

  /// The images of all frusta in a frame, one after the other, for as long as nothing else is asked.
  async showThumbs(frameId, isStill) {
    for (let c = 0; c < this.cameras.length && isStill(); ++c) {
      const mesh = this.planes.children[c];
      if (this.cameras[c].held_out || !this.cameras[c].frames.includes(frameId)) {
        mesh.visible = false;
        continue;
      }
      try {
        const image = await chunkCache.get(`${this.info.data}/${c}/${frameId}_small`,
          ({header}) => ({value: header.image ? imageOf(header.image) : null, bytes: header.image?.length ?? 0}));
        const decoded = await image;
        mesh.material.uniforms.map.value?.dispose();
        mesh.material.uniforms.map.value = decoded ? new THREE.Texture(decoded) : null;
        if (decoded) {
          mesh.material.uniforms.map.value.needsUpdate = true;
        }
        mesh.visible = decoded !== null;
      } catch {
        mesh.visible = false;
      }
      this.changed();
    }
  }

  async loadAgreement() {
    if (!this.info.agreement) {
      return null;
    }
    this.agreementAsked ??= loadData(this.info.data + "/agreement").then(({header}) => {
      this.agreement = header;
      this.drawFrusta();
      this.changed();
      return header;
    });
    return this.agreementAsked;
  }

  residual(index) {
    return this.agreement?.cameras?.[index] ?? null;
  }

  middleResidual() {
    const all = (this.agreement?.cameras ?? []).filter(r => r !== null).sort((a, b) => a - b);
    return all.length > 2 ? all[all.length >> 1] : null;
  }

  worstResidual() {
    return Math.max(0, ...(this.agreement?.cameras ?? []).map(r => r ?? 0));
  }

  /// A camera that is more than twice as far off as the median one.
  isOff(index) {
    const residual = this.residual(index), middle = this.middleResidual();
    return residual !== null && middle !== null && residual > 2 * middle && residual > 1;
  }

  agreementOf(frameId) {
    return this.agreement?.frames?.find(f => f.frame === frameId) ?? null;
  }

  /// Lines between keypoints in space, and at each a cross as wide as one standard deviation.
  drawSkeleton(frameId) {
    const points = this.agreementOf(frameId)?.points ?? [];
    const places = [];
    for (const [a, b] of this.agreement?.limbs ?? []) {
      if (points[a]?.[3] > 0 && points[b]?.[3] > 0) {
        places.push(...points[a].slice(0, 3), ...points[b].slice(0, 3));
      }
    }
    for (const point of points) {
      for (let k = 0; k < 3 && point[3] > 0; ++k) {
        const arm = Math.max(point[4], 0.004);
        for (const side of [-arm, arm]) {
          const end = point.slice(0, 3);
          end[k] += side;
          places.push(...end);
        }
      }
    }
    this.skeleton.geometry.dispose();
    this.skeleton.geometry = new THREE.BufferGeometry();
    this.skeleton.geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(places), 3));
  }

  /// Loads the selected camera's image and draws it with what lies over it.
  async showImage(frameId, isStill) {
    const camera = this.cameras[this.selected];
    if (!camera) {
      return "";
    }
    if (camera.held_out) {
      this.clearImage(camera);
      return "This camera is held out: its images are not opened.";
    }
    if (!camera.frames.includes(frameId)) {
      this.clearImage(camera);
      return "This camera has no image of this frame.";
    }
    const {header} = await chunkCache.get(`${this.info.data}/${this.selected}/${frameId}`,
      data => ({value: data, bytes: JSON.stringify(data.header).length}));
    ["keypoints", "mask", "labels"].filter(name => header[name]).forEach(name => this.found.add(name));
    const [image, mask, labels] = await Promise.all(["image", "mask", "labels"].map(
      name => header[name] && (name === "image" || this.overlays[name]) ? imageOf(header[name]) : null));
    if (!isStill()) {
      return "";
    }
    this.paint(camera, frameId, image, mask, labels, header.keypoints ?? []);
    const problems = header.problems ?? [];
    return (header.image || problems.length > 0 ? problems : ["There is no image of this frame."]).join("\n");
  }

  clearImage(camera) {
    this.setSize(640, Math.round(640 * camera.height / camera.width));
    const context = this.canvas.getContext("2d");
    context.fillStyle = "#dedbd4";
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.texture.needsUpdate = true;
  }

  /// A texture keeps the size that it was first shown with.
  setSize(width, height) {
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.texture.dispose();
    }
  }

  paint(camera, frameId, image, mask, labels, people) {
    const width = image?.naturalWidth ?? 640;
    this.setSize(width, image?.naturalHeight ?? Math.round(width * camera.height / camera.width));
    const context = this.canvas.getContext("2d", {willReadFrequently: true});
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    if (image) {
      context.drawImage(image, 0, 0);
    }
    if (labels) {
      context.drawImage(tinted(labels, n => [...labelColor(n), n === 0 ? 0 : 150]), 0, 0, this.canvas.width, this.canvas.height);
    }
    if (mask) {
      context.drawImage(tinted(mask, n => n ? [0, 0, 0, 0] : [250, 248, 244, 190]), 0, 0, this.canvas.width, this.canvas.height);
    }
    const scale = this.canvas.width / camera.width;
    const line = Math.max(1.5, this.canvas.width / 400);
    if (this.overlays.keypoints) {
      for (const points of people) {
        this.paintPoints(context, points.map(p => p[2] > 0.1 ? p : null), scale, line, "#ffb000", true);
      }
    }
    if (this.overlays.projected) {
      const points = this.agreementOf(frameId)?.points ?? [];
      this.paintPoints(context, points.map(p => p[3] > 0 ? project(camera, p) : null), scale, line, "#12b5c4", false);
    }
    this.texture.needsUpdate = true;
  }

  paintPoints(context, points, scale, line, color, filled) {
    context.strokeStyle = context.fillStyle = color;
    context.lineWidth = line;
    context.beginPath();
    for (const [a, b] of this.agreement?.limbs ?? []) {
      if (points[a] && points[b]) {
        context.moveTo(scale * points[a][0], scale * points[a][1]);
        context.lineTo(scale * points[b][0], scale * points[b][1]);
      }
    }
    context.stroke();
    for (const point of points) {
      if (point) {
        context.beginPath();
        context.arc(scale * point[0], scale * point[1], 1.8 * line, 0, 7);
        filled ? context.fill() : context.stroke();
      }
    }
  }
}

function isInside([x, y], corners) {
  return corners.reduce((inside, [ax, ay], i) => {
    const [bx, by] = corners[(i + 1) % corners.length];
    return (ay > y) !== (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax) ? !inside : inside;
  }, false);
}

/// An image of numbers as colours: RGBA of each number.
function tinted(image, color) {
  const canvas = element("canvas", {width: image.naturalWidth, height: image.naturalHeight});
  const context = canvas.getContext("2d");
  context.drawImage(image, 0, 0);
  const pixels = context.getImageData(0, 0, canvas.width, canvas.height);
  const table = Array.from({length: 256}, (_, n) => color(n));
  for (let i = 0; i < pixels.data.length; i += 4) {
    pixels.data.set(table[pixels.data[i]], i);
  }
  context.putImageData(pixels, 0, 0);
  return canvas;
}

/// Of each frame the worst camera, and each camera's own.
export function residualSeries(cameras) {
  const frames = cameras.agreement?.frames ?? [];
  const one = (name, value, isDetail) => ({stage: "cameras", name, unit: "px", isDetail, frames: frames.map(f => f.frame),
    values: frames.map(value)});
  if (frames.length === 0) {
    return [];
  }
  return [one("largest residual of a camera", f => Math.max(0, ...f.residuals.map(r => r ?? 0))),
    ...cameras.cameras.map((camera, c) => one(`residual of ${camera.id}`, f => f.residuals[c], true))];
}
