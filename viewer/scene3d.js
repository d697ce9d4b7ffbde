// Draws panes: one or two views of layers, free or through a capture's camera.

import {kViewAngle} from "./orbit.js";
import {Rasterizer} from "./rasterizer.js";

/// Whether a context draws without a GPU.
function drawsInSoftware(gl) {
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  return /swiftshader|llvmpipe|software/i.test(told ? gl.getParameter(told.UNMASKED_RENDERER_WEBGL) : "");
}

/// A context, and whether it draws without a GPU: then without multisampling. Where there is a GPU, a second
/// one is made, on a canvas in the first one's place: that is quick there.
function contextOf(canvas) {
  // Opaque: a canvas that others shine through is blended into the page, pixel by pixel.
  const make = (on, antialias) => on.getContext("webgl2", {alpha: false, antialias, depth: true, stencil: false,
    powerPreference: "high-performance"});
  const context = make(canvas, false);
  if (!context) {
    throw new Error("no WebGL 2");
  }
  if (drawsInSoftware(context)) {
    return {canvas, context, software: true};
  }
  const other = canvas.cloneNode();
  const smooth = make(other, true);
  if (!smooth) {
    return {canvas, context, software: false};
  }
  canvas.replaceWith(other);
  return {canvas: other, context: smooth, software: false};
}

const kBackground = 0xf1efeb;

export class Scene3d {
  constructor(canvas) {
    const {context, ...rest} = contextOf(canvas);
    Object.assign(this, rest);
    this.renderer = new THREE.WebGLRenderer({canvas: this.canvas, context});
    this.ratio = this.software ? 1 : Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.autoClear = false;
    this.renderer.setClearColor(kBackground);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(kViewAngle, 1, 0.02, 400);
    this.ground = ground();
    this.scene.add(this.ground.group);
    this.layers = [];
    this.decor = [];  // {object, shown(pane)}
    this.backdrop = backdrop();
    this.rasters = this.software ? [0, 1].map(() => this.addRaster()) : [];  // of each pane
  }

  addRaster() {
    const mesh = rasterMesh();
    this.scene.add(mesh);
    return {rasterizer: new Rasterizer(), mesh};
  }

  add(layer) {
    this.layers.push(layer);
    this.scene.add(layer.mesh);
  }

  addDecor(object, shown) {
    this.decor.push({object, shown});
    this.scene.add(object);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (this.width !== width || this.height !== height) {
      this.width = width;
      this.height = height;
      this.renderer.setSize(width, height, false);
    }
  }

  /// @param panes  [{x, width (shares of the canvas), shows(layer), feet (framing.js), through: null or
  ///               {camera, texture}}]
  /// @param fine  nothing moves: meshes are drawn with four samples of a pixel, where there is no
  ///              multisampling
  draw(panes, orbit, lightAngle, fine = false) {
    this.resize();
    const {renderer} = this;
    renderer.setScissorTest(false);
    renderer.clear();
    renderer.setScissorTest(true);
    panes.forEach((pane, number) => {
      const x = pane.x * this.width, width = pane.width * this.width;
      renderer.setViewport(x, 0, width, this.height);
      renderer.setScissor(x, 0, width, this.height);
      if (pane.through) {
        lookThrough(this.camera, pane.through.camera, width, this.height);
      } else {
        this.camera.aspect = width / this.height;
        this.camera.near = Math.max(orbit.distance / 100, 0.005);
        this.camera.far = orbit.distance * 10 + 50;
        this.camera.updateProjectionMatrix();
        orbit.apply(this.camera);
      }
      this.camera.updateMatrixWorld();
      this.ground.feet.set(...pane.feet);
      this.ground.group.visible = !pane.through && this.camera.position.y > 0;
      for (const layer of this.layers) {
        layer.mesh.visible = pane.shows(layer) && !this.software;
        if (layer.mesh.visible) {
          layer.upload();
        }
        layer.mesh.material.transparent = pane.through !== null && pane.opacity < 1;
        layer.uniforms.opacity.value = pane.through ? pane.opacity : 1;
        this.setLight(layer, orbit, lightAngle);
      }
      for (const {object, shown} of this.decor) {
        object.visible = shown(pane);
      }
      if (pane.through?.texture) {
        showBackdrop(this.backdrop, pane.through, width, this.height);
        renderer.render(this.backdrop.scene, this.backdrop.camera);
        renderer.clearDepth();
      }
      this.rasterize(pane, number, x, width, fine);
      renderer.render(this.scene, this.camera);
    });
  }

  /// What is drawn without WebGL, as a picture with depths among what is drawn with it.
  rasterize(pane, number, x, width, fine) {
    const meshes = this.layers.filter(layer => pane.shows(layer) && layer.isDrawn);
    this.rasters.forEach(({rasterizer, mesh}, i) => {
      mesh.visible = i === number && meshes.length > 0;
      if (mesh.visible) {
        const matrix = new THREE.Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse);
        const picture = rasterizer.draw(meshes.map(layer => layer.forRasterizer()), matrix.elements, Math.round(width),
          this.height, fine ? 2 : 1);
        showPicture(mesh.material.uniforms, picture, {x, width, height: this.height, opacity: pane.through ? pane.opacity : 1});
      }
    });
  }

  setLight(layer, orbit, angle) {
    const a = angle === null ? orbit.azimuth - 0.6 : angle;
    layer.uniforms.keyLight.value.set(Math.sin(a), 0.9, Math.cos(a)).normalize();
    this.camera.getWorldDirection(layer.uniforms.toViewer.value).negate();
  }

  /// Pixels [x, y] of a place in the world, for a free pane; null behind the viewer.
  pixelOf(place, pane, orbit) {
    const width = pane.width * this.width;
    this.camera.aspect = width / this.height;
    this.camera.updateProjectionMatrix();
    orbit.apply(this.camera);
    this.camera.updateMatrixWorld();
    const p = new THREE.Vector3(...place).project(this.camera);
    return p.z > 1 ? null : [pane.x * this.width + (p.x + 1) / 2 * width, (1 - p.y) / 2 * this.height];
  }
}

/// A rectangle of pixels with their depths (rasterizer.js).
function rasterMesh() {
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.ShaderMaterial({
    transparent: true,
    uniforms: {colors: {value: null}, depths: {value: null}, rect: {value: new THREE.Vector4()}, opacity: {value: 1},
      corner: {value: new THREE.Vector2()}},
    vertexShader: `
uniform vec4 rect;
void main() {
  gl_Position = vec4(mix(rect.xy, rect.zw, uv), 0.0, 1.0);
}`,
    fragmentShader: `
uniform sampler2D colors;
uniform highp sampler2D depths;
uniform vec2 corner;
uniform float opacity;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy - corner);
  vec4 color = texelFetch(colors, pixel, 0);
  if (color.a == 0.0) discard;
  gl_FragDepth = texelFetch(depths, pixel, 0).r;
  gl_FragColor = vec4(color.rgb, color.a * opacity);
}`,
  }));
  mesh.frustumCulled = false;
  mesh.renderOrder = 1;
  return mesh;
}

function showPicture(uniforms, {left, bottom, width, height, colors, depths}, pane) {
  const put = (name, data, ...format) => {
    const {image} = uniforms[name].value ?? {};
    if (image?.data.buffer !== data.buffer) {  // of another size
      uniforms[name].value?.dispose();
      uniforms[name].value = new THREE.DataTexture(data, width, height, ...format);
    }
    uniforms[name].value.needsUpdate = true;
  };
  put("colors", new Uint8Array(colors.buffer), THREE.RGBAFormat);
  put("depths", depths, THREE.RedFormat, THREE.FloatType);
  const share = (pixels, all) => 2 * pixels / all - 1;
  uniforms.rect.value.set(share(left, pane.width), share(bottom, pane.height), share(left + width, pane.width),
    share(bottom + height, pane.height));
  uniforms.corner.value.set(pane.x + left, bottom);
  uniforms.opacity.value = pane.opacity;
}

/// Lines every half metre that fade into the background, and the soft shadow of who stands there.
/// Not one large surface: drawn by the CPU, that would cost as much as all meshes.
function ground() {
  const places = [], colors = [];
  const kReach = 3.5, kStep = 0.5;
  const put = (x, z) => {
    const fade = Math.max(0, 1 - Math.hypot(x, z) / kReach);
    places.push(x, 0, z);
    for (const shift of [16, 8, 0]) {
      const paper = (kBackground >> shift) & 255;
      colors.push((paper + (172 - paper) * 0.55 * fade) / 255);
    }
  };
  for (let line = -kReach; line <= kReach; line += kStep) {
    for (let at = -kReach; at < kReach; at += kStep) {
      put(line, at);
      put(line, at + kStep);
      put(at, line);
      put(at + kStep, line);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(places), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(Float32Array.from(colors), 3));
  const lines = new THREE.LineSegments(geometry, new THREE.ShaderMaterial({
    vertexShader: `
attribute vec3 color;
varying vec3 shown;
void main() {
  shown = color;
  gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0);
}`,
    fragmentShader: "varying vec3 shown; void main() { gl_FragColor = vec4(shown, 1.0); }",
  }));
  const shadow = new THREE.Mesh(new THREE.PlaneGeometry(1.4, 1.4), new THREE.ShaderMaterial({
    transparent: true,
    depthWrite: false,
    uniforms: {feet: {value: new THREE.Vector3(0, 0, 0)}},  // x, z, how dark
    vertexShader: `
uniform vec3 feet;
varying vec2 place;
void main() {
  place = position.xy;
  gl_Position = projectionMatrix * viewMatrix * vec4(position.x + feet.x, 0.001, feet.y - position.y, 1.0);
}`,
    fragmentShader: `
uniform vec3 feet;
varying vec2 place;
void main() {
  float far = min(dot(place, place) / 0.45, 1.0);
  gl_FragColor = vec4(0.33, 0.31, 0.29, 0.34 * feet.z * (1.0 - far) * (1.0 - far) * (1.0 - far));
}`,
  }));
  const group = new THREE.Group();
  for (const object of [lines, shadow]) {
    object.frustumCulled = false;
    object.renderOrder = 3;
    group.add(object);
  }
  return {group, feet: shadow.material.uniforms.feet.value};
}

/// The camera of a capture: its place, and a projection with its focal lengths and principal point;
/// the image as large as fits into the pane.
function lookThrough(view, camera, width, height) {
  const scale = Math.min(width / camera.width, height / camera.height);
  const left = (width - scale * camera.width) / 2, top = (height - scale * camera.height) / 2;
  const near = 0.05, far = 200;
  view.projectionMatrix.set(
    2 * scale * camera.fx / width, 0, -(2 * (left + scale * camera.cx) / width - 1), 0,
    0, 2 * scale * camera.fy / height, -(1 - 2 * (top + scale * camera.cy) / height), 0,
    0, 0, -(far + near) / (far - near), -2 * far * near / (far - near),
    0, 0, -1, 0);
  view.projectionMatrixInverse.copy(view.projectionMatrix).invert();
  const r = camera.rotation, t = camera.translation;
  // x right, y down, z forward becomes x right, y up, z back.
  const viewFromWorld = new THREE.Matrix4().set(
    r[0], r[1], r[2], t[0], -r[3], -r[4], -r[5], -t[1], -r[6], -r[7], -r[8], -t[2], 0, 0, 0, 1);
  viewFromWorld.invert().decompose(view.position, view.quaternion, view.scale);
}

/// The image behind what is drawn, without its lens's distortion: each pixel of the view asks for
/// the pixel that the lens bends its ray to.
function backdrop() {
  const material = new THREE.ShaderMaterial({
    depthTest: false,
    depthWrite: false,
    uniforms: {
      map: {value: null}, size: {value: new THREE.Vector2()}, focal: {value: new THREE.Vector2()},
      centre: {value: new THREE.Vector2()}, model: {value: 0}, lens: {value: new Array(8).fill(0)},
      rect: {value: new THREE.Vector4()},
    },
    vertexShader: `
varying vec2 place;
void main() {
  place = uv;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`,
    fragmentShader: `
uniform sampler2D map;
uniform vec2 size, focal, centre;
uniform vec4 rect;
uniform int model;
uniform float lens[8];
varying vec2 place;
void main() {
  vec2 pixel = (vec2(place.x, 1.0 - place.y) - rect.xy) / rect.zw * size;
  vec2 p = (pixel - centre) / focal;
  float r2 = dot(p, p);
  if (model == 1) {
    float radial = (1.0 + r2 * (lens[0] + r2 * (lens[1] + r2 * lens[4]))) / (1.0 + r2 * (lens[5] + r2 * (lens[6] + r2 * lens[7])));
    p = p * radial + vec2(2.0 * lens[2] * p.x * p.y + lens[3] * (r2 + 2.0 * p.x * p.x),
                          lens[2] * (r2 + 2.0 * p.y * p.y) + 2.0 * lens[3] * p.x * p.y);
  } else if (model == 2) {
    float r = sqrt(r2);
    float a = atan(r), a2 = a * a;
    float bent = a * (1.0 + a2 * (lens[0] + a2 * (lens[1] + a2 * (lens[2] + a2 * lens[3]))));
    p = r > 1e-8 ? p * bent / r : p;
  }
  vec2 source = (p * focal + centre) / size;
  if (source.x < 0.0 || source.y < 0.0 || source.x > 1.0 || source.y > 1.0) discard;
  gl_FragColor = texture2D(map, vec2(source.x, 1.0 - source.y));
}`,
  });
  const scene = new THREE.Scene();
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
  mesh.frustumCulled = false;
  scene.add(mesh);
  return {scene, material, camera: new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1)};
}

function showBackdrop({material}, {camera, texture}, width, height) {
  const scale = Math.min(width / camera.width, height / camera.height);
  const {uniforms} = material;
  uniforms.map.value = texture;
  uniforms.size.value.set(camera.width, camera.height);
  uniforms.focal.value.set(camera.fx, camera.fy);
  uniforms.centre.value.set(camera.cx, camera.cy);
  uniforms.model.value = {none: 0, brown: 1, fisheye: 2}[camera.model];
  uniforms.lens.value = camera.distortion;
  uniforms.rect.value.set((width - scale * camera.width) / 2 / width, (height - scale * camera.height) / 2 / height,
    scale * camera.width / width, scale * camera.height / height);
}
