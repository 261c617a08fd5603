#pragma once

namespace vest::haemodynamics::kernel {

/// One segment's arrays, seen by the kernels. Pressures are P − P_ref. Faces: cells + 1.
struct SegmentView {
  int cells;
  double inv_dx, inv_density;
  double friction;  // m²/s
  // geometry
  const double *sqrt_area_ref, *beta;                                     // per cell
  const double *face_sqrt_area_ref, *face_inv_beta, *face_half_rho_beta;  // per face
  // state
  double *area, *velocity;  // per cell
  // work
  double *pressure, *inv_area;                  // per cell
  double *p_left, *u_left, *p_right, *u_right;  // per cell, at its two faces
  double *flux_area, *flux_velocity, *speeds;   // per face
};

/// The same source compiled for several instruction sets; all give the same bits (IEEE operations in the same
/// order, no contraction). `fluxes` reconstructs, advances the face values by dt/2 and solves the interior
/// faces; returns the greatest
/// (|U| + c)/dx seen, 1/s. `update` advances the cells by dt once the two end fluxes are known.
struct Kernels {
  const char* level;
  double (*fluxes)(const SegmentView&, double dt);
  void (*update)(const SegmentView&, double dt);
  /// Greatest (|U| + c)/dx of the cells; infinite if an area is not positive, a number not finite or |U| ≥ c
  /// anywhere.
  double (*survey)(const SegmentView&);
  /// 0 if survey() would be finite, else 1; cheaper.
  double (*stray)(const SegmentView&);
};

extern const Kernels kBaseline;
extern const Kernels kAvx2;

/// The best level of this processor, or what the environment variable VEST_KERNEL says: "baseline" or
/// "avx2".
const Kernels& selected();

}  // namespace vest::haemodynamics::kernel
