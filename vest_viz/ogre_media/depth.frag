#version 120
// Depth in 24 bits: red has the highest. With PICTURE what is clear in it hides nothing.
#ifdef PICTURE
uniform sampler2D picture;
#endif
varying vec2 uv;

void main() {
#ifdef PICTURE
  if (texture2D(picture, uv).a < 0.5) discard;
#endif
  float depth = floor(gl_FragCoord.z * 16777215.0);
  float high = floor(depth / 65536.0);
  float middle = floor((depth - 65536.0 * high) / 256.0);
  gl_FragColor = vec4(high, middle, depth - 65536.0 * high - 256.0 * middle, 255.0) / 255.0;
}
