#version 120
// Skins coloured by a value, for inspection.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
varying vec3 position;
varying vec3 normal;
varying vec3 shade;

void main() {
  position = (worldview_matrix * gl_Vertex).xyz;
  normal = (worldview_matrix * vec4(gl_Normal, 0.0)).xyz;
  shade = gl_MultiTexCoord2.rgb;
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
