#version 120
// Surface of standing fluid.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
varying vec3 position;
varying vec3 normal;  // world, up
varying vec2 place;   // m along the surface
varying vec3 fluid;   // share of blood, depth (mm), < 0 beyond the shore, speed of the waves (m/s)

void main() {
  position = (worldview_matrix * gl_Vertex).xyz;
  normal = gl_Normal;
  place = gl_Vertex.xy;
  fluid = gl_MultiTexCoord1.xyz;
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
