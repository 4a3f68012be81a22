// SPDX-License-Identifier: BSD-3-Clause
// The map as it is drawn: surfaces, landmarks, keyframes, path, loops and the drone.
import {Painter} from './gl.js';
import {blocks, keyframes, poses} from './wire.js';

const CHUNK = 16;  // metres of a cube whose surfaces are drawn at once
const COLOURS = {path: [92, 200, 255], keyframe: [126, 152, 190], drone: [255, 212, 121], loop: [196, 140, 255],
                 grid: [255, 255, 255]};

const rotate = ([w, x, y, z], [a, b, c]) => {
  const t = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * t[0] + y * t[2] - z * t[1], b + w * t[1] + z * t[0] - x * t[2], c + w * t[2] + x * t[1] - y * t[0]];
};

// Of a camera at a pose (x y z qw qx qy qz): apex to corners and around them.
function frustum(pose, size, colour) {
  const place = pose.slice(0, 3), q = pose.slice(3);
  const corners = [[-0.8, -0.6], [0.8, -0.6], [0.8, 0.6], [-0.8, 0.6]].map(([x, y]) =>
    rotate(q, [x * size, y * size, size]).map((v, i) => v + place[i]));
  return corners.flatMap((corner, i) => [[...place, ...corner, ...colour],
                                         [...corner, ...corners[(i + 1) % 4], ...colour]]);
}

export class Scene {
  constructor(canvas, orbit) {
    this.painter = new Painter(canvas, [13 / 255, 16 / 255, 21 / 255]);
    this.canvas = canvas;
    this.orbit = orbit;
    this.layers = {dense: true, points: true, keyframes: true};
    this.submap = 0;      // that is shown
    this.keyframes = new Map();
    this.landmarks = new Map();  // id: [submap, DataView bytes]
    this.path = [];
    this.blocks = new Map();
    this.chunks = new Map();
    this.loops = [];
    this.pose = null;
    this.batches = {};
    for (const name of ['points']) this.batches[name] = this.painter.batch(false);
    for (const name of ['keyframes', 'path', 'loops', 'drone', 'grid']) this.batches[name] = this.painter.batch(true);
    this.stale = new Set();
    this.isLost = false;
    this.shown = '';  // what the last image was drawn from
    this.last = performance.now();
  }

  count() {
    let surfaces = 0;
    for (const chunk of this.chunks.values()) surfaces += chunk.batch.count;
    return {surfaces, landmarks: this.batches.points.count, path: this.path.length, keyframes: this.keyframes.size};
  }

  show(submap) {
    if (submap === this.submap) return;
    this.submap = submap;
    for (const name of ['points', 'keyframes', 'loops']) this.stale.add(name);
  }

  takeKeyframes(header, view, at) {
    if (header.forget) this.keyframes.clear();
    for (const {id, submap, pose} of keyframes(header, view, at))
      submap === 0xffffffff ? this.keyframes.delete(id) : this.keyframes.set(id, {submap, pose});
    if (header.count || header.forget) this.stale.add('keyframes').add('loops');
  }

  takePoints(header, view, at) {
    if (header.forget) this.landmarks.clear();
    for (let i = 0; i < header.count; ++i, at += 24) {
      const id = view.getUint32(at, true);
      if (view.getUint8(at + 23)) this.landmarks.delete(id);
      else this.landmarks.set(id, [view.getUint32(at + 4, true), new Uint8Array(view.buffer, at + 8, 15)]);
    }
    if (header.count || header.forget) this.stale.add('points');
  }

  takePath(header, view, at) {
    if (header.forget) this.path = [];
    for (const {index, x, y, z} of poses(header, view, at)) this.path[index] = [x, y, z];
    this.path.length = header.total;
    this.show(header.submap);
    if (header.count || header.forget) this.stale.add('path');
  }

  takeBlocks(header, view, at) {
    this.denseSubmap = header.submap;
    if (header.forget) {
      for (const chunk of this.chunks.values()) chunk.batch.free();
      this.blocks.clear();
      this.chunks.clear();
    }
    for (const {index, bytes} of blocks(header, view, at)) {
      const key = index.join();
      const home = index.map((i) => Math.floor(i * header.side / CHUNK)).join();
      let chunk = this.chunks.get(home);
      if (!chunk) this.chunks.set(home, chunk = {batch: this.painter.batch(false), keys: new Set()});
      bytes.length ? this.blocks.set(key, {index, bytes}) : this.blocks.delete(key);
      bytes.length ? chunk.keys.add(key) : chunk.keys.delete(key);
      chunk.isStale = true;
    }
    this.side = header.side;
  }

  takeLoops(loops) {
    this.loops = loops;
    this.stale.add('loops');
  }

  takePose(pose, isLost) {
    if (pose) this.pose = pose;
    this.isLost = isLost;
    this.stale.add('drone');
  }

  // Whether anything was rebuilt.
  rebuild() {
    const isStale = this.stale.size > 0;
    for (const name of this.stale) this[`rebuild_${name}`]();
    this.stale.clear();
    let chunks = 0;
    for (const chunk of this.chunks.values())
      if (chunk.isStale && ++chunks <= 8) this.rebuildChunk(chunk);  // the others with the next image
    return isStale || chunks > 0;
  }

  rebuildChunk(chunk) {
    let count = 0;
    for (const key of chunk.keys) count += this.blocks.get(key).bytes.length / 6;
    const floats = new Float32Array(4 * count), bytes = new Uint8Array(floats.buffer), unit = this.side / 256;
    let n = 0;
    for (const key of chunk.keys) {
      const {index, bytes: points} = this.blocks.get(key);
      for (let i = 0; i < points.length; i += 6, ++n) {
        for (let k = 0; k < 3; ++k) floats[4 * n + k] = index[k] * this.side + (points[i + k] + 0.5) * unit;
        bytes.set(points.subarray(i + 3, i + 6), 16 * n + 12);
      }
    }
    chunk.batch.fill(floats, count);
    chunk.isStale = false;
  }

  rebuild_points() {
    const bytes = new Uint8Array(16 * this.landmarks.size), floats = new Float32Array(bytes.buffer);
    let n = 0;
    const distances = [];
    for (const [submap, record] of this.landmarks.values()) {
      if (submap !== this.submap) continue;
      bytes.set(record, 16 * n);
      for (let k = 12; k < 15; ++k) bytes[16 * n + k] = 70 + 0.72 * bytes[16 * n + k];  // bright on the dark ground
      if (this.pose && n % 7 === 0)
        distances.push(Math.hypot(...[0, 1, 2].map((k) => floats[4 * n + k] - this.pose[k])));
      ++n;
    }
    this.batches.points.fill(bytes.subarray(0, 16 * n), n);
    distances.sort((a, b) => a - b);
    if (distances.length > 10) this.orbit.scale = Math.min(Math.max(distances[distances.length * 0.3 | 0], 0.7), 9);
    this.bounds = this.boundsOf(floats, n);
    this.rebuild_grid();
  }

  // Without the farthest landmarks.
  boundsOf(floats, n) {
    if (n < 20) return null;
    const axes = [0, 1, 2].map((k) => Float32Array.from({length: n}, (_, i) => floats[4 * i + k]).sort());
    const least = axes.map((a) => a[n * 0.02 | 0]), most = axes.map((a) => a[n * 0.98 | 0]);
    for (const place of this.path)
      for (let k = 0; k < 3; ++k) {
        least[k] = Math.min(least[k], place[k]);
        most[k] = Math.max(most[k], place[k]);
      }
    return {least, most};
  }

  rebuild_grid() {
    if (!this.bounds) return;
    const {least, most} = this.bounds, lines = [];
    const size = Math.max(most[0] - least[0], most[1] - least[1]);
    const step = [0.25, 0.5, 1, 2, 5, 10, 20, 50, 100].find((s) => size / s < 30) || 200;
    const from = [0, 1].map((k) => Math.floor(least[k] / step - 2) * step);
    const to = [0, 1].map((k) => Math.ceil(most[k] / step + 2) * step), z = least[2];
    const colour = (v) => [...COLOURS.grid, Math.round(v / step) % 5 ? 14 : 30];
    for (let x = from[0]; x <= to[0] + 1e-3; x += step) lines.push([x, from[1], z, x, to[1], z, ...colour(x)]);
    for (let y = from[1]; y <= to[1] + 1e-3; y += step) lines.push([from[0], y, z, to[0], y, z, ...colour(y)]);
    this.batches.grid.fillLines(lines);
  }

  rebuild_keyframes() {
    const lines = [], size = 0.05 * this.orbit.scale;
    for (const {submap, pose} of this.keyframes.values())
      if (submap === this.submap) lines.push(...frustum(pose, size, [...COLOURS.keyframe, 95]));
    this.batches.keyframes.fillLines(lines);
  }

  rebuild_path() {
    const lines = [];
    let from = this.path[0];
    for (let i = 1; i < this.path.length; ++i) {
      const to = this.path[i], last = i === this.path.length - 1;
      const length = Math.hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
      if (length < 0.01 * this.orbit.scale && !last) continue;
      const age = 0.45 + 0.55 * i / this.path.length;
      lines.push([...from, ...to, ...COLOURS.path.map((c) => c * age), 255]);
      from = to;
    }
    this.batches.path.fillLines(lines);
    this.stale.add('drone');
  }

  rebuild_loops() {
    const lines = [];
    for (const {keyframe, matched} of this.loops) {
      const [a, b] = [this.keyframes.get(keyframe), this.keyframes.get(matched)];
      if (a && b && a.submap === this.submap && b.submap === this.submap)
        lines.push([...a.pose.slice(0, 3), ...b.pose.slice(0, 3), ...COLOURS.loop, 230]);
    }
    this.batches.loops.fillLines(lines);
  }

  rebuild_drone() {
    if (!this.pose) return;
    const colour = [...(this.isLost ? [255, 112, 112] : COLOURS.drone), 255];
    const lines = frustum(this.pose, 0.11 * this.orbit.scale, colour);
    const end = this.path[this.path.length - 1], place = this.pose.slice(0, 3);
    if (end && !this.isLost && Math.hypot(...end.map((v, i) => v - place[i])) < 3 * this.orbit.scale)
      lines.push([...end, ...place, ...COLOURS.path, 255]);
    this.batches.drone.fillLines(lines);
  }

  draw() {
    const now = performance.now(), seconds = (now - this.last) / 1000;
    if (seconds < 0.03) return;  // 30 images a second are enough
    this.last = now;
    const isRebuilt = this.rebuild();
    const direction = this.pose ? rotate(this.pose.slice(3), [0, 0, 1]) : [1, 0, 0];
    this.orbit.follow(this.pose && this.pose.slice(0, 3), direction, this.bounds, Math.min(seconds, 0.5));
    const {canvas} = this, matrix = this.orbit.matrix(canvas.clientWidth / canvas.clientHeight);
    const shown = [...matrix.map((v) => Math.fround(v).toPrecision(5)), canvas.clientWidth, canvas.clientHeight,
                   ...Object.values(this.layers)].join();
    if (!isRebuilt && shown === this.shown) return;
    this.shown = shown;
    const {painter, batches, layers} = this;
    painter.begin(matrix);
    const fog = Math.max(this.orbit.distance * 6, 30);
    const dense = [...this.chunks.values()].map((chunk) => chunk.batch).filter((batch) => batch.count);
    const hasDense = layers.dense && dense.length > 0;
    if (hasDense) painter.drawPoints(dense, {size: (this.side || 0.4) / 8 * 1.6, least: 1.6, most: 40, fog});
    if (layers.points)
      painter.drawPoints([batches.points], {size: 0.012 * this.orbit.scale, least: hasDense ? 1.4 : 1.8, most: 7, fog,
                                            isRound: true});
    painter.drawLines(batches.grid, 0.5);
    if (layers.keyframes) painter.drawLines(batches.keyframes, 0.6);
    painter.drawLines(batches.loops, 1.1, false);
    painter.drawLines(batches.path, 1.6, false);
    painter.drawLines(batches.drone, 1.3, false);
  }
}
