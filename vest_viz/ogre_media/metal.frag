#version 120
// Instruments: dark, desaturated; they take the colour of what they mirror.
uniform vec4 light;  // as in tissue.frag
uniform vec4 metal;  // reflectance, roughness 0 … 1, insulation 0 … 1, diffuse 0 … 1
uniform vec4 colour;  // of the reflection; of the body where it is diffuse
uniform float depth_in_alpha;
varying vec3 position;
varying vec3 normal;
varying vec3 tangent;
varying vec2 uv;
varying vec4 tint;

void main() {
  vec3 v = normalize(-position);
  vec3 n = normalize(normal);
  if (dot(n, v) < 0.0) n = -n;
  vec3 to_light = light.xyz - position;
  float d2 = dot(to_light, to_light);
  vec3 l = to_light * inversesqrt(d2);
  float beam = v.z * v.z * v.z * v.z;
  float strength = light.w * beam * beam / (d2 + 0.0012);
  float nl = max(dot(n, l), 0.0);
  vec3 h = normalize(l + v);
  float nh = max(dot(n, h), 0.0);
  float broad = pow(nh, mix(40.0, 10.0, metal.y));
  float sharp = pow(nh, mix(700.0, 160.0, metal.y));
  // What lies in the mirrored direction: lit tissue ahead, dark cavity behind, brighter below the horizon.
  vec3 r = reflect(-v, n);
  float ahead = clamp(0.5 - 0.5 * r.z, 0.0, 1.0);
  float band = smoothstep(-0.2, 0.75, r.y) * 0.5 + 0.5;
  vec3 mirrored = mix(vec3(0.010, 0.004, 0.004), vec3(0.17, 0.060, 0.05) * band, ahead * ahead);
  float fresnel = pow(1.0 - max(dot(n, v), 0.0), 4.0);
  vec3 steel = colour.rgb * metal.x;
  // tint.a: how open the place is (grooves between teeth are not).
  vec3 lit = steel * (0.11 * nl + (0.42 * broad + 1.6 * sharp) * tint.a * tint.a) * strength * (1.0 - 0.8 * metal.z);
  lit += colour.rgb * (metal.w * (0.15 + 0.85 * nl) * strength);
  lit += mirrored * (metal.x * 1.4 + 0.5 * fresnel) * (0.35 + 0.65 * tint.a) * min(strength * 1.6, 1.3) * (1.0 - 0.5 * metal.z);
  lit = 1.0 - exp(-lit);
  lit = sqrt(lit);
  lit = mix(lit, lit * lit * (3.0 - 2.0 * lit), 0.75);  // as in tissue.frag
  // Depth for the finishing pass, as in tissue.frag.
  gl_FragColor = vec4(lit, mix(1.0, 1.0 - sqrt(min(-position.z / 0.3, 1.0)), depth_in_alpha));
}
