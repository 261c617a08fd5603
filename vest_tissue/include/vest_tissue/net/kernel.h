#pragma once

#include <cstddef>
#include <cstdint>

namespace vest::net {

/// Everything the hot loops see of one object: plain arrays, structure of arrays, each 64-byte aligned and padded to
/// a multiple of 16 entries (padding knots have inverse mass 0, padding links modulus 0 and damping 0 and join knot 0
/// to the padding knot). Metres, kilograms, seconds, newtons; world frame.
struct KernelArrays {
  std::size_t knots = 0;  ///< padded
  std::size_t links = 0;  ///< padded
  float *x, *y, *z;       ///< m
  float *vx, *vy, *vz;    ///< m/s
  const float* inverse_mass;  ///< 1/kg, 0 for fixed knots: the seed's B_i
  const float* decay;         ///< gamma_i/m_i, 1/s
  const float *hx, *hy, *hz;  ///< N: forces held over the present batch (gravity, slow elements, connections)
  float *fx, *fy, *fz;        ///< N: sum of forces of the present sub-step
  const std::uint32_t *knot0, *knot1;
  const float* inverse_rest;  ///< 1/m; 0 for viscous links
  const float* modulus;       ///< N: E·area, or k·rest for the linear form; 0 for viscous and dead links
  const float* damping;       ///< N·s/m along the link
  const float* nonlinear;     ///< 1: the law's polynomial applies, 0: linear
  float a2, a3, a4;           ///< the law's coefficients
  float max_strain;           ///< above it the law goes on along its tangent
  float excess_slope;         ///< slope there, beyond the linear one: d/de of e²(a2 + a3·e + a4·e²)
};

/// Link law: tension T = modulus·(e + nonlinear·(c²(a2 + c(a3 + c·a4)) + excess_slope·max(e - max_strain, 0)))
///           + damping·(v1 - v0)·u,   e = l/rest - 1, c = clamp(e, 0, max_strain), u = (p1 - p0)/l;  F0 = T·u = -F1.
/// Same operations in the same order on every level: the same bits (docs/decisions/0120-…).
struct Kernel {
  const char* name;  ///< baseline, avx2 …
  /// f = h, then adds the forces of all links.
  void (*forces)(const KernelArrays& a);
  /// v = (v + dt·f·inverse_mass) / (1 + dt·decay), x += dt·v   (models.md section 2, Newton-Euler; x: ours).
  /// Fixed knots keep their velocity 0.
  void (*integrate)(const KernelArrays& a, float dt);
};

/// Level used by this process: the best one that the processor has, or what the environment variable VEST_KERNEL
/// (baseline | avx2) asks for; an unknown or unavailable name falls back to baseline.
const Kernel& kernel();
/// Nullptr where this build or processor does not have it.
const Kernel* kernelByName(const char* name);

}  // namespace vest::net
