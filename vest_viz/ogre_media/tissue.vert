#version 120
// Skin of tissue. Lens and light lie side by side: one direction between the two serves shading and highlights.
uniform mat4 worldview_matrix;
uniform mat4 worldviewproj_matrix;
uniform vec4 light;  // view space position (m), intensity (m2) times exposure
uniform vec4 shadow[6];  // of two instruments: instrument/shadow.h
uniform vec4 shaft[6];  // instruments: two ends each in view space (m), radius; 0: there is none
varying vec3 halfway;    // to lens and light, along tangent, binormal, normal
varying vec4 uv;         // texture coordinates, strength of the light here, depth (m)
varying vec4 tint;       // tint.a: openness baked per vertex
varying vec3 cast0;      // place in the shadow of each instrument
varying vec3 cast1;
#ifdef STATE
varying vec4 state;      // film of blood, coagulated, charred, bloodless: 0 ... 1
varying vec3 blood_state;  // in the tissue without oxygen, flushed; film set: 0 ... 1
varying vec3 flow;         // down along the skin: sine of its slope, along tangent and binormal; time (s)
uniform vec4 moment;       // down in view space; s of the session
#endif

void main() {
  vec3 position = (worldview_matrix * gl_Vertex).xyz;
  vec3 n = normalize((worldview_matrix * vec4(gl_Normal, 0.0)).xyz);
  vec3 t = (worldview_matrix * vec4(gl_MultiTexCoord1.xyz, 0.0)).xyz;
  t = normalize(t - n * dot(n, t));
  vec3 b = cross(n, t);
  vec3 v = normalize(-position);
  vec3 to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 h = normalize(v + to_light * inversesqrt(d2));
  halfway = vec3(dot(h, t), dot(h, b), dot(h, n));
  // The beam is brightest in the middle; sides get less (the eighth power by the rings of real pictures; tuned).
  float beam = v.z * v.z * v.z * v.z;
  uv = vec4(gl_MultiTexCoord0.xy, light.w * beam * beam / (d2 + 0.0012), -position.z);
  tint = gl_Color;
  // An instrument near the skin takes light from it: its share of the sky is that of a long cylinder, r / distance.
  vec3 front = dot(n, v) < 0.0 ? -n : n;
  for (int i = 0; i < 6; i += 2) {
    vec3 along = shaft[i + 1].xyz - shaft[i].xyz, to = shaft[i].xyz - position;
    to += along * clamp(-dot(to, along) / max(dot(along, along), 1e-9), 0.0, 1.0);
    tint.a *= 1.0 - 0.75 * clamp(shaft[i].w * dot(to, front) / max(dot(to, to), 1e-9), 0.0, 1.0);
  }
  vec4 p = vec4(position, 1.0);
  cast0 = vec3(dot(shadow[0], p), dot(shadow[1], p), dot(shadow[2], p));
  cast1 = vec3(dot(shadow[3], p), dot(shadow[4], p), dot(shadow[5], p));
#ifdef STATE
  state = gl_MultiTexCoord2;
  blood_state = gl_MultiTexCoord3.xyz;
  flow = vec3(dot(moment.xyz, t), dot(moment.xyz, b), moment.w);
#endif
  gl_Position = worldviewproj_matrix * gl_Vertex;
}
