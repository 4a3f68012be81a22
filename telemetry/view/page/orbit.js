// SPDX-License-Identifier: BSD-3-Clause
// A viewpoint that turns around a target by mouse and touch, and may follow the drone. World: z up.
const FIELD = 50 * Math.PI / 180;
const mix = (a, b, share) => a + (b - a) * share;
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

export class Orbit {
  constructor(canvas, onFree) {
    this.mode = 'follow';
    this.target = [0, 0, 0];
    this.heading = 0;  // of the drone, smoothed
    this.yaw = 0;      // from the heading where it follows, else from x
    this.pitch = 0.62;
    this.distance = 12;
    this.scale = 6;    // metres, of what is to be seen
    this.zoom = 1;     // of the user
    this.onFree = onFree;
    this.bounds = null;
    this.listen(canvas);
  }

  setMode(mode) {
    if (mode === 'free') {
      this.yaw = this.azimuth();
    } else {
      this.yaw = 0;
      this.zoom = 1;
      this.pitch = mode === 'above' ? 1.45 : 0.62;
    }
    this.mode = mode;
  }

  azimuth() { return this.mode === 'follow' ? this.heading + this.yaw : this.yaw; }

  // place, direction: of the drone. bounds: of the map. seconds: since the last call.
  follow(place, direction, bounds, seconds) {
    this.bounds = bounds;
    const share = (time) => 1 - Math.exp(-seconds / time);
    if (this.mode === 'follow' && place) {
      const flat = Math.hypot(direction[0], direction[1]);
      if (flat > 0.2) {
        const turn = Math.atan2(direction[1], direction[0]) - this.heading;
        this.heading += Math.atan2(Math.sin(turn), Math.cos(turn)) * share(1.2);
      }
      const ahead = 0.5 * this.scale;
      const target = [place[0] + ahead * Math.cos(this.heading), place[1] + ahead * Math.sin(this.heading), place[2]];
      this.move(target, 2.7 * this.scale * this.zoom, share(0.35));
    } else if (this.mode === 'above' && bounds) {
      const target = [0, 1, 2].map((i) => (bounds.least[i] + bounds.most[i]) / 2);
      const aspect = innerWidth / innerHeight;
      const size = Math.max((bounds.most[1] - bounds.least[1]) / aspect, bounds.most[0] - bounds.least[0], 2);
      this.move(target, 0.62 * size / Math.tan(FIELD / 2) * this.zoom, share(0.35));
    }
  }

  move(target, distance, share) {
    const jump = Math.hypot(...this.target.map((t, i) => t - target[i])) > 40 * this.distance;
    this.target = this.target.map((t, i) => mix(t, target[i], jump ? 1 : share));
    this.distance = mix(this.distance, distance, jump ? 1 : share);
  }

  eye() {
    const a = this.azimuth();
    return [this.target[0] - this.distance * Math.cos(this.pitch) * Math.cos(a),
            this.target[1] - this.distance * Math.cos(this.pitch) * Math.sin(a),
            this.target[2] + this.distance * Math.sin(this.pitch)];
  }

  // Projection times view.
  matrix(aspect) {
    const a = this.azimuth(), eye = this.eye();
    const ahead = [Math.cos(this.pitch) * Math.cos(a), Math.cos(this.pitch) * Math.sin(a), -Math.sin(this.pitch)];
    const right = [Math.sin(a), -Math.cos(a), 0];
    const up = [Math.sin(this.pitch) * Math.cos(a), Math.sin(this.pitch) * Math.sin(a), Math.cos(this.pitch)];
    const f = 1 / Math.tan(FIELD / 2) / Math.max(1, 0.75 / aspect);
    const near = this.distance / 200, far = this.distance * 100;
    const k = (far + near) / (far - near), m = -2 * far * near / (far - near);
    const shift = (axis) => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
    const column = (i) => [f / aspect * right[i], f * up[i], k * ahead[i], ahead[i]];
    return new Float32Array([...column(0), ...column(1), ...column(2),
                             f / aspect * shift(right), f * shift(up), k * shift(ahead) + m, shift(ahead)]);
  }

  turn(dx, dy) {
    this.yaw -= dx * 0.006;
    this.pitch = clamp(this.pitch + dy * 0.006, -0.2, 1.5);
    if (this.mode === 'above') this.free();
  }

  pan(dx, dy) {
    this.free();
    const unit = this.distance * Math.tan(FIELD / 2) * 2 / innerHeight, a = this.azimuth();
    const [x, y] = [-dx * unit, dy * unit];
    this.target[0] += x * Math.sin(a) + y * Math.cos(a);
    this.target[1] += -x * Math.cos(a) + y * Math.sin(a);
  }

  scaleBy(factor) {
    this.zoom = clamp(this.zoom * factor, 0.05, 20);
    this.distance = clamp(this.distance * factor, 0.2, 5000);
  }

  free() {
    if (this.mode === 'free') return;
    this.setMode('free');
    this.onFree();
  }

  listen(canvas) {
    const fingers = new Map();
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, size: Math.hypot(a.x - b.x, a.y - b.y)};
    };
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    });
    canvas.addEventListener('pointermove', (event) => {
      const finger = fingers.get(event.pointerId);
      if (!finger) return;
      const before = fingers.size === 2 ? spread() : null;
      const [dx, dy] = [event.clientX - finger.x, event.clientY - finger.y];
      Object.assign(finger, {x: event.clientX, y: event.clientY});
      if (before) {
        const now = spread();
        if (before.size > 0 && now.size > 0) this.scaleBy(before.size / now.size);
        if (Math.hypot(now.x - before.x, now.y - before.y) > 0.5) this.pan(now.x - before.x, now.y - before.y);
      } else if (event.buttons & 2 || event.shiftKey) {
        this.pan(dx, dy);
      } else if (fingers.size === 1) {
        this.turn(dx, dy);
      }
    });
    for (const name of ['pointerup', 'pointercancel'])
      canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.scaleBy(Math.exp(clamp(event.deltaY, -120, 120) * 0.0015));
    }, {passive: false});
  }
}
