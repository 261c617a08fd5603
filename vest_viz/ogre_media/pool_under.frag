#version 120
// What lies under a pool: water against water, its own film shines no more. Drawn as the darker of the two.
uniform sampler2D micro_map;
uniform vec4 light;
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec3 fluid;

float depthOver(float depth, vec2 place, vec3 rough, vec3 small);  // shore.frag

void main() {
  if (fluid.x * fluid.y > 2.0) discard;  // nothing is seen through 2 mm of blood (pool.frag: 99 % hidden)
  // The shore, as in pool.frag.
  float mm = depthOver(fluid.y, place, texture2D(micro_map, place * 11.0).xyz, texture2D(micro_map, place.yx * 47.0).xyz);
  float wet = 0.42 + 0.33 * clamp(mm, -1.0, 1.5);
  if (wet < 0.42) discard;
  vec3 v = normalize(-position), to_light = light.xyz - position;
  float beam = v.z * v.z * v.z * v.z;
  // No tissue is brighter than fat in the full light (by eye); what is brighter is a highlight.
  vec3 c = vec3(0.80, 0.42, 0.32) * light.w * beam * beam / (dot(to_light, to_light) + 0.0012);
  c = 1.0 - 1.0 / (1.0 + c * (1.0 + c * (0.5 + 0.17 * c)));  // as in tissue.frag
  c = sqrt(c);
  c = max(1.06 * mix(c, c * c * (3.0 - 2.0 * c), 0.85) - 0.06, 0.0);
  gl_FragColor = vec4(mix(vec3(1.0), c, smoothstep(0.42, 0.60, wet) * smoothstep(0.80, 0.95, normalize(normal).z)), 1.0);
}
