#version 120
// The lamp in the wet surface of a film of blood: added to what is there.
uniform sampler2D micro_map;
uniform vec4 light;
uniform vec4 moment;  // s, of the session
varying vec3 position;
varying vec3 normal;
varying vec2 place;
varying vec3 film;
varying float rise;
varying vec2 down;  // along the ground, as steep as it is

vec2 waves(vec2 p, vec2 way, float share);  // waves.frag
float filmOver(float film, float rise, vec3 rough, vec3 small);  // shore.frag

void main() {
  if (film.x > 200.0 || film.z <= 0.40) discard;  // a pool stands on it, and shines instead; see film.frag
  // Where there is blood, as in film.frag.
  vec3 rough = texture2D(micro_map, place * 17.0).xyz;
  vec3 small = texture2D(micro_map, place.yx * 83.0).xyz;
  float um = filmOver(film.x, rise, rough, small);
  float wet = smoothstep(0.40, 0.70, film.z) * smoothstep(3.0, 16.0, um) * (1.0 - 0.85 * film.y);
  if (wet <= 0.0) discard;
  vec3 v = normalize(-position), to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 h = normalize(v + to_light * inversesqrt(d2));
  // Waves on a film that runs down a wall are three times as fast as it: rho g h^2 sin / mu (Nusselt 1916; blood of
  // 3.5 mPa s), which is 30 mm/s for 100 um on a vertical wall. What sets stands still.
  float thick = min(film.x, 100.0) * 0.01;
  vec2 way = down * (0.030 * thick * thick * (1.0 - film.y));
  vec2 slope = 1.5 * (rough.xy - 0.5) + 0.9 * (small.xy - 0.5) + (0.3 + 0.9 * thick) * waves(place * 41.0, way * 41.0, fract(moment.x));
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = -n;
  vec3 t = normalize(cross(n, vec3(0.0, 1.0, 0.001)));
  n = normalize(n + slope.x * t + slope.y * cross(n, t));
  float nh = max(dot(n, h), 0.0);
  nh *= nh; nh *= nh; nh *= nh; nh *= nh; nh *= nh; nh *= nh;  // ^64
  float sheen = nh;
  float mirror = nh * nh * nh;
  mirror *= mirror;  // ^384
  float beam = v.z * v.z * v.z * v.z;
  float strength = light.w * beam * beam / (d2 + 0.0012);
  gl_FragColor = vec4(vec3(0.95, 0.98, 1.0) * sqrt(min((60.0 * mirror + 0.004 * sheen) * strength, 1.0)) * wet, 1.0);
}
