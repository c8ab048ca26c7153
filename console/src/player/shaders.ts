import type { Coloring } from "./colors";

export const COLORING_NUMBERS: Record<Coloring, number> = { cloth: 0, state: 1, sigma: 2, cameras: 3, coverage: 4, difference: 5 };

/** A vertex: its quantised place, its traits (quantized_mesh.ts), and the same vertex of another job. */
export const VERTEX_SHADER = `
precision highp float;
in vec3 position;
in float traits;
in vec3 other;
in float coverage;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform vec3 low, otherLow, unit, otherUnit, cloth, states[5];
uniform float range, pointSize;
uniform int coloring;
uniform sampler2D palette;
// A camera of the rig, through whose lens the mesh is drawn over its picture.
uniform bool overlays;
uniform mat3 turn;
uniform vec3 shift;
uniform vec4 pinhole;
uniform vec2 pictureSize;
uniform float lens[8];
uniform vec2 depths;
out vec3 tint;
out vec3 seen;

vec3 ofPalette(float value) { return texture(palette, vec2(clamp(value, 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb; }

vec3 colorOf(vec3 place) {
  float state = mod(traits, 4.0), cameras = mod(floor(traits / 4.0), 64.0), sigma = floor(traits / 256.0);
  if (state == 3.0 && cameras > 0.0) state = 4.0, cameras -= 1.0;  // driven, as in quantized_mesh.ts
  if (coloring == 1) return states[int(state)];
  if (coloring == 2) return sigma > 254.5 ? vec3(0.55) : ofPalette(0.001 * exp2(sigma / 16.0) / range);
  if (coloring == 3) return ofPalette(cameras / range);
  if (coloring == 4) return ofPalette(coverage);
  if (coloring == 5) return ofPalette(distance(place, otherLow + otherUnit * other) / range);
  return cloth;
}

// OpenCV's lens: k1 k2 p1 p2 k3 k4 k5 k6.
vec4 throughLens(vec3 p) {
  if (p.z <= depths.x) return vec4(0.0, 0.0, 0.0, -1.0);
  vec2 d = p.xy / p.z;
  float r2 = dot(d, d), r4 = r2 * r2, r6 = r4 * r2;
  float radial = (1.0 + lens[0] * r2 + lens[1] * r4 + lens[4] * r6) / (1.0 + lens[5] * r2 + lens[6] * r4 + lens[7] * r6);
  vec2 bent = d * radial + vec2(2.0 * lens[2] * d.x * d.y + lens[3] * (r2 + 2.0 * d.x * d.x),
                                lens[2] * (r2 + 2.0 * d.y * d.y) + 2.0 * lens[3] * d.x * d.y);
  vec2 pixel = pinhole.xy * bent + pinhole.zw + 0.5;
  vec2 at = vec2(2.0 * pixel.x / pictureSize.x - 1.0, 1.0 - 2.0 * pixel.y / pictureSize.y);
  return vec4(at, 2.0 * (p.z - depths.x) / (depths.y - depths.x) - 1.0, 1.0) * p.z;
}

void main() {
  vec3 place = low + unit * position;
  vec4 inView = modelViewMatrix * vec4(place, 1.0);
  seen = overlays ? turn * place + shift : inView.xyz;
  gl_Position = overlays ? throughLens(seen) : projectionMatrix * inView;
  gl_PointSize = pointSize;
  tint = colorOf(place);
}`;

/** Lit from the eye; faces are flat, since normals would cost more than they show. */
export const FRAGMENT_SHADER = `
precision highp float;
in vec3 tint;
in vec3 seen;
uniform bool isLit;
uniform float dim;
out vec4 color;
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float light = isLit ? 0.35 + 0.65 * abs(dot(normal, normalize(seen))) : 1.0;
  color = vec4(tint * light * dim, 1.0);
}`;
