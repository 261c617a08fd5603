#version 120
// Gauze: as metal.vert, and where on the wad it is.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
varying vec3 position;
varying vec3 normal;
varying vec3 place;   // m, of the wad: z along the shaft, to its front
varying vec3 facing;  // likewise

void main() {
  position = (worldview_matrix * gl_Vertex).xyz;
  normal = (worldview_matrix * vec4(gl_Normal, 0.0)).xyz;
  place = gl_Vertex.xyz;
  facing = gl_Normal;
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
