// The shaders, WebGL 2. View space is in units of the camera's distance: the eye is at the origin,
// the target at (0, 0, -1), so that scenes of any size keep single precision.

const VIEW = `#version 300 es
precision highp float;
uniform mat3 axes;     // right, up and back of the camera, in columns of the transpose
uniform vec3 target;
uniform float scale;   // 1 / distance
uniform vec2 lens;     // 1 / (slope aspect), 1 / slope
uniform vec2 depth;    // a, b of clip z = a z + b
uniform float pixel;   // height of a pixel at distance 1

vec3 seen(vec3 p) { return axes * ((p - target) * scale) - vec3(0.0, 0.0, 1.0); }
vec4 clipped(vec3 v) { return vec4(v.xy * lens, depth.x * v.z + depth.y, -v.z); }
// What is smaller than a pixel would flicker.
float visible(float radius, vec3 v) { return max(radius * scale, 0.6 * pixel * -v.z); }
`;

const LIGHT = `#version 300 es
precision highp float;
uniform vec3 key;      // direction to the light, in view space
uniform vec3 sky;      // up, in view space
uniform vec2 depth;
out vec4 painted;

// A surface under a key light, the sky, what the ground throws back, and with a highlight (n.h)^32.
// Squares and roots stand in for the sRGB curve: they are cheap, and what is lit fully keeps its
// colour.
vec4 lit(vec3 normal, vec3 v, vec4 color) {
  vec3 base = color.rgb * color.rgb;
  vec3 back = -normalize(v);
  vec3 around = mix(vec3(0.20, 0.19, 0.18), vec3(0.46, 0.49, 0.54), 0.5 + 0.5 * dot(normal, sky));
  float direct = max(dot(normal, key), 0.0);
  float gloss = max(dot(normal, normalize(key + back)), 0.0);
  gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss; gloss *= gloss;
  vec3 light = base * (around + direct * vec3(0.68, 0.66, 0.62)) + 0.10 * gloss;
  return vec4(sqrt(light), color.a);
}
`;

// Spheres: a triangle that just covers one, and the ray through each pixel. They come from textures,
// since instances of a few corners each are slow where there is no graphics card.
const BALL_VERTEX = `${VIEW}
uniform highp sampler2D rows;   // center, and radius where it differs
uniform highp sampler2D tints;
uniform float equal;   // radius of all; negative: of the rows
uniform bool tinted;   // each has its own colour
out vec3 at;
flat out vec3 center;
flat out float size;
flat out vec4 shade;

ivec2 place(int k) { return ivec2(k & 1023, k >> 10); }

void main() {
  int ball = gl_VertexID / 3;
  vec4 row = texelFetch(rows, place(ball), 0);
  center = seen(row.xyz);
  size = visible(equal < 0.0 ? row.w : equal, center);
  shade = texelFetch(tints, place(tinted ? ball : 0), 0);
  float far = dot(center, center), near = far - size * size;
  if (near <= 0.0 || center.z > size) {  // around the eye, or behind it
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  vec3 w = center * inversesqrt(far);
  vec3 u = normalize(cross(w, abs(w.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
  float turn = 2.0943951 * float(gl_VertexID - 3 * ball);
  vec3 corner = u * cos(turn) + cross(u, w) * sin(turn);
  at = center + corner * (2.0 * size * sqrt(far / near));  // its inner circle is the outline
  gl_Position = clipped(at);
}`;

const BALL_FRAGMENT = `${LIGHT}
in vec3 at;
flat in vec3 center;
flat in float size;
flat in vec4 shade;

void main() {
  vec3 ray = normalize(at);
  float along = dot(ray, center);
  vec3 across = center - along * ray;
  float inside = size * size - dot(across, across);
  if (inside < 0.0) discard;
  vec3 hit = (along - sqrt(inside)) * ray;
  if (hit.z >= 0.0) discard;
  gl_FragDepth = 0.5 - 0.5 * (depth.x + depth.y / hit.z);
  painted = lit((hit - center) / size, hit, shade);
}`;

// Tubes between two ends, which may differ in radius and colour; spheres close them.
const CONE_VERTEX = `${VIEW}
in vec3 position;
in vec3 position2;
in float radius;
in float radius2;
in vec4 color;
in vec4 color2;
out vec3 at;
out vec3 normal;
out vec4 shade;
const int SIDES = 14;

void main() {
  vec3 a = seen(position), b = seen(position2);
  vec3 w = b - a;
  float far = length(w);
  w = far > 0.0 ? w / far : vec3(0.0, 0.0, 1.0);
  vec3 u = normalize(cross(w, abs(w.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
  float turn = 6.2831853 * float(gl_VertexID >> 1) / float(SIDES);
  bool second = (gl_VertexID & 1) == 1;
  normal = cos(turn) * u + sin(turn) * cross(w, u);
  vec3 middle = second ? b : a;
  at = middle + normal * visible(second ? radius2 : radius, middle);
  shade = second ? color2 : color;
  gl_Position = clipped(at);
}`;

const CONE_FRAGMENT = `${LIGHT}
in vec3 at;
in vec3 normal;
in vec4 shade;
void main() { painted = lit(normalize(normal), at, shade); }`;

const TRIANGLE_VERTEX = `${VIEW}
uniform mat3 turned;
in vec3 position;
in vec3 normal;
in vec4 color;
out vec3 at;
out vec3 across;
out vec4 shade;
void main() {
  at = seen(position);
  across = turned * normal;
  shade = color;
  gl_Position = clipped(at);
}`;

const TRIANGLE_FRAGMENT = `${LIGHT}
uniform float opacity;
in vec3 at;
in vec3 across;
in vec4 shade;
void main() {
  vec3 flat_normal = cross(dFdx(at), dFdy(at));
  vec3 normal = dot(across, across) > 0.01 ? across : flat_normal;
  // Seen from behind, too.
  normal = normalize(normal) * (dot(normal, at) > 0.0 ? -1.0 : 1.0);
  painted = lit(normal, at, vec4(shade.rgb, shade.a * opacity));
}`;

const LINE_VERTEX = `${VIEW}
in vec3 position;
void main() { gl_Position = clipped(seen(position)); }`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 ink;
out vec4 painted;
void main() { painted = ink; }`;

// A grid on the ground: one plane, with lines at whole steps, which fade with the distance.
const GRID_VERTEX = `${VIEW}
uniform vec3 middle;
uniform vec3 along;
uniform vec3 deep;
uniform float reach;   // in steps
uniform float spacing;
out vec2 place;
out vec2 apart;
void main() {
  apart = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec3 p = middle + (along * apart.x + deep * apart.y) * reach * spacing;
  place = vec2(dot(p, along), dot(p, deep)) / spacing;
  gl_Position = clipped(seen(p));
}`;

const GRID_FRAGMENT = `#version 300 es
precision highp float;
in vec2 place;
in vec2 apart;
out vec4 painted;
float lines(vec2 p) {
  vec2 width = max(fwidth(p), 1e-6);
  vec2 near = abs(fract(p - 0.5) - 0.5) / width;
  vec2 ink = clamp(1.2 - near, 0.0, 1.0) * clamp(0.5 / width, 0.0, 1.0);
  return max(ink.x, ink.y);
}
void main() {
  float ink = max(0.35 * lines(place), 0.6 * lines(place / 10.0));
  painted = vec4(0.25, 0.31, 0.38, ink * clamp(1.4 - 1.4 * length(apart), 0.0, 1.0));
}`;

const SCREEN_VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

const BACKGROUND_FRAGMENT = `#version 300 es
precision highp float;
uniform vec2 size;
out vec4 painted;
void main() {
  float height = gl_FragCoord.y / size.y;
  painted = vec4(mix(vec3(0.80, 0.835, 0.87), vec3(0.945, 0.96, 0.975), height), 1.0);
}`;

// What a neighbour stands in front of gets less light (eye-dome lighting: Boucheny 2009), in two
// rings of pixels; and the mean of so many samples a side makes a pixel.
const SCREEN_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D picture;
uniform sampler2D depths;
uniform vec2 depth;
uniform float span;    // samples to the wider ring
uniform int samples;
out vec4 painted;

float distance_at(ivec2 p) {
  float z = texelFetch(depths, p, 0).r;
  return z >= 1.0 ? -1.0 : depth.y / (2.0 * z - 1.0 + depth.x);
}

float dome(ivec2 p, float here, float ring, ivec2 last) {
  float sum = 0.0;
  for (int k = 0; k < 8; k++) {
    float angle = 0.7853982 * (float(k) + 0.3);
    ivec2 q = clamp(p + ivec2(round(ring * vec2(cos(angle), sin(angle)))), ivec2(0), last);
    float there = distance_at(q);
    if (there > 0.0) sum += clamp((here / there - 1.0) * 58.0, 0.0, 1.0);
  }
  return sum / 8.0;
}

vec3 shaded(ivec2 p, ivec2 last) {
  vec3 color = texelFetch(picture, p, 0).rgb;
  float here = distance_at(p);
  if (here < 0.0) return color;
  float closed = 0.5 * dome(p, here, 0.3 * span, last) + 0.5 * dome(p, here, span, last);
  return color * (1.0 - 0.5 * closed);
}

void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * samples, last = textureSize(picture, 0) - 1;
  vec3 sum = vec3(0.0);
  for (int k = 0; k < samples * samples; k++) {
    sum += shaded(first + ivec2(k % samples, k / samples), last);
  }
  painted = vec4(sum / float(samples * samples), 1.0);
}`;

export const SOURCES = {
  ball: [BALL_VERTEX, BALL_FRAGMENT],
  cone: [CONE_VERTEX, CONE_FRAGMENT],
  triangle: [TRIANGLE_VERTEX, TRIANGLE_FRAGMENT],
  line: [LINE_VERTEX, LINE_FRAGMENT],
  grid: [GRID_VERTEX, GRID_FRAGMENT],
  background: [SCREEN_VERTEX, BACKGROUND_FRAGMENT],
  screen: [SCREEN_VERTEX, SCREEN_FRAGMENT],
};
