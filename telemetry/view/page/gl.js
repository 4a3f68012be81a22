// SPDX-License-Identifier: BSD-3-Clause
// What is drawn with: points, and lines as wide as wanted. Columns first, as WebGL has matrices.
const POINTS = [`#version 300 es
  layout(location = 0) in vec3 place; layout(location = 1) in vec4 colour;
  uniform mat4 view; uniform float size, least, most, fog; out vec4 tone;
  void main() {
    gl_Position = view * vec4(place, 1.0);
    gl_PointSize = clamp(size / gl_Position.w, least, most);
    tone = vec4(colour.rgb, clamp(1.25 - gl_Position.w / fog, 0.15, 1.0));
  }`, `#version 300 es
  precision mediump float; in vec4 tone; out vec4 result; uniform vec3 ground; uniform float round_;
  void main() {
    vec2 d = gl_PointCoord - 0.5;
    if (round_ > 0.0 && dot(d, d) > 0.25) discard;
    result = vec4(mix(ground, tone.rgb, tone.a), 1.0);
  }`];
const LINES = [`#version 300 es
  layout(location = 0) in vec3 a; layout(location = 1) in vec3 b; layout(location = 2) in vec4 colour;
  uniform mat4 view; uniform vec2 pixel; uniform float width; out vec4 tone;
  const vec2 CORNERS[4] = vec2[4](vec2(0, -1), vec2(0, 1), vec2(1, -1), vec2(1, 1));
  void main() {
    vec4 p = view * vec4(a, 1.0), q = view * vec4(b, 1.0);
    const float near = 0.01;
    if (p.w < near && q.w < near) { gl_Position = vec4(2, 2, 2, 1); return; }
    if (p.w < near) p = mix(p, q, (near - p.w) / (q.w - p.w));
    if (q.w < near) q = mix(q, p, (near - q.w) / (p.w - q.w));
    vec2 way = (q.xy / q.w - p.xy / p.w) / pixel;
    vec2 side = length(way) > 1e-6 ? normalize(vec2(-way.y, way.x)) : vec2(0, 1);
    vec2 corner = CORNERS[gl_VertexID];
    vec4 at = mix(p, q, corner.x);
    at.xy += side * corner.y * width * pixel * at.w;
    gl_Position = at; tone = colour;
  }`, `#version 300 es
  precision mediump float; in vec4 tone; out vec4 result;
  void main() { result = tone; }`];

function program(gl, [vertex, fragment]) {
  const p = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(p, shader);
  }
  gl.linkProgram(p);
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(p, gl.ACTIVE_UNIFORMS); ++i) {
    const {name} = gl.getActiveUniform(p, i);
    uniforms[name] = gl.getUniformLocation(p, name);
  }
  return {p, uniforms};
}

// A growing list of points (16 bytes: f32 x y z, u8 r g b a) or segments (28 bytes: from, to, colour).
class Batch {
  constructor(gl, isLines) {
    this.gl = gl;
    this.stride = isLines ? 28 : 16;
    this.buffer = gl.createBuffer();
    this.array = gl.createVertexArray();
    this.count = 0;
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    const attribute = (at, size, type, offset) => {
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, type, type === gl.UNSIGNED_BYTE, this.stride, offset);
      if (isLines) gl.vertexAttribDivisor(at, 1);
    };
    attribute(0, 3, gl.FLOAT, 0);
    if (isLines) attribute(1, 3, gl.FLOAT, 12);
    attribute(isLines ? 2 : 1, 4, gl.UNSIGNED_BYTE, this.stride - 4);
    gl.bindVertexArray(null);
  }

  fill(bytes, count) {
    this.count = count;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, bytes, this.gl.DYNAMIC_DRAW);
  }

  // segments: [ax ay az bx by bz r g b a], colours 0 to 255.
  fillLines(segments) {
    const view = new DataView(new ArrayBuffer(28 * segments.length));
    segments.forEach((segment, i) => {
      for (let k = 0; k < 6; ++k) view.setFloat32(28 * i + 4 * k, segment[k], true);
      for (let k = 0; k < 4; ++k) view.setUint8(28 * i + 24 + k, segment[6 + k]);
    });
    this.fill(view, segments.length);
  }

  free() {
    this.gl.deleteBuffer(this.buffer);
    this.gl.deleteVertexArray(this.array);
  }
}

export class Painter {
  constructor(canvas, ground) {
    this.canvas = canvas;
    this.ground = ground;
    const gl = this.gl = canvas.getContext('webgl2', {antialias: true, alpha: false, powerPreference: 'low-power'});
    if (!gl) throw new Error('this browser has no WebGL 2');
    this.points = program(gl, POINTS);
    this.lines = program(gl, LINES);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  batch(isLines) { return new Batch(this.gl, isLines); }

  begin(view) {
    const gl = this.gl, ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height)
      Object.assign(this.canvas, {width, height});
    this.ratio = ratio;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...this.ground, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.view = view;
  }

  // size: metres that a point covers; least and most: pixels.
  drawPoints(batches, {size, least, most, fog, isRound}) {
    const gl = this.gl, {p, uniforms} = this.points;
    gl.useProgram(p);
    gl.uniformMatrix4fv(uniforms.view, false, this.view);
    gl.uniform1f(uniforms.size, size * this.canvas.height * 1.07);
    gl.uniform1f(uniforms.least, least * this.ratio);
    gl.uniform1f(uniforms.most, most * this.ratio);
    gl.uniform1f(uniforms.fog, fog);
    gl.uniform1f(uniforms.round_, isRound ? 1 : 0);
    gl.uniform3f(uniforms.ground, ...this.ground);
    for (const batch of batches) {
      gl.bindVertexArray(batch.array);
      gl.drawArrays(gl.POINTS, 0, batch.count);
    }
  }

  // width: half of it, pixels. isHidden: by what is in front.
  drawLines(batch, width, isHidden = true) {
    const gl = this.gl, {p, uniforms} = this.lines;
    gl.useProgram(p);
    gl.uniformMatrix4fv(uniforms.view, false, this.view);
    gl.uniform2f(uniforms.pixel, 2 / this.canvas.width, 2 / this.canvas.height);
    gl.uniform1f(uniforms.width, width * this.ratio);
    if (!isHidden) gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    gl.bindVertexArray(batch.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, batch.count);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
  }
}
