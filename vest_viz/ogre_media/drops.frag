#version 120
// A drop as a lit ball or streak, an air bubble as a bright ring.
varying vec2 corner;
varying vec4 tone;
varying vec4 shape;  // kind: 0 drop, 1 bubble

vec3 response(vec3 c) {  // as in tissue.frag
  c = 1.0 - 1.0 / (1.0 + c * (1.0 + c * (0.5 + 0.17 * c)));
  c = sqrt(c);
  c = mix(c, c * c * (3.0 - 2.0 * c), 0.85);
  return max(1.06 * c - 0.06, 0.0);
}

void main() {
  float r2 = dot(corner, corner);
  if (r2 > 1.0) discard;
  float z = sqrt(1.0 - r2);
  float glint = max(0.0, z * 0.93 - 0.30 * corner.y - 0.12 * corner.x);
  glint *= glint; glint *= glint; glint *= glint; glint *= glint;
  vec3 colour;
  float a;
  if (shape.x < 0.5) {
    colour = tone.rgb * (0.25 + 0.75 * z) + 0.45 * glint * glint;
    a = tone.a * smoothstep(0.0, 0.25, 1.0 - r2);
  } else {
    float ring = smoothstep(0.45, 0.92, r2) * smoothstep(1.0, 0.94, r2);
    colour = vec3(0.75, 0.70, 0.68) * (0.25 * ring + 0.05) + 2.5 * glint * glint;
    a = clamp(0.10 + 0.45 * ring + 1.5 * glint * glint, 0.0, 1.0) * tone.a;
  }
  gl_FragColor = vec4(response(colour * shape.z), a);
}
