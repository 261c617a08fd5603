#version 120
// The lamp in the wet surface of a film of blood: added to what is there.
uniform sampler2D micro_map;
uniform vec4 light;
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec3 film;

void main() {
  vec3 rough = texture2D(micro_map, place * 23.0).xyz;
  float um = film.x * clamp(1.6 - 1.2 * rough.z, 0.1, 2.2);
  float wet = smoothstep(0.40, 0.70, film.z) * smoothstep(4.0, 20.0, um) * (1.0 - 0.85 * film.y);
  if (wet <= 0.0) discard;
  vec3 v = normalize(-position), to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 h = normalize(v + to_light * inversesqrt(d2));
  vec3 small = texture2D(micro_map, place.yx * 71.0).xyz;
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = -n;
  vec3 t = normalize(cross(n, vec3(0.0, 1.0, 0.001)));
  vec2 slope = 0.55 * (rough.xy - 0.5) + 0.35 * (small.xy - 0.5);
  n = normalize(n + slope.x * t + slope.y * cross(n, t));
  float nh = max(dot(n, h), 0.0);
  nh *= nh; nh *= nh; nh *= nh; nh *= nh; nh *= nh; nh *= nh;  // ^64
  float mirror = nh * nh * nh;
  mirror *= mirror;  // ^384
  float beam = v.z * v.z * v.z * v.z;
  float strength = light.w * beam * beam / (d2 + 0.0012);
  gl_FragColor = vec4(vec3(0.95, 0.98, 1.0) * sqrt(min(60.0 * mirror * strength, 1.0)) * wet, 1.0);
}
