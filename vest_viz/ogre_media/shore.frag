#version 120
// Where a pool or a film of blood ends: its ground has a relief that the cells do not know.

/// How a value rises along a surface, per metre. @param place m, on it
vec2 slope(float value, vec2 place) {
  vec2 px = dFdx(place), py = dFdy(place);
  float area = px.x * py.y - px.y * py.x;
  return abs(area) > 1e-14
      ? vec2(dFdx(value) * py.y - dFdy(value) * px.y, dFdy(value) * px.x - dFdx(value) * py.x) / area : vec2(0.0);
}

/// mm of fluid, < 0 where the ground is dry. @param depth mm, by the cells
/// @param rough, small  the micro relief at 11 and at 47 tiles a metre
float depthOver(float depth, vec2 place, vec3 rough, vec3 small) {
  // Folds some 18 mm apart: between them it runs out in fingers, and their crests are bare. They draw the shore in by
  // some 5 mm, on steep ground as on level one (sizes by eye).
  float fold = min(5.0 * abs(rough.z - 0.5), 1.0), steep = length(slope(0.001 * depth, place));
  return depth + 0.5 * (rough.z - 0.5) + 0.2 * (small.z - 0.5) - (0.7 + min(5.0 * steep, 3.0)) * fold;
}

/// µm of a film of blood. It gathers between crests and stands in drops and streaks, and its border follows the folds.
/// @param film µm, by the cells  @param rise µm/m, of it  @param rough, small  the micro relief at 17 and at 83 tiles a metre
float filmOver(float film, float rise, vec3 rough, vec3 small) {
  float crest = 0.6 * rough.z + 0.4 * small.z - 0.5, fold = min(5.0 * abs(rough.z - 0.5), 1.0), um = min(film, 140.0);
  um -= min(0.005 * rise, 140.0) * fold * (1.0 - um / 140.0);
  return max(um * (1.0 - 2.2 * crest) - 14.0 * (1.0 + 2.0 * crest), 0.0);
}
