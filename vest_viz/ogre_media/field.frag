#version 120
// The colour stays legible: half of it does not depend on the light.
uniform vec2 alpha;  // as in tissue.frag
varying vec3 position;
varying vec3 normal;
varying vec3 shade;
varying float kept;  // below 0: cut away

void main() {
  if (kept < 0.0) discard;
  vec3 n = normalize(normal);
  float facing = abs(dot(n, normalize(-position)));
  gl_FragColor = vec4(shade * (0.5 + 0.5 * facing), alpha.x);
}
