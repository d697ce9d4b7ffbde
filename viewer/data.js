// Files of the page: scripts that call atelierData(key, header, text), since a page that lies on a
// disk may load scripts and nothing else.

const waiting = new Map();  // key -> {promise, resolve, reject}, while its script is on the way

globalThis.atelierData = (key, header, text) => {
  const asked = waiting.get(key);
  waiting.delete(key);
  if (asked) {
    unpack(header, text).then(asked.resolve, asked.reject);
  }
};

/// What a file holds: {header, arrays}, arrays by name. Who asks for a file that is on its way waits
/// for the same: a script answers once.
export function loadData(key) {
  const asked = waiting.get(key) ?? {};
  asked.promise ??= new Promise((resolve, reject) => {
    Object.assign(asked, {resolve, reject});
    waiting.set(key, asked);
    const script = document.createElement("script");
    script.src = key + ".js";
    const fail = why => {
      waiting.delete(key);
      reject(new Error(`${key}.js ${why}`));
    };
    script.onload = () => {
      script.remove();
      if (waiting.get(key) === asked) {  // it ran and did not answer
        fail("is damaged: write or serve the page again");
      }
    };
    script.onerror = () => {
      script.remove();
      fail("cannot be loaded: " + (location.protocol === "file:" ? "the page's folder is not complete" : "is atelier view still running?"));
    };
    document.head.append(script);
  });
  return asked.promise;
}

async function unpack(header, text) {
  const arrays = {};
  if (text) {
    // Without a Blob, whose bytes would go to another process and back.
    const inflater = new DecompressionStream("deflate");
    const writer = inflater.writable.getWriter();
    writer.write(bytesOf(text)).catch(() => {});  // what is wrong with them is told by the reader
    writer.close().catch(() => {});
    const buffer = await new Response(inflater.readable).arrayBuffer();
    const types = {Uint8Array, Uint16Array, Uint32Array, Float32Array};
    for (const {name, type, offset, count} of header.arrays) {
      arrays[name] = new types[type](buffer, offset, count);
    }
  }
  return {header, arrays};
}

function bytesOf(text) {
  if (Uint8Array.fromBase64) {
    return Uint8Array.fromBase64(text);
  }
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; ++i) {
    bytes[i] = binary.charCodeAt(i);
  }
  return bytes;
}

/// Loaded files, the least recently asked for dropped once they are more than so many bytes.
export class DataCache {
  constructor(maxBytes) {
    this.maxBytes = maxBytes;
    this.bytes = 0;
    this.entries = new Map();  // key -> {promise, value, bytes}, least recently used first
  }

  /// The value if it is there now, else undefined.
  peek(key) {
    const entry = this.entries.get(key);
    if (entry?.value) {
      this.entries.delete(key);
      this.entries.set(key, entry);
    }
    return entry?.value;
  }

  /// @param make  of the loaded file: {value, bytes}
  get(key, make) {
    const there = this.entries.get(key);
    if (there) {
      this.entries.delete(key);
      this.entries.set(key, there);
      return there.promise;
    }
    const entry = {bytes: 0};
    entry.promise = loadData(key).then(data => {
      const {value, bytes} = make(data);
      entry.value = value;
      entry.bytes = bytes;
      this.bytes += bytes;
      this.trim();
      return value;
    });
    entry.promise.catch(() => this.entries.delete(key));  // to be tried again
    this.entries.set(key, entry);
    return entry.promise;
  }

  trim() {
    let left = this.entries.size;
    for (const [key, entry] of this.entries) {
      if (this.bytes <= this.maxBytes || --left === 0) {  // the last is needed now
        return;
      }
      if (entry.value) {
        this.entries.delete(key);
        this.bytes -= entry.bytes;
      }
    }
  }
}

export const byId = id => document.getElementById(id);

const kTold = 10000;  // ms until a sentence that is no error has been read

let toldUntil = 0;

/// The sentence over the view.
export function say(text, bad = false) {
  byId("message").textContent = text;
  byId("message").classList.toggle("bad", bad);
  clearTimeout(toldUntil);
  toldUntil = text && !bad ? setTimeout(say, kTold, "") : 0;
}

export function element(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("aria") || name === "role" || name.startsWith("data-")) {
      node.setAttribute(name.replace(/^aria([A-Z])/, (_, c) => "aria-" + c.toLowerCase()), value);
    } else {
      node[name] = value;
    }
  }
  node.append(...children);  // strings become text: nothing of a file is markup
  return node;
}

/// Puts other parts into a box; what had the focus there hands it to the part of the same name.
export function refill(box, ...parts) {
  const nameOf = one => one.tagName + (one.id || one.getAttribute("aria-label") || one.labels?.[0]?.textContent || one.textContent);
  const named = name => [...box.querySelectorAll("button, input, select, [tabindex]")].filter(one => nameOf(one) === name);
  const had = document.activeElement;
  const name = box.contains(had) ? nameOf(had) : null;
  const number = name === null ? -1 : named(name).indexOf(had);
  box.replaceChildren(...parts);
  if (name !== null) {
    (named(name)[number] ?? named(name)[0])?.focus();
  }
}

export function imageOf(address) {
  return new Promise((resolve, reject) => {
    const image = new Image();
    image.onload = () => resolve(image);
    image.onerror = () => reject(new Error("an image cannot be decoded"));
    image.src = address;
  });
}
