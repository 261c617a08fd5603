#version 120
// What hides a volume: any opaque mesh, by its place alone.
uniform mat4 worldviewproj_matrix;
varying vec2 uv;

void main() {
  uv = gl_MultiTexCoord0.xy;
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
