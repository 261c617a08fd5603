// The loops of a kernel level. Included once per level inside an unnamed namespace; the compiler's target options
// differ, the operations and their order do not. Any topology: eight links at a time are gathered, worked on side by
// side and scattered in order.

constexpr std::size_t kLanes = 8;

inline void linkForces(const KernelArrays& a) {
  const std::size_t bytes = a.knots * sizeof(float);
  std::memcpy(a.fx, a.hx, bytes);
  std::memcpy(a.fy, a.hy, bytes);
  std::memcpy(a.fz, a.hz, bytes);
  for (std::size_t first = 0; first < a.links; first += kLanes) {
    alignas(64) float dx[kLanes], dy[kLanes], dz[kLanes], ux[kLanes], uy[kLanes], uz[kLanes];
    const std::uint32_t* const knot0 = a.knot0 + first;
    const std::uint32_t* const knot1 = a.knot1 + first;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint32_t p = knot0[i], q = knot1[i];
      dx[i] = a.x[q] - a.x[p];
      dy[i] = a.y[q] - a.y[p];
      dz[i] = a.z[q] - a.z[p];
      ux[i] = a.vx[q] - a.vx[p];
      uy[i] = a.vy[q] - a.vy[p];
      uz[i] = a.vz[q] - a.vz[p];
    }
    const float* const inverse_rest = a.inverse_rest + first;
    const float* const modulus = a.modulus + first;
    const float* const damping = a.damping + first;
    const float* const nonlinear = a.nonlinear + first;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float squared = (dx[i] * dx[i] + dy[i] * dy[i]) + (dz[i] * dz[i] + 1e-20f);
      const float length = std::sqrt(squared);
      const float strain = length * inverse_rest[i] - 1.0f;
      const float positive = strain > 0.0f ? strain : 0.0f;
      const float c = positive < a.max_strain ? positive : a.max_strain;
      const float excess = positive - c;
      const float polynomial = (c * c) * (a.a2 + c * (a.a3 + c * a.a4)) + a.excess_slope * excess;
      const float elastic = modulus[i] * (strain + nonlinear[i] * polynomial);
      const float rate = (dx[i] * ux[i] + dy[i] * uy[i]) + dz[i] * uz[i];  // times the length
      const float scale = (elastic + damping[i] * (rate / length)) / length;
      dx[i] *= scale;
      dy[i] *= scale;
      dz[i] *= scale;
    }
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::uint32_t p = knot0[i], q = knot1[i];
      a.fx[p] += dx[i];
      a.fy[p] += dy[i];
      a.fz[p] += dz[i];
      a.fx[q] -= dx[i];
      a.fy[q] -= dy[i];
      a.fz[q] -= dz[i];
    }
  }
}

inline void integrateKnots(const KernelArrays& a, float dt) {
  for (std::size_t i = 0; i < a.knots; ++i) {
    const float keep = 1.0f / (1.0f + dt * a.decay[i]);
    const float push = dt * a.inverse_mass[i];
    const float vx = keep * (a.vx[i] + push * a.fx[i]);
    const float vy = keep * (a.vy[i] + push * a.fy[i]);
    const float vz = keep * (a.vz[i] + push * a.fz[i]);
    a.vx[i] = vx;
    a.vy[i] = vy;
    a.vz[i] = vz;
    a.x[i] += dt * vx;
    a.y[i] += dt * vy;
    a.z[i] += dt * vz;
  }
}
