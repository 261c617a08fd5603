#version 120
// Standing blood or water: mirrors lamp and cavity, blood hides the ground, water lets it through.
uniform sampler2D micro_map;
uniform vec4 light;
uniform float ripple;  // slope of the fine waves
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec2 fluid;

void main() {
  vec3 v = normalize(-position);
  vec2 fine = texture2D(micro_map, place * 60.0).xy + texture2D(micro_map, place.yx * 37.0 + 0.3).xy - 1.0;
  vec3 n = normalize(normalize(normal) + vec3(fine * ripple, 0.0));
  if (dot(n, v) < 0.0) n = -n;
  vec3 to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 h = normalize(v + to_light * inversesqrt(d2));
  float beam = v.z * v.z * v.z * v.z;
  float strength = light.w * beam * beam / (d2 + 0.0012);
  float nh = max(dot(n, h), 0.0);
  float sharp = nh * nh;
  sharp *= sharp; sharp *= sharp; sharp *= sharp; sharp *= sharp;   // ^32
  float crisp = sharp * sharp; crisp *= crisp; crisp *= crisp; crisp *= crisp;  // ^512
  // Fresnel by Schlick 1994, water against air: 2 % at normal incidence.
  float facing = 1.0 - max(dot(n, v), 0.0);
  float fresnel = 0.02 + 0.98 * facing * facing * facing * facing * facing;
  vec3 r = reflect(-v, n);
  vec3 mirrored = mix(vec3(0.02, 0.006, 0.006), vec3(0.30, 0.11, 0.09), clamp(0.5 + 0.5 * r.y, 0.0, 1.0));
  float blood = clamp(fluid.x, 0.0, 1.0);
  // A little blood colours much water.
  float hide = 1.0 - exp(-7.0 * blood);
  vec3 body = mix(vec3(0.20, 0.17, 0.16), mix(vec3(0.70, 0.050, 0.040), vec3(1.0, 0.026, 0.024), blood), hide);
  vec3 colour = body * (0.35 + 0.65 * max(dot(n, h), 0.0)) * strength;
  colour += fresnel * mirrored * min(strength * 2.0, 1.5) * 4.0;
  colour += (0.05 * sharp + 9.0 * crisp) * strength * vec3(0.95, 0.98, 1.0);
  colour = 1.0 - 1.0 / (1.0 + colour * (1.0 + colour * (0.5 + 0.17 * colour)));
  colour = sqrt(colour);
  colour = mix(colour, colour * colour * (3.0 - 2.0 * colour), 0.85);
  float a = mix(0.16, 0.96, hide);
  a = clamp(a + 3.0 * fresnel + min(4.0 * crisp * strength, 1.0), 0.0, 1.0);
  gl_FragColor = vec4(max(1.06 * colour - 0.06, 0.0), a * fluid.y);
}
