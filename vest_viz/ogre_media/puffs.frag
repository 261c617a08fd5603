#version 120
// A puff of smoke: two layers of turbulence that turn against each other as its phase runs.
uniform sampler2D noise_map;
varying vec2 corner;
varying vec4 tone;
varying vec4 shape;  // seed, phase, light, depth

vec2 turn(vec2 p, float angle) {
  float c = cos(angle), s = sin(angle);
  return vec2(c * p.x - s * p.y, s * p.x + c * p.y);
}

void main() {
  float r2 = dot(corner, corner);
  if (r2 > 1.0) discard;
  float a = texture2D(noise_map, turn(corner, shape.y * 2.2 + shape.x) * 0.34 + shape.x * 0.37).r;
  float b = texture2D(noise_map, turn(corner, -shape.y * 1.6) * 0.55 + shape.x * 0.71 + 0.3 * shape.y).r;
  float density = clamp(1.7 * a * b + 0.5 * a - 0.28, 0.0, 1.0) * (1.0 - r2) * (1.0 - r2);
  float lit = clamp(shape.z * 0.55, 0.0, 1.2);
  vec3 colour = vec3(0.88, 0.86, 0.84) * sqrt(lit / (1.0 + 0.5 * lit));
  gl_FragColor = vec4(colour * tone.rgb, tone.a * density);
}
