#version 120
// A film of blood on the ground: a skin close over it.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
varying vec3 position;
varying vec3 normal;  // view
varying vec2 place;   // m along the surface
varying vec3 film;    // µm, share that has set, how level the ground is
varying float rise;   // µm/m, of the thickness along the ground
varying vec2 down;    // along the ground: sine of its slope

void main() {
  position = (worldview_matrix * gl_Vertex).xyz;
  normal = (worldview_matrix * vec4(gl_Normal, 0.0)).xyz;
  place = gl_Vertex.xy;
  down = gl_Normal.xy;
  film = vec3(gl_MultiTexCoord1.xy, gl_Normal.z);
  rise = gl_MultiTexCoord1.z;
  // Towards the lens, so that the coarse ground does not come through.
  vec4 near = vec4(gl_Vertex.xyz, 1.0);
  gl_Position = worldviewproj_matrix * near;
  gl_Position.z -= 0.0025 / max(-position.z, 0.01) * gl_Position.w * 0.02;
}
