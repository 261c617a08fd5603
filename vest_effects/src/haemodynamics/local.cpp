#include "local.h"

#include <cmath>

namespace vest::haemodynamics {

namespace {

int faceOf(const SegmentModel& s, double station) {
  int face = static_cast<int>(station / s.dx + 0.5);
  if (face < 1) face = 1;
  if (face > s.cells - 1) face = s.cells - 1;
  return face;
}

// The first closure at a face acts for all of them.
bool isFirst(const Model& model, const Inputs& inputs, int index) {
  const Closure& c = inputs.closures[index];
  const SegmentModel& s = model.segments[c.segment];
  for (int i = 0; i < index; ++i) {
    const Closure& other = inputs.closures[i];
    if (other.segment == c.segment && faceOf(s, other.station) == faceOf(s, c.station)) return false;
  }
  return true;
}

}  // namespace

void applyClosure(const Model& model, const Inputs& inputs, int index, Scratch& scratch) {
  scratch.closure_jump[index] = 0;
  if (!isFirst(model, inputs, index)) return;
  const Closure& closure = inputs.closures[index];
  const SegmentModel& s = model.segments[closure.segment];
  const int face = faceOf(s, closure.station);
  double opening = closure.opening;
  for (int i = index + 1; i < inputs.closure_count; ++i) {
    const Closure& other = inputs.closures[i];
    if (other.segment == closure.segment && faceOf(s, other.station) == face && other.opening < opening)
      opening = other.opening;
  }
  if (opening >= 1) return;

  const int f = s.first_face + face, left = s.first_cell + face - 1, right = left + 1;
  const double rho = model.density;
  const double p_l = scratch.p_right[left], u_l = scratch.u_right[left];
  const double p_r = scratch.p_left[right], u_r = scratch.u_left[right];
  const double s_l = model.face_sqrt_area_ref[f] + p_l * model.face_inv_beta[f];
  const double s_r = model.face_sqrt_area_ref[f] + p_r * model.face_inv_beta[f];
  const double a_l = s_l * s_l, a_r = s_r * s_r;
  const double z_l = std::sqrt(model.face_half_rho_beta[f] * s_l),
               z_r = std::sqrt(model.face_half_rho_beta[f] * s_r);
  // Each side's characteristic: p = p_face ± z (u_face − q/A). Their difference is the loss k q|q|.
  const double drive = (p_l + z_l * u_l) - (p_r - z_r * u_r);
  const double linear = z_l / a_l + z_r / a_r;
  double q = 0;
  if (opening > 0) {
    const double area = 0.5 * (a_l + a_r), ratio = 1 / opening - 1;
    const double k = 0.5 * rho * 1.52 * ratio * ratio / (area * area);
    q = 2 * drive / (linear + std::sqrt(linear * linear + 4 * k * std::fabs(drive)));
  }
  const double v_l = q / a_l, v_r = q / a_r;
  const double left_flux = 0.5 * v_l * v_l + (p_l + z_l * (u_l - v_l)) / rho;
  const double right_flux = 0.5 * v_r * v_r + (p_r - z_r * (u_r - v_r)) / rho;
  scratch.flux_area[f] = q;
  scratch.flux_velocity[f] = left_flux;
  scratch.closure_jump[index] = right_flux - left_flux;
}

void finishClosure(const Model& model, const Inputs& inputs, int index, double dt, State& state,
                   const Scratch& scratch) {
  const double jump = scratch.closure_jump[index];
  if (jump == 0) return;
  const Closure& closure = inputs.closures[index];
  const SegmentModel& s = model.segments[closure.segment];
  const int cell = s.first_cell + faceOf(s, closure.station);
  const double g = 0.5 * dt * model.friction, a = state.area[cell];
  state.velocity[cell] += dt / s.dx * jump * (a / (a + g));
}

namespace {

/// Speed w through a hole: P(A) − P_ext = rho w|w|/2 at A = before − theta·k·w, k·w being the area lost in
/// the step. f(w) = root(w)² + theta k w − before rises for root ≥ 0; Newton, kept inside a bracket.
double holeSpeed(double before, double root_ext, double q, double theta_k) {
  const double head = (std::sqrt(before) - root_ext) / q;  // square of the speed if no pressure were lost
  const double free_speed = std::sqrt(std::fabs(head));
  double low = head < 0 ? -free_speed : 0, high = head < 0 ? 0 : free_speed;
  double w = head < 0 ? low : high;
  for (int iteration = 0; iteration < 60; ++iteration) {
    const double r = root_ext + q * w * std::fabs(w);
    const double f = (r > 0 ? r * r : -r * r) + theta_k * w - before;
    (f > 0 ? high : low) = w;
    double next = w - f / (4 * q * std::fabs(r) * std::fabs(w) + theta_k);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double change = std::fabs(next - w);
    w = next;
    if (change <= 1e-12 * (std::fabs(w) + 1e-6)) break;
  }
  return w;
}

}  // namespace

double leak(const Model& model, const Hole& hole, double dt, State& state) {
  const SegmentModel& s = model.segments[hole.segment];
  int cell = static_cast<int>(hole.station / s.dx);
  if (cell > s.cells - 1) cell = s.cells - 1;
  const int i = s.first_cell + cell;
  const double k = dt * hole.discharge * hole.area / s.dx;
  if (k <= 0) return 0;
  const double before = state.area[i];
  const double root_ext =
      model.sqrt_area_ref[i] + (hole.external_pressure - s.reference_pressure) / model.beta[i];
  if (hole.outward_only && std::sqrt(before) <= root_ext) return 0;
  const double q = 0.5 * model.density / model.beta[i];
  // The pressure halfway through the loss is the accurate one; the pressure after it is the stable one for
  // large holes.
  const double implicit = holeSpeed(before, root_ext, q, k);
  const double share = k * std::fabs(implicit) / (0.2 * before);
  const double theta = share < 1 ? 0.5 + 0.5 * share : 1;
  const double after = before - k * (theta < 1 ? holeSpeed(before, root_ext, q, theta * k) : implicit);
  if (!(after > 0)) return 0;
  state.area[i] = after;
  const double lost = (before - after) * s.dx;
  state.leak_volume[hole.segment] += lost;
  return lost;
}

}  // namespace vest::haemodynamics
