#version 120
// Instruments: everything to view space, lit per pixel.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
varying vec3 position;
varying vec3 normal;
varying vec3 tangent;
varying vec2 uv;
varying vec4 tint;

void main() {
  position = (worldview_matrix * gl_Vertex).xyz;
  normal = (worldview_matrix * vec4(gl_Normal, 0.0)).xyz;
  tangent = (worldview_matrix * vec4(gl_MultiTexCoord1.xyz, 0.0)).xyz;
  uv = gl_MultiTexCoord0.xy;
  tint = gl_Color;
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
