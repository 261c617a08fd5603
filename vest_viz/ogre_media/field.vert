#version 120
// Skins coloured by a value, for inspection.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
uniform vec4 slice;  // plane in the mesh's own frame
varying vec3 position;
varying vec3 normal;
varying vec3 shade;
varying float kept;

void main() {
  position = (worldview_matrix * gl_Vertex).xyz;
  normal = (worldview_matrix * vec4(gl_Normal, 0.0)).xyz;
  shade = gl_MultiTexCoord2.rgb;
  kept = dot(slice, vec4(gl_Vertex.xyz, 1.0));
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
