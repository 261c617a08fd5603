#version 120
// The relief of a film that runs. A texture that is carried along shears: two of them take turns.
uniform sampler2D micro_map;

/// Slopes, -0.5 ... 0.5. @param p place in the texture  @param way how far it runs in a turn
/// @param share of the turn that has passed, 0 ... 1
vec2 waves(vec2 p, vec2 way, float share) {
  vec2 a = texture2D(micro_map, p - way * (share - 0.5)).xy;
  vec2 b = texture2D(micro_map, p + 0.5 - way * (fract(share + 0.5) - 0.5)).xy;
  return mix(b, a, 1.0 - abs(2.0 * share - 1.0)) - 0.5;
}
