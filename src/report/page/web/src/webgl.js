// Triangles of a body in space, drawn by the graphics processor: places at the two frames around a time are mixed there.

import { interpolateViridis } from "d3-scale-chromatic";
import { rgb } from "./words.js";

const PLACES = `#version 300 es
in vec3 rest, before, after;
in float bears;
uniform mat3 turned;
uniform vec3 centre;
uniform vec2 size, shift;
uniform float share, magnified, depth, nearer, largest;
uniform int quantity;
out vec3 place;
out float value;
void main() {
  vec3 u = mix(before, after, share);
  place = turned * (rest - centre + magnified * u);
  gl_Position = vec4(place.xy * size + shift, -place.z * depth - nearer, 1.0);
  value = quantity == 1 ? length(u) / largest : bears / largest;
}`;

const SURFACE = `#version 300 es
precision highp float;
precision highp int;
in vec3 place;
in float value;
uniform int quantity;
uniform vec3 plain;
uniform sampler2D shades;
out vec4 colour;
void main() {
  vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
  float bright = abs(dot(normal, normalize(vec3(-0.25, 0.4, 1.0))));
  bool says = quantity == 1 || (quantity == 2 && value > 1e-4);
  vec3 own = says ? texture(shades, vec2(value, 0.5)).rgb : plain;
  float ambient = says ? 0.8 : 0.5;
  colour = vec4(own * (ambient + (1.0 - ambient) * bright), 1.0);
}`;

const LINES = `#version 300 es
precision highp float;
precision highp int;
in vec3 place;
in float value;
uniform vec4 ink;
out vec4 colour;
void main() {
  colour = ink;
}`;

const QUANTITIES = { none: 0, u: 1, pressure: 2 };
const NAMES = ["rest", "before", "after", "bears"];

/** Draws on a canvas; null where a browser has no WebGL 2. */
export function webglOf(canvas, body) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  return gl && new WebGl(gl, body);
}

class WebGl {
  constructor(gl, { nodes, solid }) {
    Object.assign(this, { gl, solid, count: nodes.length / 3 });
    this.surface = this.program(SURFACE);
    this.line = this.program(LINES);
    const filled = (target, data) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, data, gl.STATIC_DRAW);
      return buffer;
    };
    this.rest = filled(gl.ARRAY_BUFFER, nodes);
    this.moves = gl.createBuffer();
    this.bears = gl.createBuffer();
    const indices = (of) => ({ buffer: filled(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(of)), length: of.length });
    this.of = Object.fromEntries(["triangles", "coarse", "lines", "edges"].map((name) => [name, indices(solid[name])]));
    const colours = new Uint8Array(4 * 256);
    for (let k = 0; k < 256; k++) colours.set([...rgb(interpolateViridis(k / 255)).map((x) => Math.round(255 * x)), 255], 4 * k);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colours);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  program(fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, PLACES], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    NAMES.forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "no program");
    const uniforms = {};
    return { program, at: (name) => (uniforms[name] ??= gl.getUniformLocation(program, name)) };
  }

  /** Displacements of all frames. */
  show({ u }) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.moves);
    gl.bufferData(gl.ARRAY_BUFFER, u, gl.STATIC_DRAW);
  }

  /** One picture: `at` has the moment, the view, colours, and which triangles. */
  draw(at) {
    const { gl } = this;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const frame = 12 * this.count;
    const attribute = (k, buffer, size, offset) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, size, gl.FLOAT, false, 0, offset);
    };
    attribute(0, this.rest, 3, 0);
    attribute(1, this.moves, 3, at.moment[0] * frame);
    attribute(2, this.moves, 3, at.moment[1] * frame);
    if (at.bears) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.bears);
      gl.bufferData(gl.ARRAY_BUFFER, at.bears, gl.DYNAMIC_DRAW);
      attribute(3, this.bears, 1, 0);
    } else gl.disableVertexAttribArray(3);
    this.pass(this.surface, at, 0);
    gl.uniform3fv(this.surface.at("plain"), at.plain);
    this.elements(gl.TRIANGLES, at.coarse ? "coarse" : "triangles");
    // lines a little before the faces that they lie on
    this.pass(this.line, at, 5e-4);
    const { line } = this;
    gl.uniform4fv(line.at("ink"), [0, 0, 0, 0.22]);
    this.elements(gl.LINES, "lines");
    gl.uniform4fv(line.at("ink"), [...at.ink, 1]);
    this.elements(gl.LINES, "edges");
  }

  pass(program, at, nearer) {
    const { gl } = this;
    gl.useProgram(program.program);
    const one = (name, x) => gl.uniform1f(program.at(name), x);
    gl.uniformMatrix3fv(program.at("turned"), true, at.axes.flat());
    gl.uniform3fv(program.at("centre"), at.centre);
    gl.uniform2fv(program.at("size"), at.size);
    gl.uniform2fv(program.at("shift"), at.shift);
    one("share", at.moment[2]);
    one("magnified", at.magnified);
    one("depth", at.depth);
    one("nearer", nearer);
    one("largest", at.largest || 1);
    gl.uniform1i(program.at("quantity"), QUANTITIES[at.quantity]);
  }

  elements(kind, name) {
    const { gl } = this;
    const { buffer, length } = this.of[name];
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    if (length) gl.drawElements(kind, length, gl.UNSIGNED_INT, 0);
  }
}
