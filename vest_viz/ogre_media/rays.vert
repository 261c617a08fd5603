#version 120
// A quad over the whole window.
varying vec2 place;  // -1 ... 1, y upwards

void main() {
  place = gl_Vertex.xy;
  gl_Position = vec4(gl_Vertex.xy, 0.0, 1.0);
}
