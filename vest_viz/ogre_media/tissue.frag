#version 120
// Wet tissue under the endoscope's own light. Baked, mip-mapped textures instead of noise: cheap in software.
uniform sampler2D albedo_map;  // sRGB colour, wetness
uniform sampler2D relief_map;  // slopes along u and v, crest
uniform sampler2D micro_map;   // slopes of the micro relief
uniform vec4 look;             // wetness, translucence, tiles of micro relief per tile, relief
uniform vec2 alpha;            // opacity; 1: depth goes into the alpha channel instead
varying vec3 halfway;
varying vec4 uv;
varying vec4 tint;
varying vec3 cast0;  // place in the shadow of each instrument: instrument/shadow.h
varying vec3 cast1;
#ifdef STATE
varying vec4 state;  // film of blood, coagulated, charred, bloodless: 0 ... 1
varying vec3 blood_state;  // in the tissue without oxygen, flushed; film set: 0 ... 1
varying vec3 flow;         // down along the skin: sine of its slope, along tangent and binormal; time (s)

vec2 waves(vec2 p, vec2 way, float share);  // waves.frag
#endif

// Share of the lamp that an instrument hides; 1.2 is the lamp's diameter over a shaft's radius of 2.5 mm.
float hidden(vec3 c) {
  return step(1.0, c.y) * clamp(0.5 + min(c.y - abs(c.x), c.z) / (1.2 * max(c.y - 1.0, 0.02)), 0.0, 1.0);
}

void main() {
  // A pixel at the rim of what is round sees much of its turn: the mean of it, and of its pattern, not one place. (Low
  // resolutions take finer levels of the pattern than their pixels are wide.) Sheets are seen from both sides.
  vec3 h = normalize(halfway);
  h.z = max(abs(h.z), 0.2);
  float rim = 1.5 - 1.5 * smoothstep(0.2, 0.5, h.z);
  vec4 ground = texture2D(albedo_map, uv.xy, rim);
  vec3 relief = texture2D(relief_map, uv.xy, rim).xyz;
  // Far walls are hollow towards the lens and mirror the lamp everywhere: only what their relief breaks up looks wet.
  // So the relief counts more there, and the lamp's images are smaller. (Finer levels of the relief than the pixels are
  // wide would do the same, but break into dots at low resolutions.)
  float distant = smoothstep(0.05, 0.10, uv.w);  // m
  vec3 fine = texture2D(micro_map, uv.xy * look.z).xyz;
  vec2 micro = fine.xy * 2.0 - 1.0;
  vec2 slope = (relief.xy * 2.0 - 1.0) * look.w;
  float wetness = look.x;
  float film = 0.0;
  vec2 running = vec2(0.0);
#ifdef STATE
  // Borders run along the relief: grooves fill with blood first, crests char first.
  vec3 speck = texture2D(micro_map, uv.xy * look.z * 0.23).xyz;
  float rough = 0.55 * relief.z + 0.45 * speck.z - 0.5;
  // Heat goes farther here than there: patches of several millimetres, and their ragged borders.
  float blotch = texture2D(micro_map, uv.xy * look.z * 0.09 + 0.37).z;
  float pale = smoothstep(0.14, 0.56, state.y * (0.75 + 0.5 * blotch) + 0.34 * rough + 0.30 * (blotch - 0.5));
  float burnt = smoothstep(0.40, 0.62, state.z + 0.55 * rough);
  film = smoothstep(0.08, 0.34, state.x - 0.30 * rough) * (1.0 - 0.9 * burnt);
  float deep = smoothstep(0.25, 0.95, state.x);
  // Coagulated protein is opaque, whitish and dry; without blood tissue loses its red.
  float grey0 = dot(ground.rgb, vec3(0.35, 0.45, 0.2));
  // Reduced haemoglobin takes red, not blue: dusky in patches, as the small vessels lie; less of it shows where
  // little blood is left. Blood that comes back makes it redder than before.
  float blue = smoothstep(0.05, 0.85, blood_state.x * (0.8 + 0.4 * blotch));
  ground.rgb = mix(ground.rgb, vec3(0.30) + grey0 * vec3(0.62, 0.58, 0.52), 0.65 * state.w);
  ground.rgb = mix(ground.rgb, ground.rgb * vec3(0.56, 0.60, 0.80), blue * (1.0 - 0.25 * state.w));
  ground.rgb *= mix(vec3(1.0), vec3(1.06, 0.80, 0.80), blood_state.y);
  ground.rgb = mix(ground.rgb, vec3(0.80, 0.71, 0.60) * (0.66 + 0.34 * relief.z), 0.88 * pale);
  // Singed brown between the pale rim and the black eschar.
  float singed = smoothstep(0.12, 0.45, state.z + 0.5 * rough);
  ground.rgb = mix(ground.rgb, vec3(0.42, 0.24, 0.12), 0.75 * singed * (1.0 - burnt));
  ground.rgb = mix(ground.rgb, vec3(0.10, 0.085, 0.075) * (0.55 + 0.9 * speck.z), burnt);
  wetness *= (1.0 - pale) * (1.0 - pale) * (1.0 - 0.8 * burnt);  // the lamp's image is 64 times white
  slope += (speck.xy * 2.0 - 1.0) * (0.9 * burnt + 0.25 * pale);
  // Blood: thin films tint, deep ones hide what is below and lie smooth.
  // Set blood is dark and brown, and mirrors little.
  vec3 blood = mix(vec3(0.66, 0.075, 0.055), vec3(0.43, 0.030, 0.028), deep);
  blood = mix(blood, mix(vec3(0.34, 0.060, 0.040), vec3(0.20, 0.022, 0.022), deep), blood_state.z);
  ground.rgb = mix(ground.rgb, blood, film * mix(0.72, 0.97, deep));
  slope *= 1.0 - 0.75 * film;
  micro *= 1.0 - 0.75 * film;
  wetness = mix(wetness, 1.05 - 0.75 * blood_state.z, film);
  ground.a = mix(ground.a, 0.80, film);
  // Fresh blood stands round at its border, hangs between crests and runs down (30 mm/s where it is thick: 1/0.006 tiles
  // of the micro relief a metre): there its surface turns to the lamp.
  vec2 ux = dFdx(uv.xy), uy = dFdy(uv.xy);
  float area = ux.x * uy.y - ux.y * uy.x;
  vec2 rise = abs(area) > 1e-14
      ? vec2(dFdx(film) * uy.y - dFdy(film) * ux.y, dFdy(film) * ux.x - dFdx(film) * uy.x) / area : vec2(0.0);
  rise *= inversesqrt(dot(rise, rise) + 0.8 * look.z * look.z);
  running = waves(uv.xy * look.z * 0.25, flow.xy * (0.030 * deep * deep * (1.0 - blood_state.z) * 0.25 / 0.006), fract(flow.z));
  running = (1.1 * rise + 3.0 * (speck.xy - 0.5) + (0.6 + 2.0 * deep) * running) * film * (1.0 - blood_state.z);
#endif

  vec2 s_diffuse = (slope + 0.16 * micro) * min(2.5 * h.z, 1.0);
  vec2 s_wet = 0.95 * slope + (0.42 + 0.20 * distant) * micro + running;
  float nl = (h.z - dot(s_diffuse, h.xy)) * inversesqrt(1.0 + dot(s_diffuse, s_diffuse));
  float nh = max((h.z - dot(s_wet, h.xy)) * inversesqrt(1.0 + dot(s_wet, s_wet)), 0.0);

  // Light scattered below the surface reaches round the edge, red farthest.
  vec3 wrap = vec3(0.45, 0.13, 0.09) * look.y;
  vec3 diffuse = max((nl + wrap) / (1.0 + wrap), 0.0);
  float occlusion = tint.a * (0.6 + 0.4 * relief.z);
  vec3 albedo = ground.rgb * ground.rgb * tint.rgb;
  // Multiple scattering: dark places of tissue are redder, not only darker.
  float o2 = occlusion * occlusion * (0.6 + 0.4 * occlusion);
  vec3 shade = vec3(mix(occlusion, o2, 0.4), mix(occlusion, o2, 0.95), o2);
  float edge = (1.0 - h.z) * (1.0 - h.z);
  vec3 colour = albedo * (diffuse * shade + look.y * edge * vec3(0.30, 0.07, 0.05));

  // What other tissue scatters reaches into the shadow all the same (nearly half; by eye).
  float lit = 1.0 - 0.55 * max(hidden(cast0), hidden(cast1));
  // Matte tissue, however bright, stays below what picture/finish.cpp takes for the lamp's image (green of 224; here 0.9):
  // its brightest places would be cut out in white.
  float bright = colour.g * uv.z * lit, over = max(bright - 0.6, 0.0);
  colour *= (bright - over + 0.3 * over / (over + 0.3)) / max(bright, 1e-4);

  float lobe = nh * nh;
  lobe *= lobe;
  lobe *= lobe;                                   // ^8
  float sheen = lobe * lobe;                      // ^16
  float sharp = sheen * sheen;                    // ^32
  sharp *= sharp * sharp;                         // ^96
  float wet = wetness * (0.4 + 0.6 * tint.a);
  // Fluid gathers between the crests of the micro relief: highlights break up. Each is the lamp's image: small, far
  // brighter than the picture's white, and so with a hard edge. A film of blood covers the relief: its surface is
  // smooth, so the image in it is smaller still, and it has no sheen.
  float mirror = sharp * sharp;                   // ^192
  float lamp = mirror * mirror;                   // ^384
  float dry = (1.0 - film) * (1.0 - film) * (1.0 - film);
  sharp = mix(0.3 * mirror * lamp, mirror * mix(1.0, mirror, distant) * (0.3 + 0.7 * fine.z), dry);  // ^576, ^192 … ^384
  vec3 soft = vec3(0.050, 0.046, 0.046) * (1.0 - 0.8 * film);
  // A soft film everywhere; bright and slightly blue only where fluid stands.
  colour += wet * (soft * sheen + clamp(3.0 * ground.a - 0.8, 0.0, 1.0) * vec3(64.0, 67.2, 70.4) * sharp);

  // Close to 1 - exp(-x): highlights run into white softly.
  colour *= uv.z * lit;
  colour = 1.0 - 1.0 / (1.0 + colour * (1.0 + colour * (0.5 + 0.17 * colour)));
  colour = sqrt(colour);
  // The camera's contrast: dark parts darker, bright ones brighter.
  colour = mix(colour, colour * colour * (3.0 - 2.0 * colour), 0.85);
  colour = max(1.06 * colour - 0.06, 0.0);  // black level
  // Stray light in the optics takes some of the colour, most in the dark.
  float grey = dot(colour, vec3(0.3, 0.6, 0.1));
  colour = mix(colour, vec3(grey), 0.36 - 0.27 * grey);
  // The finishing pass reads the depth back: 0.3 m is 0, the lens 1.
  gl_FragColor = vec4(colour, mix(alpha.x, 1.0 - sqrt(min(uv.w / 0.3, 1.0)), alpha.y));
}
