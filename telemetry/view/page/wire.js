// SPDX-License-Identifier: BSD-3-Clause
// Reads the changes of the map (telemetry/view/map_feed.hpp).
const HEADER = 24;
const FORGET = 1, MORE = 2;

// Fetches what changed since the last call and hands each part to take(header, view, offset).
export class Feed {
  constructor(path, take) {
    this.path = path;
    this.take = take;
    this.revision = 0;
    this.submap = 0xffffffff;
  }

  async update() {
    for (;;) {
      const reply = await fetch(`${this.path}?since=${this.revision}&submap=${this.submap}`);
      if (!reply.ok) throw new Error(`${this.path}: ${reply.status}`);
      const view = new DataView(await reply.arrayBuffer());
      const flags = view.getUint32(0, true);
      const header = {
        forget: (flags & FORGET) !== 0,
        count: view.getUint32(8, true),
        submap: view.getUint32(12, true),
        side: view.getFloat32(16, true),
        total: view.getUint32(20, true),
      };
      this.revision = view.getUint32(4, true);
      this.submap = header.submap;
      this.take(header, view, HEADER);
      if ((flags & MORE) === 0) return;
    }
  }
}

const floats = (view, at, n) => Array.from({length: n}, (_, i) => view.getFloat32(at + 4 * i, true));

export function* keyframes(header, view, at) {
  for (let i = 0; i < header.count; ++i, at += 36)
    yield {id: view.getUint32(at, true), submap: view.getUint32(at + 4, true), pose: floats(view, at + 8, 7)};
}

export function* poses(header, view, at) {
  for (let i = 0; i < header.count; ++i, at += 16)
    yield {index: view.getUint32(at, true), x: view.getFloat32(at + 4, true), y: view.getFloat32(at + 8, true),
           z: view.getFloat32(at + 12, true)};
}

export function* blocks(header, view, at) {
  for (let i = 0; i < header.count; ++i) {
    const n = view.getUint32(at + 12, true);
    yield {index: [view.getInt32(at, true), view.getInt32(at + 4, true), view.getInt32(at + 8, true)],
           bytes: new Uint8Array(view.buffer.slice(at + 16, at + 16 + 6 * n))};
    at += 16 + 6 * n;
  }
}
