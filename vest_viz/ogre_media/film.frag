#version 120
// How much of the ground's light comes through a film of blood: drawn as a factor on what is there.
uniform sampler2D micro_map;
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec3 film;
varying float rise;

float filmOver(float film, float rise, vec3 rough, vec3 small);  // shore.frag

void main() {
  if (film.z <= 0.40) discard;  // see below
  vec3 rough = texture2D(micro_map, place * 17.0).xyz;
  vec3 small = texture2D(micro_map, place.yx * 83.0).xyz;
  float um = filmOver(film.x, rise, rough, small);
  // A steep wall is between the cells: their skin cuts through it in teeth.
  um *= smoothstep(0.40, 0.70, film.z);
  if (um < 0.5) discard;
  // Green light falls to 1/e in 35 µm (bleeding/surface.h), red reaches farther. The picture holds square roots of
  // light. What has set or dried is brown and lets less red through; the State knows that a thin rim dries first.
  float green = exp(-um / 70.0), red = exp(-um / 420.0);
  vec3 through = vec3(max(red, 0.72), max(green, 0.26), max(green, 0.25));
  through *= mix(vec3(1.0), vec3(0.58, 0.72, 0.70), film.y * smoothstep(0.5, 8.0, um));
  gl_FragColor = vec4(mix(vec3(1.0), through, smoothstep(0.5, 3.0, um)), 1.0);
}
