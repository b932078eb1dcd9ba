// Draws packets: spheres, tubes, triangles, lines and the ground into a texture with its depths,
// and that onto the screen.

import { PLACES, program, sheet, table } from "./gl.js";
import { SOURCES } from "./shaders.js";

const SIDES = 14; // of a tube
const CLEAR = 0.22; // opacity of boundaries that are to be clear
const PLANE = 0.4; // of planes, which would hide what is below them
const KEY = [-0.6, 1.2, 0.8]; // to the light: right, up, towards the camera, level
const EDGE = [0.2, 0.26, 0.33, 0.8];
const GRID = 30; // steps from the middle to the end
const RING = 5; // pixels to the wider ring of the shading

const unit = (a) => a.map((x) => x / Math.hypot(...a));
const combined = (rows, weights) => [0, 1, 2].map((k) => rows.reduce((s, r, i) => s + r[k] * weights[i], 0));

export class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2; try another, or allow it its graphics card");
    this.gl = gl;
    this.programs = {};
    for (const [name, sources] of Object.entries(SOURCES)) {
      this.programs[name] = program(gl, name, sources);
    }
    this.layers = { still: new Map(), frame: new Map() };
    this.target = null;
  }

  // Take over the arrays of a packet, instead of those before; layer: "still" or "frame".
  upload(layer, packet) {
    const gl = this.gl;
    const before = this.layers[layer];
    const now = new Map();
    for (const [name, array] of Object.entries(packet.arrays)) {
      const old = before.get(name) ?? {};
      const own = { ...array };
      // Spheres come from textures; tubes have both, since spheres close them.
      if (/\.(ball|cone|wire)/.test(name)) own.table = table(gl, array, old.table);
      if (!/\.ball/.test(name)) {
        own.buffer = old.buffer ?? gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, own.buffer);
        gl.bufferData(gl.ARRAY_BUFFER, array.values, gl.DYNAMIC_DRAW);
      }
      before.delete(name);
      now.set(name, own);
    }
    for (const old of before.values()) {
      gl.deleteBuffer(old.buffer ?? null);
      gl.deleteTexture(old.table ?? null);
    }
    this.layers[layer] = now;
  }

  // look: camera, box, up, floor (null: no grid), boundaries ("solid", "clear", "edges", "none"),
  // samples (a side of a pixel).
  draw(look) {
    const gl = this.gl;
    const { width, height } = this.canvas;
    this.target = sheet(gl, width * look.samples, height * look.samples, this.target);
    this.view = this.uniforms(look, width / height, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
    gl.viewport(0, 0, this.target.width, this.target.height);
    gl.clearBufferfi(gl.DEPTH_STENCIL, 0, 1, 0);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    this.use("background", { size: [this.target.width, this.target.height] });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    this.solid(look.boundaries);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.planes(look.boundaries);
    if (look.floor !== null) this.ground(look);
    this.clear(look.boundaries);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    this.screen(look.samples);
  }

  // All that hides what is behind it.
  solid(boundaries) {
    for (const arrays of Object.values(this.layers)) {
      for (const layer of boundaries === "none" ? ["thing"] : ["thing", "boundary"]) {
        this.balls(arrays, `${layer}.ball`);
        for (const name of ["cone", "wire"]) this.tubes(arrays, `${layer}.${name}`);
        if (layer === "thing" || boundaries === "solid") this.triangles(arrays, `${layer}.corner`, 1);
      }
      if (boundaries === "edges") this.lines(arrays, "boundary.edge");
    }
  }

  // All that lets through what is behind it.
  clear(boundaries) {
    for (const arrays of Object.values(this.layers)) {
      this.triangles(arrays, "thing.veil", 1);
      if (boundaries === "none" || boundaries === "edges") continue;
      if (boundaries === "clear") this.triangles(arrays, "boundary.corner", CLEAR);
      this.triangles(arrays, "boundary.veil", 1);
    }
  }

  // Planes are clear always, and not the more so where those of several worlds lie on each other.
  planes(boundaries) {
    const gl = this.gl;
    if (boundaries === "none" || boundaries === "edges") return;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    for (const arrays of Object.values(this.layers)) {
      this.triangles(arrays, "plane.corner", boundaries === "clear" ? CLEAR : PLANE);
      this.triangles(arrays, "plane.veil", 1);
    }
    gl.disable(gl.STENCIL_TEST);
  }

  balls(arrays, name) {
    const array = arrays.get(name);
    if (!array) return;
    const tints = arrays.get(`${name}_color`);
    this.textures([array.table, tints.table]);
    this.use("ball", { rows: 0, tints: 1, equal: array.radius ?? -1, tinted: tints.count > 1 });
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3 * array.count);
    this.textures([null, null]);
  }

  tubes(arrays, name) {
    const array = arrays.get(name);
    if (!array) return;
    this.use("cone");
    this.round(array, 0, 2, ["position", "radius"]);
    this.round(array, 1, 2, ["position2", "radius2"]);
    this.colors(arrays, name, 0, 2, "color");
    this.colors(arrays, name, 1, 2, "color2");
    this.gl.drawArraysInstanced(this.gl.TRIANGLE_STRIP, 0, 2 * (SIDES + 1), array.count / 2);
    this.balls(arrays, name);
  }

  triangles(arrays, name, opacity) {
    const array = arrays.get(name);
    if (!array) return;
    const gl = this.gl;
    this.use("triangle", { opacity });
    this.attribute("position", array, { width: 3 });
    this.colors(arrays, name, 0, 1, "color", 0);
    const normals = arrays.get(name.replace("corner", "normal"));
    if (normals && normals !== array) this.attribute("normal", normals, { width: 3, stride: 4 });
    else this.constant("normal", [0, 0, 0, 0]);
    gl.drawArrays(gl.TRIANGLES, 0, array.count);
  }

  lines(arrays, name) {
    const array = arrays.get(name);
    if (!array) return;
    this.use("line", { ink: EDGE });
    this.attribute("position", array, { width: 3 });
    this.gl.drawArrays(this.gl.LINES, 0, array.count);
  }

  ground({ up, floor, box }) {
    const size = Math.hypot(...box[1].map((x, k) => x - box[0][k])) || 1;
    const spacing = 10 ** Math.round(Math.log10(size / 25));
    const deep = up[2] > 0.5 ? [0, 1, 0] : [0, 0, 1];
    const middle = box[0].map((x, k) => 0.5 * (x + box[1][k]) * (1 - up[k]) + floor * up[k]);
    const reach = Math.max(GRID, (1.5 * size) / spacing);
    this.use("grid", { middle, along: [1, 0, 0], deep, reach, spacing });
    this.gl.drawArrays(this.gl.TRIANGLE_STRIP, 0, 4);
  }

  screen(samples) {
    const ring = RING * samples * Math.max(1, this.canvas.height / 1000);
    this.textures([this.target.color, this.target.depth]);
    this.use("screen", { picture: 0, depths: 1, span: ring, samples });
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
    this.textures([null, null]);
  }

  // Put textures where shaders look for them.
  textures(given) {
    const gl = this.gl;
    for (const [k, texture] of given.entries()) {
      gl.activeTexture(gl.TEXTURE0 + k);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    }
    gl.activeTexture(gl.TEXTURE0);
  }

  // What every shader takes of the camera.
  uniforms({ camera, box, up, samples }, aspect, height) {
    const axes = camera.axes;
    const middle = box[0].map((x, k) => 0.5 * (x + box[1][k]) - camera.target[k]);
    const size = Math.hypot(...box[1].map((x, k) => x - box[0][k]));
    // Planes and the ground reach farther than the box.
    const far = 1 + (Math.hypot(...middle) + 4 * size) / camera.distance;
    const near = Math.max(1e-3, 0.5 * (1 - (Math.hypot(...middle) + size) / camera.distance));
    const level = unit(axes[2].map((x, k) => x - up[k] * axes[2].reduce((s, y, i) => s + y * up[i], 0)));
    const side = axes[0];
    const light = unit(combined([side, up, level], KEY));
    const turn = (v) => axes.map((axis) => axis.reduce((s, x, k) => s + x * v[k], 0));
    const columns = [0, 1, 2].flatMap((k) => axes.map((axis) => axis[k]));
    return {
      axes: columns,
      turned: columns,
      target: camera.target,
      scale: 1 / camera.distance,
      lens: [1 / (camera.slope * aspect), 1 / camera.slope],
      depth: [-(far + near) / (far - near), (-2 * far * near) / (far - near)],
      pixel: (2 * camera.slope) / (height * samples),
      key: turn(light),
      sky: turn(up),
    };
  }

  // Centers and radii, from the first row on, each so many rows.
  round(array, first, step, [position, radius]) {
    const stride = 4 * array.width * step;
    const offset = 4 * array.width * first;
    this.attribute(position, array, { width: 3, bytes: stride, offset, divisor: 1 });
    if (array.width === 4) {
      this.attribute(radius, array, { width: 1, bytes: stride, offset: offset + 12, divisor: 1 });
    } else {
      this.constant(radius, [array.radius, 0, 0, 0]);
    }
  }

  colors(arrays, name, first, step, place, divisor = 1) {
    const array = arrays.get(`${name}_color`);
    if (array.count === 1) this.constant(place, [...array.values].map((x) => x / 255));
    else this.attribute(place, array, { width: 4, bytes: 4 * step, offset: 4 * first, divisor });
  }

  attribute(place, array, { width, stride, bytes, offset = 0, divisor = 0 }) {
    const gl = this.gl;
    const at = PLACES.indexOf(place);
    const size = array.values.BYTES_PER_ELEMENT;
    const type = { float32: gl.FLOAT, uint8: gl.UNSIGNED_BYTE, int8: gl.BYTE }[array.type];
    gl.bindBuffer(gl.ARRAY_BUFFER, array.buffer);
    gl.enableVertexAttribArray(at);
    const apart = bytes ?? (stride ?? array.width) * size;
    gl.vertexAttribPointer(at, width, type, array.type !== "float32", apart, offset);
    gl.vertexAttribDivisor(at, divisor);
  }

  constant(place, value) {
    const at = PLACES.indexOf(place);
    this.gl.disableVertexAttribArray(at);
    this.gl.vertexAttrib4f(at, ...value);
  }

  // Take a program, with the camera's uniforms and these.
  use(name, own = {}) {
    const gl = this.gl;
    const { program, places } = this.programs[name];
    gl.useProgram(program);
    for (let at = 0; at < PLACES.length; at++) gl.disableVertexAttribArray(at);
    const values = { ...this.view, ...own };
    for (const [uniform, { place, set }] of Object.entries(places)) set(place, values[uniform]);
  }
}
