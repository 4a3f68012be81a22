// SPDX-License-Identifier: BSD-3-Clause
// Quality, latency and dropped frames of the last minute.
const SECONDS = 60;

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.samples = [];
  }

  // Of an event that has just come.
  add(event) {
    const now = performance.now() / 1000, last = this.samples[this.samples.length - 1];
    this.samples.push({at: now, quality: event.quality, latency: 1000 * event.latency,
                       drops: last ? Math.max(event.dropped - last.all, 0) : 0, all: event.dropped,
                       isLost: event.pose === null});
    while (this.samples.length && now - this.samples[0].at > SECONDS) this.samples.shift();
  }

  draw() {
    const {canvas} = this, ratio = Math.min(devicePixelRatio || 1, 2);
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio)) Object.assign(canvas, {width: width * ratio, height: height * ratio});
    const pen = canvas.getContext('2d');
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = '11px system-ui, sans-serif';
    const newest = this.samples[this.samples.length - 1];
    const latencies = this.samples.map((s) => s.latency).sort((a, b) => a - b);
    const slowest = Math.max(50, 1.2 * (latencies[latencies.length * 0.97 | 0] || 0));
    const worst = Math.max(4, ...this.samples.map((s) => s.drops));
    const row = height / 3, number = (v) => v.toFixed(v < 10 ? 1 : 0);
    this.strip(pen, 0, row, width, 'quality', newest && number(newest.quality * 100) + ' %', '#52c98f',
               (s) => s.quality);
    this.strip(pen, row, row, width, `latency, to ${Math.round(slowest)} ms`, newest && number(newest.latency) + ' ms',
               '#5cc8ff', (s) => Math.min(s.latency / slowest, 1));
    this.strip(pen, 2 * row, row, width, 'dropped', newest && String(newest.all), '#e8b866', (s) => s.drops / worst, true);
  }

  strip(pen, top, height, width, name, value, colour, share, isBars) {
    const now = performance.now() / 1000, base = top + height - 5, reach = height - 22;
    const x = (s) => width * (1 - (now - s.at) / SECONDS);
    pen.fillStyle = 'rgba(255, 255, 255, 0.08)';
    pen.fillRect(0, base, width, 1);
    pen.fillStyle = pen.strokeStyle = colour;
    if (isBars) {
      for (const s of this.samples) if (s.drops) pen.fillRect(x(s), base - reach * share(s), 1.5, reach * share(s));
    } else {
      pen.beginPath();
      let isDown = false;
      for (const s of this.samples) {
        if (!s.isLost) pen[isDown ? 'lineTo' : 'moveTo'](x(s), base - reach * share(s));
        isDown = !s.isLost;
      }
      pen.lineWidth = 1.4;
      pen.stroke();
    }
    pen.fillStyle = '#8a95a4';
    pen.fillText(name, 0, top + 11);
    pen.fillStyle = '#d9dfe7';
    pen.textAlign = 'right';
    pen.fillText(value || '', width, top + 11);
    pen.textAlign = 'left';
  }
}
