#version 120
// A drop smeared by its motion, a piece of a thin stream, or an air bubble. By effects/drops.cpp.
varying vec2 corner;  // along the motion, across it
varying vec4 tone;    // radius (mm), length of the streak over it, how much its blood hides, opacity
varying vec4 shape;   // kind: 0 drop, 1 bubble, 2 stream; flatness; strength of the light

vec3 response(vec3 c) {  // as in tissue.frag
  c = 1.0 - 1.0 / (1.0 + c * (1.0 + c * (0.5 + 0.17 * c)));
  c = sqrt(c);
  c = mix(c, c * c * (3.0 - 2.0 * c), 0.85);
  c = max(1.06 * c - 0.06, 0.0);
  float grey = dot(c, vec3(0.3, 0.6, 0.1));
  return mix(c, vec3(grey), 0.36 - 0.27 * min(grey, 1.0));
}

void main() {
  float y = corner.y;
  float c2 = 1.0 - y * y;
  if (c2 <= 0.0) discard;
  float c = sqrt(c2);  // half the chord that passes here
  vec3 colour;
  float a;
  if (shape.x > 0.5 && shape.x < 1.5) {
    float r2 = dot(corner, corner);
    if (r2 > 1.0) discard;
    float z = sqrt(1.0 - r2);
    float glint = max(0.0, z * 0.93 - 0.30 * corner.y - 0.12 * corner.x);
    glint *= glint; glint *= glint; glint *= glint; glint *= glint;
    glint *= glint;
    float ring = smoothstep(0.45, 0.92, r2) * smoothstep(1.0, 0.94, r2);
    colour = vec3(0.75, 0.70, 0.68) * (0.25 * ring + 0.05) + 2.5 * glint;
    a = clamp(0.10 + 0.45 * ring + 1.5 * glint, 0.0, 1.0) * tone.a;
    gl_FragColor = vec4(response(colour * shape.z), a);
    return;
  }
  // Share of the exposure in which the drop covers this place; its mean thickness then, over its radius.
  float cover = 1.0, z = c, flash = 1.0, s = max(tone.y, 0.25);
  if (shape.x < 0.5) {
    float x = corner.x * (1.0 + 0.5 * tone.y);
    cover = clamp((min(c, x + 0.5 * s) - max(-c, x - 0.5 * s)) / s, 0.0, 1.0);
    z = tone.y < 1.0 ? mix(sqrt(max(c2 - x * x, 0.0)), 0.785 * c, tone.y) : 0.785 * c;
    // The lamp's image is a point in the drop: it draws a line while the shutter is open.
    float half_way = 0.5 * tone.y + 0.12, along = (x + 0.1) / half_way;
    flash = max(1.0 - along * along, 0.0) * min(1.0, mix(1.2, 0.35, tone.z) / max(tone.y, 0.01));
    z *= mix(1.0, z, shape.y);
  }
  float mm = 2.0 * tone.x * z;  // of fluid behind this place
  float hide = tone.z;
  float deep = 1.0 - exp(-1.1 * mm);
  // Blood: thin it lets the ground through and is bright, thick it is dark; water bends light at its rim.
  vec3 blood = mix(vec3(0.55, 0.040, 0.031), vec3(0.28, 0.010, 0.010), deep);
  float rim = 1.0 - z; rim *= rim;
  float across = y - 0.30;
  float glint = exp(-across * across * 170.0) * flash;
  colour = mix(vec3(0.46, 0.41, 0.40), blood, hide) * (0.45 + 0.55 * z);
  colour += rim * (1.0 - 0.7 * hide) * vec3(0.10, 0.045, 0.04) + (1.6 - 0.4 * hide - 0.5 * shape.y) * glint * vec3(0.95, 0.98, 1.0);
  a = mix(0.14 + 0.40 * rim, 1.0 - exp(-4.0 * mm), hide);
  a = clamp(cover * a + min(glint * shape.z, 1.0) * cover * (0.9 - 0.65 * hide), 0.0, 1.0) * tone.a;
  // Near the lens the exposure has no room for more. With less, blood is black beads before films and pools (by eye).
  gl_FragColor = vec4(response(colour * min(shape.z, 4.0)), a);
}
