// What WebGL needs many words for: programs, textures of rows, and a texture to draw into.

// Attributes have the same place in every program.
export const PLACES = ["position", "radius", "color", "position2", "radius2", "color2", "normal"];

const WIDE = 1024; // texels a row; the shader of spheres counts on it

// A program and its uniforms: where each is, and how it is set.
export function program(gl, name, [vertex, fragment]) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(`shader ${name}: ${gl.getShaderInfoLog(shader)}`);
    }
  }
  PLACES.forEach((place, at) => gl.bindAttribLocation(made, at, place));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) {
    throw new Error(`shader ${name}: ${gl.getProgramInfoLog(made)}`);
  }
  const setters = {
    [gl.FLOAT]: (p, x) => gl.uniform1f(p, x),
    [gl.FLOAT_VEC2]: (p, x) => gl.uniform2fv(p, x),
    [gl.FLOAT_VEC3]: (p, x) => gl.uniform3fv(p, x),
    [gl.FLOAT_VEC4]: (p, x) => gl.uniform4fv(p, x),
    [gl.FLOAT_MAT3]: (p, x) => gl.uniformMatrix3fv(p, false, x),
    [gl.INT]: (p, x) => gl.uniform1i(p, x),
    [gl.BOOL]: (p, x) => gl.uniform1i(p, x),
    [gl.SAMPLER_2D]: (p, x) => gl.uniform1i(p, x),
  };
  const places = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
    const { name: uniform, type } = gl.getActiveUniform(made, k);
    places[uniform] = { place: gl.getUniformLocation(made, uniform), set: setters[type] };
  }
  return { program: made, places };
}

// A texture with a texel for each row of an array, WIDE in a row; old: one to use again.
export function table(gl, { values, width, count, type }, old) {
  const made = old ?? gl.createTexture();
  const [inside, format] = {
    uint8: [gl.RGBA8, gl.RGBA], float32: width === 3 ? [gl.RGB32F, gl.RGB] : [gl.RGBA32F, gl.RGBA],
  }[type];
  const kind = type === "uint8" ? gl.UNSIGNED_BYTE : gl.FLOAT;
  const full = Math.floor(count / WIDE);
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texImage2D(gl.TEXTURE_2D, 0, inside, WIDE, Math.ceil(count / WIDE), 0, format, kind, null);
  if (full) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDE, full, format, kind, values);
  const rest = values.subarray(full * WIDE * width);
  if (rest.length) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, full, count % WIDE, 1, format, kind, rest);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  }
  gl.bindTexture(gl.TEXTURE_2D, null);
  return made;
}

// A texture to draw into, with its depths, of this size; old: the one before, which may be it.
export function sheet(gl, width, height, old) {
  if (old?.width === width && old?.height === height) return old;
  if (old) {
    gl.deleteTexture(old.color);
    gl.deleteTexture(old.depth);
    gl.deleteFramebuffer(old.frame);
  }
  const texture = (format) => {
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.bindTexture(gl.TEXTURE_2D, null);
    return made;
  };
  const frame = gl.createFramebuffer();
  const [color, depth] = [texture(gl.RGBA8), texture(gl.DEPTH32F_STENCIL8)];
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, color, 0);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_STENCIL_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
  return { frame, color, depth, width, height };
}
