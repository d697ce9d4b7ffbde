// The viewer's own camera: turns round a place, goes nearer, moves across. Angles in radians,
// lengths in metres.

/// Of what is seen, from top to bottom, in degrees.
export const kViewAngle = 36;
const kHalfAngle = kViewAngle / 2 * Math.PI / 180;

const kStill = 4;  // px that a hand moves in a click

export class Orbit {
  constructor() {
    this.target = [0, 0.9, 0];
    this.azimuth = 0.5;
    this.elevation = 0.12;
    this.distance = 3.2;
    this.dragged = 0;  // px, since a button or finger went down last: 0 of a click
  }

  /// A box [low, high] fills a view of `aspect` times its height in width.
  frame(low, high, aspect) {
    this.target = low.map((l, k) => (l + high[k]) / 2);
    // A view that is narrower than high cuts a ball off at its sides first.
    const narrow = Math.sin(kHalfAngle) / Math.sin(Math.atan(Math.min(aspect, 1) * Math.tan(kHalfAngle)));
    this.distance = 1.7 * narrow * Math.max(Math.hypot(...high.map((h, k) => h - low[k])), 0.05);
  }

  /// Turns to the side of `middle`, which comes into the middle, on which a place is.
  face([x, , z], middle) {
    this.target = [middle[0], this.target[1], middle[2]];
    const dx = x - middle[0], dz = z - middle[2];
    if (Math.hypot(dx, dz) > 1e-3) {
      this.azimuth = Math.atan2(dx, dz);
    }
  }

  turn(dx, dy) {
    this.azimuth -= dx;
    this.elevation = Math.min(Math.max(this.elevation + dy, -1.55), 1.55);
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.02), 200);
  }

  /// Across the view, in shares of its height.
  move(right, up) {
    const scale = 0.8 * this.distance;
    const {azimuth: a, elevation: e} = this;
    const x = [Math.cos(a), 0, -Math.sin(a)];
    const y = [-Math.sin(a) * Math.sin(e), Math.cos(e), -Math.cos(a) * Math.sin(e)];
    this.target = this.target.map((t, k) => t - scale * (right * x[k] + up * y[k]));
  }

  apply(camera) {
    const {azimuth: a, elevation: e, distance: d, target} = this;
    camera.position.set(target[0] + d * Math.sin(a) * Math.cos(e), target[1] + d * Math.sin(e),
      target[2] + d * Math.cos(a) * Math.cos(e));
    camera.up.set(0, 1, 0);
    camera.lookAt(target[0], target[1], target[2]);
  }

  text() {
    return [...this.target, this.azimuth, this.elevation, this.distance].map(x => (Number(x.toFixed(4)) + 0).toFixed(4)).join(",");
  }

  read(text) {
    const numbers = text.split(",").map(Number);
    if (numbers.length === 6 && numbers.every(Number.isFinite) && numbers[5] > 0) {
      this.target = numbers.slice(0, 3);
      [this.azimuth, this.elevation, this.distance] = numbers.slice(3);
    }
  }

  /// Mouse, touch and wheel on an element; `changed` after each.
  listen(element, changed) {
    const fingers = new Map();
    let spread = 0;
    element.addEventListener("pointerdown", event => {
      element.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      spread = 0;
      this.dragged = 0;
    });
    element.addEventListener("pointermove", event => {
      const before = fingers.get(event.pointerId);
      if (!before) {
        return;
      }
      const dx = event.clientX - before[0], dy = event.clientY - before[1];
      if (this.dragged === 0 && Math.hypot(dx, dy) < kStill) {
        return;
      }
      this.dragged += Math.hypot(dx, dy);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      const height = element.clientHeight;
      if (fingers.size === 2) {
        const [p, q] = [...fingers.values()];
        const now = Math.hypot(p[0] - q[0], p[1] - q[1]);
        if (spread > 0 && now > 0) {
          this.zoom(spread / now);
        }
        spread = now;
        this.move(dx / height / 2, -dy / height / 2);
      } else if (event.buttons === 2 || event.buttons === 4 || event.shiftKey) {
        this.move(dx / height, -dy / height);
      } else {
        this.turn(5 * dx / height, 4 * dy / height);
      }
      changed();
    });
    const end = event => fingers.delete(event.pointerId);
    element.addEventListener("pointerup", end);
    element.addEventListener("pointercancel", end);
    element.addEventListener("contextmenu", event => event.preventDefault());
    element.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoom(Math.exp(0.0012 * event.deltaY));
      changed();
    }, {passive: false});
  }
}
