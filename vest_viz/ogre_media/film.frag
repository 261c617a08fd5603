#version 120
// How much of the ground's light comes through a film of blood: drawn as a factor on what is there.
uniform sampler2D micro_map;
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec3 film;

float filmOver(float film, vec2 place, vec3 rough, vec3 small);  // shore.frag

void main() {
  vec3 rough = texture2D(micro_map, place * 17.0).xyz;
  vec3 small = texture2D(micro_map, place.yx * 83.0).xyz;
  float um = filmOver(film.x, place, rough, small);
  // A steep wall is between the cells: their skin cuts through it in teeth.
  um *= smoothstep(0.40, 0.70, film.z);
  if (um < 0.5) discard;
  // Green light falls to 1/e in 35 µm (bleeding/surface.h), red reaches farther. The picture holds square roots of
  // light. What has set is brown and lets less red through; its rim dries first and is darkest.
  float green = exp(-um / 70.0), red = exp(-um / 420.0);
  float rim = film.y * smoothstep(0.5, 4.0, um) * (1.0 - smoothstep(4.0, 14.0, um));
  vec3 through = vec3(max(red, 0.72), max(green, 0.26), max(green, 0.25));
  through *= mix(vec3(1.0), vec3(0.62, 0.80, 0.78), film.y * smoothstep(1.0, 25.0, um));
  through *= 1.0 - 0.22 * rim;
  gl_FragColor = vec4(mix(vec3(1.0), through, smoothstep(0.5, 3.0, um)), 1.0);
}
