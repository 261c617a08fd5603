#version 120
// Gauze: a loose weave of white cotton. What it holds darkens it from its front on, and blood reddens it.
uniform vec4 light;           // as in tissue.frag
uniform vec4 soak;            // how full it is, 0 … 1; how much of that is blood, 0 … 1
uniform float depth_in_alpha;
varying vec3 position;
varying vec3 normal;
varying vec3 place;
varying vec3 facing;

const float kPitch = 0.0006;  // m: 17 threads on a centimetre
const float kFront = 0.025;   // m: where the wad ends

/// Light that a place of the weave returns: threads cross over and under, between them it is dark.
float weave(vec2 p) {
  vec2 q = p / kPitch, cell = floor(q), f = abs(fract(q) - 0.5) * 2.0;
  vec2 thread = vec2(1.0) - smoothstep(0.35, 0.80, f);
  float over = mod(cell.x + cell.y, 2.0);
  float top = max(thread.x * (0.85 + 0.15 * over), thread.y * (1.0 - 0.15 * over));
  vec2 w = fwidth(q);
  float seen = 1.0 - smoothstep(0.35, 0.9, max(w.x, w.y));  // threads finer than dots are their mean
  return mix(0.80, 0.45 + 0.55 * top, seen);
}

void main() {
  vec3 v = normalize(-position);
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = -n;
  vec3 to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 l = to_light * inversesqrt(d2);
  float beam = v.z * v.z * v.z * v.z;
  float strength = light.w * beam * beam / (d2 + 0.0012);
  float nl = max(dot(n, l), 0.0);

  vec3 side = facing * facing;
  side = side * side;
  side /= side.x + side.y + side.z;
  float cloth = side.x * weave(place.yz) + side.y * weave(place.xz) + side.z * weave(place.xy);

  // The stain has no straight edge: it runs ahead along some threads.
  vec3 m = 1000.0 * place;
  float ragged = 0.10 * sin(0.9 * m.x + 1.7 * sin(0.6 * m.y)) + 0.07 * sin(1.9 * m.y + 1.3 * m.z) +
                 0.04 * sin(4.1 * m.x - 3.3 * m.z);
  float depth = (kFront - place.z) / kFront + ragged + 0.21;
  float level = 1.6 * soak.x;
  float wet = 1.0 - smoothstep(level - 0.22, level, depth);
  wet *= step(1e-4, soak.x);
  vec3 soaked = mix(vec3(0.62, 0.59, 0.55), vec3(0.40, 0.018, 0.014), sqrt(clamp(soak.y, 0.0, 1.0)));
  vec3 cotton = mix(vec3(0.86, 0.83, 0.78), soaked, wet);
  cloth = mix(cloth, 0.85 * cloth + 0.10, wet);  // liquid fills the gaps between threads

  // Light goes far in cotton: shadows are soft. Wet threads glint.
  vec3 h = normalize(l + v);
  float glint = pow(max(dot(n, h), 0.0), 60.0) * wet * cloth;
  vec3 lit = cotton * (cloth * (0.20 + 0.80 * nl) * strength * 0.17);
  lit += vec3(0.12 * glint * strength);
  lit = 1.0 - exp(-lit);
  lit = sqrt(lit);
  lit = mix(lit, lit * lit * (3.0 - 2.0 * lit), 0.75);  // as in tissue.frag
  // Depth for the finishing pass, as in tissue.frag.
  gl_FragColor = vec4(lit, mix(1.0, 1.0 - sqrt(min(-position.z / 0.3, 1.0)), depth_in_alpha));
}
