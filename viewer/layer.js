// A layer: meshes over time, drawn with a colour, a texture or a number of each vertex.

import {DataCache, element, imageOf, loadData} from "./data.js";
import {labelColor, numberColor, roleColor, scaleRow} from "./color.js";
import {CodedFrames, deviationAtEnd, edgeLengths, edgesOf, faceStrain, faceToVertex, largestDeviation, panelsOf, toMetres, vertexNormals} from "./mesh_math.js";

/// Decoded vertices of all layers stay below this; more is loaded again when it is needed.
export const chunkCache = new DataCache(72e6);

// What a vertex carries beside its place and normal: nothing, a colour, a number, a texture coordinate.
const kPlain = 0, kTinted = 1, kScaled = 2, kTextured = 3;

// What vertices may carry in a frame's file, that is a colour: [name, words].
const kCarried = [["colors", "captured colour"], ["labels", "labels"], ["confidence", "confidence"]];

// A soft studio: light from above and below, a key light that goes with the viewer or stands, a
// little light on the rim. Written for machines that draw by the CPU: each mode has its own program,
// which carries no more than it needs, and gamma 2 stands for that of sRGB.
const kVertexShader = `
attribute float number;
attribute vec3 tint;
attribute vec2 place;
varying vec3 worldNormal;
#if MODE == ${kTinted}
varying vec3 shownTint;
#elif MODE == ${kScaled}
varying float shownNumber;
#elif MODE == ${kTextured}
varying vec2 shownPlace;
#endif
void main() {
  worldNormal = normal;
#if MODE == ${kTinted}
  shownTint = tint;
#elif MODE == ${kScaled}
  shownNumber = number;
#elif MODE == ${kTextured}
  shownPlace = place;
#endif
  gl_Position = projectionMatrix * (viewMatrix * vec4(position, 1.0));
}`;

const kFragmentShader = `
uniform vec3 base;
uniform sampler2D scale;
uniform sampler2D map;
uniform vec2 range;
uniform vec3 keyLight;
uniform vec3 toViewer;
uniform float shade;
uniform float opacity;
varying vec3 worldNormal;
#if MODE == ${kTinted}
varying vec3 shownTint;
#elif MODE == ${kScaled}
varying float shownNumber;
#elif MODE == ${kTextured}
varying vec2 shownPlace;
#endif
void main() {
#if MODE == ${kTinted}
  vec3 color = shownTint;
#elif MODE == ${kScaled}
  float share = clamp((shownNumber - range.x) / max(range.y - range.x, 1e-9), 0.0, 1.0);
  vec3 color = texture2D(scale, vec2(share * 0.998 + 0.001, 0.5)).rgb;
#elif MODE == ${kTextured}
  vec3 color = texture2D(map, shownPlace).rgb;
#else
  vec3 color = base;
#endif
  vec3 n = normalize(worldNormal);
  n = gl_FrontFacing ? n : -n;
  float key = max(dot(n, keyLight), 0.0);
  float rim = 1.0 - abs(dot(n, toViewer));
  vec3 light = vec3(0.40, 0.40, 0.405) + vec3(0.10, 0.11, 0.125) * n.y + vec3(0.62, 0.60, 0.57) * key + 0.10 * rim * rim * rim;
  light = mix(vec3(1.0), light, shade) * (gl_FrontFacing ? 1.0 : 0.62);
  gl_FragColor = vec4(color * sqrt(light), opacity);
}`;

const kLit = [255, 199, 64];  // a panel under the pointer

let scaleTexture = null;

function material(color) {
  if (!scaleTexture) {
    scaleTexture = new THREE.DataTexture(scaleRow(256), 256, 1, THREE.RGBAFormat);
    scaleTexture.minFilter = scaleTexture.magFilter = THREE.LinearFilter;
    scaleTexture.needsUpdate = true;
  }
  return new THREE.ShaderMaterial({
    vertexShader: kVertexShader,
    fragmentShader: kFragmentShader,
    side: THREE.DoubleSide,
    forceSinglePass: true,
    defines: {MODE: kPlain},
    uniforms: {
      base: {value: new THREE.Vector3(...color.map(c => c / 255))},
      scale: {value: scaleTexture},
      map: {value: scaleTexture},
      range: {value: new THREE.Vector2(0, 1)},
      keyLight: {value: new THREE.Vector3(0.4, 0.7, 0.6).normalize()},
      toViewer: {value: new THREE.Vector3(0, 0, 1)},
      shade: {value: 1},
      opacity: {value: 1},
    },
  });
}

export class Layer {
  /// @param takeOf  the take of a number on the timeline
  constructor(info, timeline, number, takeOf) {
    this.info = info;
    // Numbers on the timeline: of a rate of its own, those from which on its frames are shown.
    this.frames = info.begins?.slice(0, -1) ?? info.frames;
    this.end = info.begins?.at(-1);
    // Its frames of each take: those of two are not beside each other.
    this.runs = [];
    this.frames.forEach((frame, i) => {
      const take = takeOf(frame), run = this.runs.at(-1);
      run?.take === take ? run.end = i + 1 : this.runs.push({take, first: i, end: i + 1});
    });
    this.timeline = timeline;
    this.number = number;
    this.color = roleColor(info.role, number);
    this.coloring = "plain";
    this.mode = kPlain;
    this.unreadable = [];  // of surveyed frames: [frame, why]
    // Of surveyed frames: how far edges are from the frames beside, m; the strain of faces, 99.5th percentile.
    this.figures = {deviation: [], strain: []};
    this.worst = {deviation: [], strain: []};  // the vertex where each is largest
    this.mesh = new THREE.Mesh(new THREE.BufferGeometry(), material(this.color));
    // What hides others is drawn first, and of a body, which is closed, the outside alone: fewer pixels
    // are drawn twice.
    this.mesh.renderOrder = {garment: 0, scan: 1}[info.role] ?? 2;
    if (info.role === "body") {
      this.mesh.material.side = THREE.FrontSide;
    }
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
    this.mesh.userData.layer = this;
    this.shownFrame = null;  // index on the layer's own frames
    this.problem = "";
    this.carried = new Set();  // names of kCarried that a frame had
    this.wasRead = this.hasNews = false;
    this.lit = -1;  // the panel that is lit up; -1: none
  }

  get uniforms() {
    return this.mesh.material.uniforms;
  }

  /// What its colour may say: [name, words].
  colorings() {
    const {info} = this;
    const all = [["plain", "one colour"]];
    if (info.texture) all.push(["texture", "texture"]);
    all.push(...kCarried.filter(([name]) => this.carried.has(name)));
    if (info.strain) all.push(["strain", "strain"]);
    if (info.distance) all.push(["distance", "distance to the scan"]);
    if (info.pattern) all.push(["panels", "panels"]);
    return all;
  }

  /// Whether it may have a colour: of what vertices carry, that is known once a frame was read.
  mayHave(coloring) {
    return (!this.wasRead && kCarried.some(([name]) => name === coloring)) ||
      this.colorings().some(([name]) => name === coloring);
  }

  /// Learns from a frame what its vertices carry; a colour that none does is given up.
  learn(arrays) {
    const found = kCarried.filter(([name]) => arrays[name] && !this.carried.has(name));
    found.forEach(([name]) => this.carried.add(name));
    this.wasRead = true;
    const isGivenUp = !this.mayHave(this.coloring);
    this.coloring = isGivenUp ? "plain" : this.coloring;
    this.hasNews ||= isGivenUp || found.length > 0;
  }

  /// Whether more has become known of its colours since this was asked last.
  takeNews() {
    const {hasNews} = this;
    this.hasNews = false;
    return hasNews;
  }

  /// Range and words of the legend; null where colour is no number.
  legend() {
    const name = `${this.info.name}: `;
    switch (this.coloring) {
      case "strain": return {title: name + "strain", low: "0 %", high: `${(100 * this.strainHigh).toFixed(0)} % and more`};
      case "distance": return {title: name + "distance to the scan", low: "0 mm",
        high: `${(1000 * this.info.distance.high).toFixed(0)} mm and more`};
      case "confidence": return {title: name + "confidence", low: "0", high: "1"};
      default: return null;
    }
  }

  strainHigh = 0.1;

  /// Index of a frame of the timeline among the layer's own; -1: it has none then.
  frameIndex(frameId) {
    const {frames, end} = this;
    if (frames.length === 1) {
      return 0;
    }
    let low = -1, high = frames.length - 1;  // the last that has begun
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      frames[middle] <= frameId ? low = middle : high = middle - 1;
    }
    return end === undefined ? (frames[low] === frameId ? low : -1) : frameId < end ? low : -1;
  }

  async topology() {
    this.topologyAsked ??= chunkless(this.info.data + "/topology");
    return this.topologyAsked;
  }

  chunkKey(index) {
    return `${this.info.data}/${Math.floor(index / this.info.chunk)}`;
  }

  async chunk(index) {
    return chunkCache.get(this.chunkKey(index), data => this.decode(data));
  }

  decode({header, arrays}) {
    const value = {header, arrays, missing: new Map()};
    for (const {frame, why} of header.missing ?? []) {
      value.missing.set(frame, why);
    }
    if (arrays.small) {
      value.frames = new CodedFrames(header.frames, arrays.small, arrays.large);
      delete arrays.small;
      delete arrays.large;
    }
    let bytes = value.frames?.byteLength ?? 0;
    for (const array of Object.values(arrays)) {
      bytes += array.byteLength;
    }
    return {value, bytes};
  }

  async distances(index) {
    const key = `${this.info.data}/distance/${Math.floor(index / this.info.chunk)}`;
    return chunkCache.get(key, ({header, arrays}) => ({
      value: {header, values: arrays.values}, bytes: arrays.values.byteLength}));
  }

  /// Loads what the frame needs and puts it into the mesh, unless another one is asked for
  /// meanwhile. @return whether it did
  async show(frameId, isStill = () => true) {
    const index = this.frameIndex(frameId);
    if (index < 0) {
      this.shownFrame = null;
      this.problem = "";
      this.setDrawn(false);
      return true;
    }
    const topology = this.info.topology ? await this.topology() : null;
    const chunk = await this.chunk(index);
    const distances = this.coloring === "distance" ? await this.distances(index) : null;
    if (this.coloring === "texture" && !this.image) {
      await this.loadTexture();
    }
    if (!isStill()) {
      return false;
    }
    const why = chunk.missing.get(this.info.frames[index]);
    this.problem = why ? `${this.info.name}: frame ${this.info.frames[index]} cannot be read: ${why}` : "";
    this.put(index, topology, chunk, distances);
    this.shownFrame = index;
    return true;
  }

  /// Asks for the frames that will be shown next while it plays, in files that come after this one.
  /// Who leaves frames out has no time for files in between.
  prefetch(frameId, step) {
    const index = this.frameIndex(frameId);
    const {frames, chunk} = this.info;
    for (const ahead of index < 0 ? [] : [1, 2]) {
      this.chunk((index + ahead * Math.max(step, chunk)) % frames.length).catch(() => {});
    }
  }

  put(index, topology, chunk, distances) {
    if (!chunk.frames || this.problem) {
      this.setDrawn(false);
      return;
    }
    const offset = this.info.topology ? index % this.info.chunk : 0;
    const faces = topology?.arrays.faces ?? chunk.arrays.faces;
    if (this.faces !== faces) {
      this.setFaces(faces, topology?.arrays, chunk.frames.stride / 3);
    }
    this.setDrawn(true);
    const quantized = chunk.frames.at(offset);
    toMetres(quantized, chunk.header.low, chunk.header.step, this.places);
    vertexNormals(this.places, faces, this.normals);
    this.isStale = true;
    this.colorVertices(index, offset, topology, chunk, distances);
  }

  /// Whether there is a mesh in this frame.
  setDrawn(isDrawn) {
    this.isDrawn = isDrawn;
    this.mesh.geometry.setDrawRange(0, isDrawn ? Infinity : 0);
  }

  setFaces(faces, arrays, vertices) {
    this.faces = faces;
    this.places = new Float32Array(3 * vertices);
    this.normals = new Float32Array(3 * vertices);
    this.sources = null;
    let index = faces;
    let places = null;
    if (arrays?.uv_faces) {  // a vertex for each pair of place and texture coordinate
      const numbers = new Map();
      const sources = [];
      const coordinates = [];
      index = new Uint32Array(faces.length);
      for (let i = 0; i < faces.length; ++i) {
        const pair = faces[i] * 2 ** 26 + arrays.uv_faces[i];
        if (!numbers.has(pair)) {
          numbers.set(pair, sources.length);
          sources.push(faces[i]);
          coordinates.push(arrays.uvs[2 * arrays.uv_faces[i]], arrays.uvs[2 * arrays.uv_faces[i] + 1]);
        }
        index[i] = numbers.get(pair);
      }
      this.sources = Uint32Array.from(sources);
      places = Float32Array.from(coordinates);
    }
    const count = this.sources?.length ?? vertices;
    this.mesh.geometry.dispose();
    const geometry = new THREE.BufferGeometry();
    const attribute = size => {
      const one = new THREE.BufferAttribute(new Float32Array(size * count), size);
      one.setUsage(THREE.DynamicDrawUsage);
      return one;
    };
    geometry.setIndex(new THREE.BufferAttribute(index, 1));
    geometry.setAttribute("position", attribute(3));
    geometry.setAttribute("normal", attribute(3));
    geometry.setAttribute("number", attribute(1));
    geometry.setAttribute("tint", attribute(3));
    geometry.setAttribute("place", places ? new THREE.BufferAttribute(places, 2) : attribute(2));
    this.mesh.geometry = geometry;
  }

  /// Gives WebGL what has changed.
  upload() {
    if (this.isStale && this.places) {
      this.isStale = false;
      const {position, normal, number, tint} = this.mesh.geometry.attributes;
      this.spread(this.places, position, 3);
      this.spread(this.normals, normal, 3);
      if (this.mode === kScaled) {
        this.spread(this.numbers, number, 1);
      } else if (this.mode === kTinted) {
        this.spread(this.tints, tint, 3);
      }
    }
  }

  /// What a rasterizer takes.
  forRasterizer() {
    const {places, normals, faces, uniforms} = this;
    const {keyLight, toViewer, shade} = uniforms;
    const isScaled = this.mode === kScaled, isTextured = this.mode === kTextured;
    return {places, normals, faces, tints: this.mode === kTinted ? this.tints : null,
      scale: isScaled ? {shares: this.shares(), row: scaleTexture.image.data} : null,
      texture: isTextured ? this.texels() : null,
      base: isScaled || isTextured ? [1, 1, 1] : this.color.map(c => c / 255), closed: this.info.role === "body",
      light: {key: keyLight.value, viewer: toViewer.value, shade: shade.value}};
  }

  /// The texture as a rasterizer takes it: pixels as numbers, texture coordinates of the faces' corners [F*3*2].
  texels() {
    const kMost = 1024;  // px, a side: a body covers fewer on a screen
    if (!this.pixels) {
      const {naturalWidth: wide, naturalHeight: high} = this.image.image;
      const width = Math.min(wide, kMost), height = Math.min(high, kMost);
      const context = element("canvas", {width, height}).getContext("2d", {willReadFrequently: true});
      context.imageSmoothingQuality = "high";
      context.drawImage(this.image.image, 0, 0, width, height);
      this.pixels = {width, height, colors: new Uint32Array(context.getImageData(0, 0, width, height).data.buffer)};
    }
    if (this.cornersOf !== this.faces) {
      this.cornersOf = this.faces;
      const {index, attributes: {place}} = this.mesh.geometry;
      this.corners = new Float32Array(2 * index.count);
      for (let i = 0; i < index.count; ++i) {
        this.corners[2 * i] = place.array[2 * index.array[i]];
        this.corners[2 * i + 1] = place.array[2 * index.array[i] + 1];
      }
    }
    return {...this.pixels, corners: this.corners};
  }

  /// Numbers of vertices as shares of the scale.
  shares() {
    const {x: low, y: high} = this.uniforms.range.value;
    return this.numbers.map(number => (number - low) / Math.max(high - low, 1e-9));
  }

  /// Copies numbers of vertices to those that are drawn.
  spread(values, attribute, size) {
    const {array} = attribute;
    if (!this.sources) {
      array.set(values.subarray(0, array.length));
    } else {
      for (let i = 0; i < this.sources.length; ++i) {
        for (let k = 0; k < size; ++k) {
          array[size * i + k] = values[size * this.sources[i] + k];
        }
      }
    }
    attribute.needsUpdate = true;
  }

  setMode(mode) {
    this.mode = mode;
    this.isStale = true;
    const {material} = this.mesh;
    if (material.defines.MODE !== mode) {
      material.defines.MODE = mode;
      material.needsUpdate = true;
    }
  }

  setNumbers(values, low, high) {
    this.numbers = values;
    this.uniforms.range.value.set(low, high);
    this.setMode(kScaled);
  }

  setTints(vertexColor) {
    const tints = this.tints = new Float32Array(this.places.length);
    for (let v = 0; v < tints.length / 3; ++v) {
      const [r, g, b] = vertexColor(v);
      tints[3 * v] = r / 255;
      tints[3 * v + 1] = g / 255;
      tints[3 * v + 2] = b / 255;
    }
    this.setMode(kTinted);
  }

  colorVertices(index, offset, topology, chunk, distances) {
    const vertices = this.places.length / 3;
    const {arrays} = chunk;
    this.learn(arrays);
    this.uniforms.shade.value = ["strain", "distance", "confidence"].includes(this.coloring) ? 0.6 : 1;
    if (this.lit >= 0 && topology?.arrays.pattern_faces) {
      this.tintPanel(this.lit, topology);
    } else if (this.coloring === "strain" && topology?.arrays.rest) {
      const strain = faceStrain(this.places, this.faces, topology.arrays.rest);
      this.setNumbers(faceToVertex(strain, this.faces, vertices), 0, this.strainHigh);
    } else if (this.coloring === "distance" && distances) {
      this.setNumbers(Float32Array.from(distances.values.subarray(offset * vertices, (offset + 1) * vertices)), 0, 255);
    } else if (this.coloring === "confidence" && arrays.confidence) {
      this.setNumbers(Float32Array.from(arrays.confidence.subarray(offset * vertices, (offset + 1) * vertices)), 0, 255);
    } else if (this.coloring === "colors" && arrays.colors) {
      this.setTints(v => arrays.colors.subarray(3 * v, 3 * v + 3));
    } else if (this.coloring === "labels" && arrays.labels) {
      this.setTints(v => labelColor(arrays.labels[v]));
    } else if (this.coloring === "texture" && this.image) {
      this.uniforms.map.value = this.image;
      this.setMode(kTextured);
    } else if (this.coloring === "panels" && topology?.arrays.pattern_faces) {
      const colors = new Uint8Array(3 * vertices);
      const {panels} = this.panels(topology);
      for (let f = 0; f < panels.length; ++f) {
        const color = cssColor(numberColor(panels[f]));
        for (let k = 0; k < 3; ++k) {
          colors.set(color, 3 * this.faces[3 * f + k]);
        }
      }
      this.setTints(v => colors.subarray(3 * v, 3 * v + 3));
    } else {
      this.setMode(kPlain);
    }
  }

  panels(topology) {
    this.foundPanels ??= panelsOf(topology.arrays.pattern_faces, topology.arrays.pattern.length / 2);
    return this.foundPanels;
  }

  /// Lights up the faces of a panel.
  tintPanel(panel, topology) {
    const {panels} = this.panels(topology);
    const marked = new Uint8Array(this.places.length / 3);
    for (let f = 0; f < panels.length; ++f) {
      if (panels[f] === panel) {
        marked[this.faces[3 * f]] = marked[this.faces[3 * f + 1]] = marked[this.faces[3 * f + 2]] = 255;
      }
    }
    this.setTints(v => marked[v] ? kLit : this.color);
  }

  /// Figures of the frames of the timeline, in SI units, as far as they are known.
  series() {
    const {name, topology} = this.info;
    const {frames} = this;
    const one = (values, what, unit, scale) => ({stage: name, name: what, unit, frames,
      values: () => frames.map((_, i) => Number.isFinite(values[i]) ? scale * values[i] : null)});
    return !topology || frames.length === 1 ? [] : [
      one(this.figures.deviation, "deviation of edges from the frames beside", "mm", 1000),
      ...(this.info.strain ? [one(this.figures.strain, "strain, 99.5th percentile", "%", 100)] : []),
    ];
  }

  /// Figures of a file's frames.
  tellFigures(first, chunk, {faces, rest}) {
    if (!chunk.frames) {
      return;
    }
    this.edges ??= edgesOf(faces);
    const {deviation, strain} = this.figures;
    const places = new Float32Array(chunk.frames.stride);
    chunk.frames.all().forEach((quantized, f) => {
      const index = first + f;
      const lengths = edgeLengths(quantized, this.edges, chunk.header.step);
      const run = this.runs.find(({end}) => index < end);
      const [before, middle] = index === run.first ? [] : this.lastLengths ?? [];
      this.lastLengths = [middle, lengths];
      const tell = (frame, {value, at}) => {
        deviation[frame] = chunk.missing.has(this.info.frames[frame]) ? NaN : value;
        this.worst.deviation[frame] = this.edges[2 * at] / 3;
      };
      if (before) {
        tell(index - 1, largestDeviation(middle, before, lengths));
      }
      if (before && index === run.first + 2) {
        tell(run.first, deviationAtEnd(before, middle, lengths));
      }
      tell(index, middle ? deviationAtEnd(lengths, middle, before ?? middle) : {value: 0, at: 0});  // until the next is known
      if (chunk.missing.has(this.info.frames[index])) {
        strain[index] = NaN;
        return;
      }
      if (rest) {
        toMetres(quantized, chunk.header.low, chunk.header.step, places);
        const all = faceStrain(places, faces, rest);
        this.worst.strain[index] = faces[3 * all.reduce((best, value, face) => value > all[best] ? face : best, 0)];
        all.sort();
        strain[index] = all[Math.floor(0.995 * (all.length - 1))];
      }
    });
  }

  /// Figures of the next frames, one file of them: not when they are shown, which they would hold
  /// up. @return whether there were any
  async surveyNext() {
    const first = this.surveyed ?? 0;
    if (!this.info.topology || first >= this.info.frames.length) {
      this.lastLengths = null;
      return false;
    }
    this.surveyed = first + this.info.chunk;
    const {arrays} = await this.topology();
    const chunk = chunkCache.peek(this.chunkKey(first)) ?? this.decode(await loadData(this.chunkKey(first))).value;
    this.unreadable.push(...chunk.missing);
    this.tellFigures(first, chunk, arrays);
    return true;
  }

  async loadTexture() {
    const {header} = await chunkless(this.info.data + "/texture");
    if (header.image) {
      const texture = new THREE.Texture(await imageOf(header.image));
      texture.needsUpdate = true;
      this.image = texture;
    }
  }
}

function chunkless(key) {
  return chunkCache.get(key, data => ({value: data, bytes: 0}));
}

const kColors = new Map();

/// sRGB bytes of a colour of CSS.
function cssColor(text) {
  if (!kColors.has(text)) {
    const color = new THREE.Color().setStyle(text, THREE.SRGBColorSpace);
    const {r, g, b} = color.getRGB({}, THREE.SRGBColorSpace);
    kColors.set(text, [255 * r, 255 * g, 255 * b]);
  }
  return kColors.get(text);
}
