#version 120
// Quads built in world space by the program: corner in the texture coordinates, the rest in normal and tangent.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
uniform vec4 light;  // as in tissue.vert
varying vec2 corner;      // -1 ... 1
varying vec4 tone;        // colour, opacity
varying vec4 shape;       // kind, phase, strength of the light, depth (m)

void main() {
  vec3 position = (worldview_matrix * gl_Vertex).xyz;
  vec3 v = normalize(-position);
  vec3 to_light = light.xyz - position;
  float beam = v.z * v.z * v.z * v.z;
  corner = gl_MultiTexCoord0.xy;
  tone = vec4(gl_Normal, gl_MultiTexCoord1.x);
  shape = vec4(gl_MultiTexCoord1.yz, light.w * beam * beam / (dot(to_light, to_light) + 0.0012), -position.z);
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
