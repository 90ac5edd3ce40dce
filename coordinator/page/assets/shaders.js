// The programs of the renderer. Colours are reckoned in linear light; the sun throws one shadow, the sky lights from above.

const HEAD = "#version 300 es\nprecision highp float; precision highp int; precision highp sampler2DShadow;\n";

const LIGHT = `
uniform vec3 eye; uniform vec3 sun; uniform mat4 lightMatrix; uniform sampler2DShadow shadowMap; uniform float dusk; uniform int taps;
float lit(vec3 world, vec3 n) {
  vec4 s = lightMatrix * vec4(world + n * 0.004, 1.0);
  vec3 c = s.xyz / s.w * 0.5 + 0.5;
  if (any(lessThan(c, vec3(0.0))) || any(greaterThan(c, vec3(1.0)))) return 1.0;
  if (taps == 1) return texture(shadowMap, vec3(c.xy, c.z - 0.0008));
  vec2 px = 0.7 / vec2(textureSize(shadowMap, 0));
  float sum = 0.0;
  for (int k = 0; k < 4; k++) {
    vec2 o = vec2(float(k & 1) - 0.5, float(k >> 1) - 0.5) * 2.0;
    sum += texture(shadowMap, vec3(c.xy + o * px, c.z - 0.0008));
  }
  return sum * 0.25;
}
vec3 shade(vec3 base, vec3 world, vec3 n, float shine) {
  vec3 albedo = base * base;
  vec3 view = normalize(eye - world);
  float direct = max(dot(n, sun), 0.0) * lit(world, n);
  float back = max(dot(n, normalize(vec3(-sun.xy, 0.4))), 0.0);
  vec3 sky = mix(vec3(0.28, 0.25, 0.23), vec3(0.50, 0.54, 0.60), n.z * 0.5 + 0.5);
  vec3 light = sky * mix(0.92, 0.7, dusk) + vec3(1.0, 0.96, 0.90) * mix(1.22, 0.98, dusk) * direct + vec3(0.10) * back;
  float gloss = shine > 0.0 ? pow(max(dot(n, normalize(sun + view)), 0.0), 36.0) * shine * step(0.001, direct) : 0.0;
  return sqrt(albedo * light + gloss);
}`;

const INSTANCE = `
layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 m0; layout(location = 3) in vec4 m1; layout(location = 4) in vec4 m2; layout(location = 5) in vec4 m3;
layout(location = 6) in vec4 colour; layout(location = 7) in vec2 ends;
uniform mat4 viewProjection;
vec3 place() {
  float s = mix(ends.x, ends.y, position.z + 0.5);
  return (mat4(m0, m1, m2, m3) * vec4(position.xy * s, position.z, 1.0)).xyz;
}`;

/** Shapes: the same corners many times, each with place, size and colour. */
export const SHAPE = [
  `${HEAD}${INSTANCE}
out vec3 world; out vec3 turned; out vec4 tint;
void main() {
  world = place();
  vec3 squares = vec3(dot(m0.xyz, m0.xyz), dot(m1.xyz, m1.xyz), dot(m2.xyz, m2.xyz));
  turned = mat3(m0.xyz, m1.xyz, m2.xyz) * (normal / max(squares, vec3(1e-12)));
  tint = colour;
  gl_Position = viewProjection * vec4(world, 1.0);
}`,
  `${HEAD}${LIGHT}
in vec3 world; in vec3 turned; in vec4 tint; uniform float plain; out vec4 pixel;
void main() {
  vec3 n = normalize(turned);
  n = dot(n, eye - world) < 0.0 ? -n : n;
  vec3 colour = plain > 0.5 ? tint.rgb * (0.82 + 0.18 * n.z) : shade(tint.rgb, world, n, 0.16);
  pixel = vec4(colour * tint.a, tint.a);
}`,
];

/** Shapes as the sun sees them. */
export const CASTER = [
  `${HEAD}${INSTANCE}
void main() { gl_Position = viewProjection * vec4(place(), 1.0); }`,
  `${HEAD}void main() {}`,
];

// The ground: a grid of corners at the heights of the texture. COARSE takes slopes and colours at the corners only.
const GROUND_PARTS = [
  `layout(location = 0) in vec3 corner; layout(location = 1) in vec2 tile;
uniform mat4 viewProjection; uniform sampler2D heights; uniform ivec2 size; uniform vec3 lattice; uniform float drop;
out vec3 world; out vec2 node; out float wall;
#ifdef COARSE
uniform sampler2D surface; out vec4 known;
#endif
void main() {
  ivec2 at = clamp(ivec2(tile + corner.xy), ivec2(0), size - 1);
  node = vec2(at);
  wall = corner.z;
  world = vec3(lattice.xy + node * lattice.z, texelFetch(heights, at, 0).r - corner.z * drop);
#ifdef COARSE
  known = texelFetch(surface, at, 0);
#endif
  gl_Position = viewProjection * vec4(world, 1.0);
}`,
  `${LIGHT}
in vec3 world; in vec2 node; in float wall;
#ifdef COARSE
in vec4 known;
#else
uniform sampler2D surface;
#endif
uniform sampler2D palette; uniform vec2 texels; uniform int layer; uniform vec2 range; uniform float grid;
out vec4 pixel;
void main() {
#ifdef COARSE
  vec4 s = known;
#else
  vec4 s = texture(surface, (node + 0.5) / texels);
#endif
  float value = layer == 1 ? s.w : layer == 2 ? s.z : layer == 3 ? length(s.xy) : 0.0;
  float share = (value - range.x) / max(range.y - range.x, 1e-9);
  vec3 base = layer == 0 ? vec3(0.741, 0.722, 0.682) : texture(palette, vec2(clamp(share, 0.002, 0.998), (float(layer) - 0.5) / 3.0)).rgb;
  vec2 line = abs(fract(world.xy + 0.5) - 0.5) / max(fwidth(world.xy), vec2(1e-6));
  float rule = grid * (1.0 - min(min(line.x, line.y), 1.0));
  base = mix(base, base * 0.72, rule);
  bool edge = wall > 0.02 && (any(lessThan(node, vec2(0.5))) || any(greaterThan(node, texels - 1.5)));
  if (edge) base = vec3(0.40, 0.38, 0.35);
  // slopes are gentle: the light shows them half as steep again
  pixel = vec4(shade(base, world, normalize(vec3(1.5 * s.xy, 1.0)), 0.0), 1.0);
}`,
];
export const GROUND = GROUND_PARTS.map((part) => HEAD + part);
export const GROUND_COARSE = GROUND_PARTS.map((part) => `${HEAD}#define COARSE\n${part}`);

/** Lines and points of one colour each. */
export const LINE = [
  `${HEAD}
layout(location = 0) in vec3 position; layout(location = 1) in vec4 colour;
uniform mat4 viewProjection; out vec4 tint;
void main() { tint = colour; gl_PointSize = 5.0; gl_Position = viewProjection * vec4(position, 1.0); }`,
  `${HEAD}in vec4 tint; out vec4 pixel; void main() { pixel = vec4(tint.rgb * tint.a, tint.a); }`,
];
