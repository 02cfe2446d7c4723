// Triangles of a body in space, drawn by the graphics processor: places at the two frames around a time are mixed there.
//
// A browser has few contexts: all bodies of a page share one, and what it drew is copied onto the canvas of each.

import { interpolateViridis } from "d3-scale-chromatic";
import { rgb } from "./words.js";

const PLACES = `#version 300 es
in vec3 rest, before, after;
in float bears;
uniform mat3 turned;
uniform vec3 centre;
uniform vec2 size, shift;
uniform float share, unit, magnified, depth, nearer, largest;
uniform int quantity;
out vec3 place;
out float value;
void main() {
  vec3 u = mix(before, after, share);
  place = turned * ((rest - centre) * unit + (magnified * unit) * u);
  gl_Position = vec4(place.xy * size + shift, -place.z * depth - nearer, 1.0);
  value = quantity == 1 ? length(u / largest) : bears / largest;
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
in vec3 place;
in float value;
uniform vec4 ink;
out vec4 colour;
void main() {
  colour = ink;
}`;

const QUANTITIES = { none: 0, u: 1, pressure: 2 };
const NAMES = ["rest", "before", "after", "bears"];
/** Lines on surfaces, which are light in every theme. */
const INK = [0.17, 0.17, 0.19];

/** The context of the page; null where a browser has no WebGL 2, or cannot do what is asked of it. */
class Shared {
  constructor() {
    this.canvas = document.createElement("canvas");
    // what was made before a context was lost is gone
    this.age = 0;
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => this.begin());
    this.gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.works = this.gl !== null && this.begin();
  }

  begin() {
    const { gl } = this;
    this.age += 1;
    this.surface = this.program(SURFACE);
    this.line = this.program(LINES);
    if (!this.surface || !this.line) return false;
    const colours = new Uint8Array(4 * 256);
    for (let k = 0; k < 256; k++) colours.set([...rgb(interpolateViridis(k / 255)).map((x) => Math.round(255 * x)), 255], 4 * k);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colours);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.LINEAR);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    return true;
  }

  program(fragment) {
    const { gl } = this;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, PLACES], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      if (!shader) return null;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    NAMES.forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    const uniforms = {};
    return { program, at: (name) => (uniforms[name] ??= gl.getUniformLocation(program, name)) };
  }
}

let shared = null;

/** A body as the graphics processor has it. */
export class WebGl {
  constructor(body) {
    shared ??= new Shared();
    Object.assign(this, { body, solid: body.solid, count: body.nodes.length / 3, age: 0 });
  }

  /** Whether it can draw now. */
  get works() {
    return shared.works && !shared.gl.isContextLost();
  }

  /** Displacements of all frames. */
  show({ u }) {
    this.u = u;
    this.age = 0;
  }

  /** Buffers, where there are none of this context. */
  prepare() {
    if (this.age === shared.age) return;
    const { gl } = shared;
    const filled = (target, data) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, data, gl.STATIC_DRAW);
      return buffer;
    };
    for (const old of [this.rest, this.moves, this.bears, ...Object.values(this.of ?? {}).map((o) => o.buffer)]) if (old && gl.isBuffer(old)) gl.deleteBuffer(old);
    this.rest = filled(gl.ARRAY_BUFFER, this.body.nodes);
    this.moves = filled(gl.ARRAY_BUFFER, this.u);
    this.bears = gl.createBuffer();
    const indices = (of) => ({ buffer: filled(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(of)), length: of.length });
    this.of = Object.fromEntries(["triangles", "coarse", "lines", "edges"].map((name) => [name, indices(this.solid[name])]));
    this.age = shared.age;
  }

  /** One picture on a canvas: `at` has the moment, the view, colours, and which triangles. */
  draw(canvas, at) {
    this.prepare();
    const { gl } = shared;
    const [width, height] = [canvas.width, canvas.height];
    if (shared.canvas.width !== width || shared.canvas.height !== height) Object.assign(shared.canvas, { width, height });
    gl.viewport(0, 0, width, height);
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
    // faces that bear contact come first; others show no pressure
    const name = at.coarse ? "coarse" : "triangles";
    const touching = at.quantity === "pressure" ? 3 * this.solid.touching[at.coarse ? 1 : 0] : this.of[name].length;
    for (const [quantity, from, to] of [[at.quantity, 0, touching], ["none", touching, this.of[name].length]]) {
      this.pass(shared.surface, { ...at, quantity }, 0);
      gl.uniform3fv(shared.surface.at("plain"), at.plain);
      this.elements(gl.TRIANGLES, name, from, to);
    }
    // lines a little before the faces that they lie on
    this.pass(shared.line, at, 5e-4);
    gl.uniform4fv(shared.line.at("ink"), [0, 0, 0, 0.22]);
    this.elements(gl.LINES, "lines");
    gl.uniform4fv(shared.line.at("ink"), [...INK, 1]);
    this.elements(gl.LINES, "edges");
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    context.drawImage(shared.canvas, 0, 0);
  }

  pass(program, at, nearer) {
    const { gl } = shared;
    gl.useProgram(program.program);
    const one = (name, x) => gl.uniform1f(program.at(name), x);
    gl.uniformMatrix3fv(program.at("turned"), true, at.axes.flat());
    gl.uniform3fv(program.at("centre"), at.centre);
    gl.uniform2fv(program.at("size"), at.size);
    gl.uniform2fv(program.at("shift"), at.shift);
    one("share", at.moment[2]);
    one("unit", at.unit);
    one("magnified", at.magnified);
    one("depth", at.depth);
    one("nearer", nearer);
    one("largest", at.largest || 1);
    gl.uniform1i(program.at("quantity"), QUANTITIES[at.quantity]);
  }

  elements(kind, name, from = 0, to = this.of[name].length) {
    const { gl } = shared;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.of[name].buffer);
    if (to > from) gl.drawElements(kind, to - from, gl.UNSIGNED_INT, 4 * from);
  }
}
