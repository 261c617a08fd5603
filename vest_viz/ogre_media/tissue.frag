#version 120
// Wet tissue under the endoscope's own light. Baked, mip-mapped textures instead of noise: cheap in software.
uniform sampler2D albedo_map;  // sRGB colour, wetness
uniform sampler2D relief_map;  // slopes along u and v, crest
uniform sampler2D micro_map;   // slopes of the micro relief
uniform vec4 light;            // view space position (m), intensity (m2) times exposure
uniform vec4 look;             // wetness, translucence, tiles of micro relief per tile, relief
uniform float alpha;
varying vec3 position;
varying vec3 normal;
varying vec3 tangent;
varying vec2 uv;
varying vec4 tint;

void main() {
  vec4 ground = texture2D(albedo_map, uv);
  vec3 relief = texture2D(relief_map, uv).xyz;
  vec2 micro = texture2D(micro_map, uv * look.z).xy * 2.0 - 1.0;
  vec2 slope = (relief.xy * 2.0 - 1.0) * look.w;

  vec3 v = normalize(-position);
  vec3 n0 = normalize(normal);
  if (dot(n0, v) < 0.0) n0 = -n0;  // sheets are seen from both sides
  vec3 t = normalize(tangent - n0 * dot(n0, tangent));
  vec3 b = cross(n0, t);
  vec2 s_diffuse = slope + 0.25 * micro;
  vec2 s_wet = 1.25 * slope + 0.75 * micro;
  vec3 n = normalize(n0 - t * s_diffuse.x - b * s_diffuse.y);
  vec3 n_wet = normalize(n0 - t * s_wet.x - b * s_wet.y);

  vec3 to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 l = to_light * inversesqrt(d2);
  // The beam is brightest in the middle; sides get less.
  float beam = v.z * v.z;
  float strength = light.w * beam * beam * v.z / (d2 + 0.0003);

  // Light scattered below the surface reaches round the edge, red farthest.
  vec3 wrap = vec3(0.45, 0.13, 0.09) * look.y;
  vec3 diffuse = max((dot(n, l) + wrap) / (1.0 + wrap), 0.0);
  float occlusion = tint.a * (0.55 + 0.45 * relief.z);
  vec3 albedo = ground.rgb * ground.rgb * tint.rgb;
  // Multiple scattering: dark places of tissue are redder, not only darker.
  float o2 = occlusion * occlusion * (0.6 + 0.4 * occlusion);
  vec3 shade = vec3(mix(occlusion, o2, 0.4), mix(occlusion, o2, 0.95), o2);
  float facing = max(dot(n0, v), 0.0);
  float edge = (1.0 - facing) * (1.0 - facing);
  vec3 colour = albedo * (diffuse * shade + look.y * edge * vec3(0.30, 0.07, 0.05));

  vec3 h = normalize(l + v);
  float nh = max(dot(n_wet, h), 0.0);
  float lobe = nh * nh;
  lobe *= lobe;
  lobe *= lobe;  // ^8
  float broad = lobe * lobe * lobe * lobe;                       // ^32
  float sharp = broad * broad * broad;                           // ^96
  float wet = ground.a * look.x * (0.4 + 0.6 * tint.a);
  float grazing = 1.0 + 3.0 * edge * edge;
  colour += wet * grazing * (vec3(0.030, 0.027, 0.026) * broad + vec3(8.5, 8.9, 9.3) * sharp);

  // Close to 1 - exp(-x): highlights run into white softly.
  colour *= strength;
  colour = 1.0 - 1.0 / (1.0 + colour * (1.0 + colour * (0.5 + 0.17 * colour)));
  colour = sqrt(colour);
  // The camera's contrast: dark parts darker, bright ones brighter.
  colour = mix(colour, colour * colour * (3.0 - 2.0 * colour), 0.75);
  colour = max(colour - 0.035, 0.0);  // black level
  // Stray light in the optics takes some of the colour, most in the dark.
  float grey = dot(colour, vec3(0.3, 0.6, 0.1));
  colour = mix(colour, vec3(grey), 0.27 - 0.18 * grey);
  gl_FragColor = vec4(colour, alpha);
}
