#version 120
// Standing blood or water: mirrors lamp and cavity, hides the ground as far as its depth and its blood do.
uniform sampler2D micro_map;
uniform mat4 worldview_matrix;
uniform vec4 light;
uniform vec4 moment;  // s, of the session
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec3 fluid;

vec2 slope(float value, vec2 place);  // shore.frag
float depthOver(float depth, vec2 place, vec3 rough, vec3 small);

void main() {
  vec3 v = normalize(-position);
  // The shore runs where the depth is 0.
  vec3 rough = texture2D(micro_map, place * 11.0).xyz;
  vec3 small = texture2D(micro_map, place.yx * 47.0).xyz;
  float mm = depthOver(fluid.y, place, rough, small);
  float wet = 0.42 + 0.33 * clamp(mm, -1.0, 1.5);
  if (wet < 0.30) discard;
  float inward = smoothstep(0.42, 0.75, wet);
  mm = max(mm, 0.0);
  // Fluid wets tissue and climbs it: over the last millimetre its surface turns up towards the shore.
  vec2 steep = slope(wet, place);
  steep *= inversesqrt(dot(steep, steep) + 100.0) * (1.0 - inward);
  // Tissue is not as even as its cells: a shore that runs along a row of them would flash as one line.
  vec2 uneven = 4.0 * (texture2D(micro_map, place * 5.0).xy - 0.5) + 6.0 * (texture2D(micro_map, place.yx * 23.0).xy - 0.5);
  steep = mat2(1.0, uneven.x, -uneven.x, 1.0) * steep * max(1.0 + uneven.y, 0.0) * inversesqrt(1.0 + uneven.x * uneven.x);
  // Ripples run over it, one way and the other, more where it is stirred. A thin layer lies as its ground does.
  float stirred = 0.45 + 1.1 * clamp(abs(fluid.z) * 40.0, 0.0, 1.0);
  vec2 long_one = texture2D(micro_map, place * 11.0 + moment.x * vec2(0.19, 0.11)).xy - 0.5;
  vec2 short_one = texture2D(micro_map, place.yx * 47.0 - moment.x * vec2(0.31, 0.43)).xy - 0.5;
  vec2 waves = (long_one * 0.34 + short_one * 0.16) * stirred * smoothstep(0.05, 0.8, mm);
  vec3 level = (worldview_matrix * vec4(normal, 0.0)).xyz;
  vec3 n = normalize((worldview_matrix * vec4(normalize(normal) + vec3(waves + 1.6 * steep, 0.0), 0.0)).xyz);
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
  vec3 still = normalize(level + (worldview_matrix * vec4(waves, 0.0, 0.0)).xyz);
  float facing = 1.0 - abs(dot(still, v));
  float calm = smoothstep(0.80, 0.95, normalize(normal).z);  // see below
  float fresnel = 0.02 + 0.98 * calm * facing * facing * facing * facing * facing;
  // What it mirrors: the wall 8 cm on, as the lamp lights it there, and its wet patches, which mirror the lamp. They
  // are far brighter than the wall, so that they show in blood, and they dance with the ripples (sizes by eye).
  vec3 r = reflect(-v, still);
  vec3 there = position + 0.08 * r;
  float sight = max(normalize(-there).z, 0.0), beyond = dot(light.xyz - there, light.xyz - there);
  sight *= sight; sight *= sight;
  float lamp = light.w * sight * sight / (beyond + 0.0012);
  vec3 far_side = texture2D(micro_map, r.xy * 1.5 + 0.37).xyz;
  float wall = far_side.z, patch = far_side.y;
  vec3 mirrored = vec3(0.60, 0.24, 0.20) * (0.3 + wall) * lamp +
                  vec3(60.0, 62.0, 64.0) * smoothstep(0.62, 0.68, wall) * smoothstep(0.52, 0.58, patch) * min(lamp, 1.5);
  float blood = clamp(fluid.x, 0.0, 1.0);
  // Blood hides by its amount along the line of sight; a little colours much water. What light comes back of it
  // is bright red where it is thin and dark red where it is deep.
  float amount = blood * mm;
  float hide = 1.0 - exp(-2.2 * amount), deep = 1.0 - exp(-1.3 * amount);
  vec3 body = mix(vec3(0.22, 0.0060, 0.0042), vec3(0.045, 0.0008, 0.0007), deep);
  // It is never of one tone: brighter blood runs through what has stood, in drawn-out streaks.
  vec2 drift = place * vec2(9.0, 6.0) + 0.12 * long_one + moment.x * 0.006 * stirred;
  vec3 streak = texture2D(micro_map, drift).xyz;
  body *= 1.0 + 0.55 * (streak.z - 0.5) + 0.30 * (streak.x - 0.5);
  vec3 colour = mix(vec3(0.046, 0.020, 0.017), body, smoothstep(0.0, 0.25, hide)) * (0.40 + 0.60 * abs(dot(still, h))) * strength;
  vec3 gloss = fresnel * mirrored;
  colour += gloss;
  // Broken where the tissue below the brim is rough.
  float shine = (0.01 * sharp + 9.0 * mix(sharp * sharp * sharp * sharp, crisp, inward)) *
                mix(smoothstep(0.40, 0.75, small.z), 1.0, inward);
  // Between cells of very different height the mesh is a cliff that no fluid has.
  shine *= calm * step(0.42, wet);
  colour += shine * strength * vec3(0.95, 0.98, 1.0);
  colour = 1.0 - 1.0 / (1.0 + colour * (1.0 + colour * (0.5 + 0.17 * colour)));
  colour = sqrt(colour);
  colour = mix(colour, colour * colour * (3.0 - 2.0 * colour), 0.85);
  // The lamp through the waves: a net of bright lines on the ground, sharpest in a few millimetres of water.
  float net = 1.0 - abs(texture2D(micro_map, place.yx * 9.0 + 0.9 * normalize(normal).xy).z + rough.z - 1.0) * 4.0;
  net = max(net, 0.0); net *= net;
  float lines = 0.28 * net * inward * (1.0 - hide) * smoothstep(0.5, 3.0, mm) * (1.0 - smoothstep(8.0, 25.0, mm));
  // Clear water is seen by what it mirrors and by its brim; it takes little of the light from below.
  float a = mix(0.01 + 0.07 * (1.0 - exp(-0.15 * mm)), 0.97, hide) + 2.0 * (fresnel - 0.02) + 1.8 * gloss.g;
  a = max(a * smoothstep(0.42, 0.46 + 0.04 * (1.0 - hide), wet), min(0.6 * shine * strength, 1.0));
  vec3 lit = vec3(1.0, 0.84, 0.78) * sqrt(min(2.5 * strength, 1.0));
  colour = (colour * a + lit * lines * (1.0 - a)) / max(a + lines * (1.0 - a), 1e-3);
  a += lines * (1.0 - a);
  // Beyond the brim tissue is wet: darker.
  float border = smoothstep(0.30, 0.41, wet) * (1.0 - smoothstep(0.42, 0.47, wet)) * calm;
  // Thin water has a thin brim.
  float thick = smoothstep(0.03, 0.3, mm);
  colour = mix(colour, vec3(0.10, 0.015, 0.015), border * (1.0 - blood));
  a = max(a, 0.12 * border * (1.0 - blood));
  // The brim itself, round as a thread, mirrors the lamp wherever it turns to it.
  float brim = smoothstep(0.42, 0.47, wet) * (1.0 - smoothstep(0.50, 0.62, wet)) * calm;
  brim *= thick * (1.0 - 0.8 * hide) * (1.0 - 0.95 * min(3.0 * blood, 1.0)) * (0.35 + 0.65 * smoothstep(0.50, 0.92, nh)) * (0.3 + 0.9 * small.z);
  colour = mix(colour, lit, brim);
  a = max(a, 0.55 * brim);
  a *= mix(calm, 1.0, hide);
  colour = max(1.06 * colour - 0.06, 0.0);
  // Stray light in the optics, as in tissue.frag.
  float grey = dot(colour, vec3(0.3, 0.6, 0.1));
  colour = mix(colour, vec3(grey), (0.36 - 0.27 * min(grey, 1.0)) * (1.0 - 0.3 * hide));
  gl_FragColor = vec4(colour, min(a, 1.0));
}
