#version 120
// A volume by rays through a 3-D texture: the sums of vest_viz/volume/ray_caster.cpp, sample by sample.
uniform sampler3D values;   // luminance: stored number + 32768 over 65535, 0 where nothing was measured; alpha: 1 there
uniform sampler2D colours;  // the table for one step, colours multiplied by alpha
uniform sampler2D depths;   // where opaque things lie, as depth.frag writes it
uniform mat4 from_clip;     // to m, world
uniform mat4 to_grid;       // from m, world
uniform vec4 size;          // voxels
uniform vec4 steps;         // m a step; stored number of the first entry; entries per number; of entries
uniform vec4 cut;           // normal, offset: the side that the normal points to is taken away
uniform vec4 shading;       // 1: on; ambient; edge; least light
varying vec2 place;

bool sampled(vec3 at, out float number) {
  vec3 within = clamp(at, vec3(0.0), size.xyz - 1.0);
  number = 0.0;
  if (texture3D(values, (floor(within + 0.5) + 0.5) / size.xyz).a < 0.5) return false;
  vec2 mixed = texture3D(values, (within + 0.5) / size.xyz).ra;
  number = mixed.x / mixed.y * 65535.0 - 32768.0;
  return true;
}

float shade(vec3 at, vec3 towards) {
  vec3 change;
  for (int a = 0; a < 3; ++a) {
    vec3 aside = vec3(a == 0, a == 1, a == 2);
    float low, high;
    if (!sampled(at - aside, low) || !sampled(at + aside, high)) return 1.0;
    change[a] = 0.5 * (high - low);
  }
  vec3 gradient = change * mat3(to_grid);  // by the transpose: a number a metre
  float steep = length(gradient);
  if (!(steep > 0.0)) return 1.0;
  float lit = shading.y + (1.0 - shading.y) * abs(dot(gradient, towards)) / steep;
  float edge = min(1.0, 1e-3 * steep * abs(steps.z) / (shading.z * steps.w));
  return 1.0 + edge * (lit - 1.0);
}

vec3 seen(float z) {
  vec4 p = from_clip * vec4(place, z, 1.0);
  return p.xyz / p.w;
}

void keepBelow(float value, float slope, float bound, inout float from, inout float end) {
  if (slope > 0.0)
    end = min(end, (bound - value) / slope);
  else if (slope < 0.0)
    from = max(from, (bound - value) / slope);
  else if (value > bound)
    end = -1.0;
}

void main() {
  vec3 eye = seen(-1.0);
  vec3 along = normalize(seen(0.0) - eye);
  vec3 bytes = floor(texture2D(depths, vec2(0.5, -0.5) * place + 0.5).rgb * 255.0 + 0.5);
  float depth = (bytes.r * 65536.0 + bytes.g * 256.0 + bytes.b) / 16777215.0 * 2.0 - 1.0;
  float from = 0.0, end = depth < 1.0 ? max(0.0, dot(along, seen(depth) - eye)) : 1e6;
  keepBelow(dot(cut.xyz, eye), dot(cut.xyz, along), cut.w, from, end);
  vec3 start = (to_grid * vec4(eye, 1.0)).xyz, turn = mat3(to_grid) * along;
  for (int a = 0; a < 3; ++a) {
    keepBelow(start[a], turn[a], size[a] - 0.5, from, end);
    keepBelow(-start[a], -turn[a], 0.5, from, end);
  }
  vec4 sum = vec4(0.0);
  if (from < end) {
    start += from * turn;
    float count = (end - from) / steps.x;
    for (float k = 0.0; k < count; k += 1.0) {
      float part = min(1.0, count - k), number;
      vec3 at = start + (k + 0.5 * part) * steps.x * turn;
      if (!sampled(at, number)) continue;
      float entry = clamp((number - steps.y) * steps.z + 0.5, 0.0, steps.w - 1.0);
      vec4 colour = texture2D(colours, vec2((floor(entry) + 0.5) / steps.w, 0.5));
      if (!(colour.a > 0.0)) continue;
      if (part < 1.0) colour *= (1.0 - pow(1.0 - colour.a, part)) / colour.a;
      float light = 1.0 - sum.a;
      if (shading.x > 0.0 && light * colour.a > shading.w) colour.rgb *= shade(at, along);
      sum += light * colour;
      if (1.0 - sum.a < shading.w) break;
    }
  }
  gl_FragColor = sum;
}
