#include "vest_effects/fluid/model.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace vest::fluid {
namespace {

constexpr double kPi = 3.14159265358979;

[[noreturn]] void refuse(const std::string& field, double value, const std::string& allowed) {
  std::ostringstream text;
  text << "fluid: " << field << ": " << value << " (allowed: " << allowed << ")";
  throw std::invalid_argument(text.str());
}

void within(const std::string& field, double value, double low, double high, const char* unit) {
  if (value >= low && value <= high) return;
  std::ostringstream allowed;
  allowed << low << " to " << high << unit;
  refuse(field, value, allowed.str());
}

void check(const Parameters& p) {
  within("spacing", p.spacing, 0.0005, 0.010, " m");
  within("capacity", p.capacity, 16, 60000, " particles");
  within("iterations", p.iterations, 1, 50, "");
  within("density", p.density, 500, 2000, " kg/m3");
  within("blood_density", p.blood_density, 500, 2000, " kg/m3");
  within("water_viscosity", p.water_viscosity, 0, 1, " Pa s");
  within("blood_viscosity", p.blood_viscosity, 0, 1, " Pa s");
  within("water_tension", p.water_tension, 0, 0.5, " N/m");
  within("blood_tension", p.blood_tension, 0, 0.5, " N/m");
  within("contact_angle_cosine", p.contact_angle_cosine, -1, 1, "");
  within("restitution", p.restitution, 0, 1, "");
  within("friction", p.friction, 0, 1, "");
  within("splash_share", p.splash_share, 0, 0.5, "");
  within("splash_restitution", p.splash_restitution, 0, 1, "");
  within("rest_time", p.rest_time, 0, 1e6, " s");
  within("pool_cell", p.pool_cell, 0.001, 0.05, " m");
  static const char* const kAxis[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    within(std::string("low.") + kAxis[i], p.low[i], -100, 100, " m");
    within(std::string("high.") + kAxis[i], p.high[i], -100, 100, " m");
    const double side = p.high[i] - p.low[i];
    if (!(side >= 0.01 && side <= 2.0)) refuse(std::string("high - low, ") + kAxis[i], side, "0.01 to 2 m");
  }
}

/// Akinci's cohesion kernel over (32/(pi h^9)): 0 at h, strongest near h/2, repulsive close by.
double cohesionShape(double r, double h) {
  const double a = (h - r) * (h - r) * (h - r) * r * r * r;
  if (2 * r > h && r <= h) return a;
  if (r > 0 && 2 * r <= h) return 2 * a - h * h * h * h * h * h / 64;
  return 0;
}

}  // namespace

Model buildModel(const Parameters& parameters, const std::vector<SurfaceSize>& surfaces) {
  check(parameters);
  if (surfaces.size() > 60000) refuse("surfaces", static_cast<double>(surfaces.size()), "at most 60000");
  Model m;
  m.parameters = parameters;
  m.surfaces = surfaces;
  m.first_knot.push_back(0);
  for (const SurfaceSize& s : surfaces) {
    m.first_knot.push_back(m.first_knot.back() + s.knots);
    m.triangles += s.triangles;
  }
  if (m.triangles > 10000000 || m.first_knot.back() > 10000000)
    refuse("surfaces", static_cast<double>(m.triangles), "at most 10 million triangles and knots");
  const auto cells = [&](int i) {
    return static_cast<int>((parameters.high[i] - parameters.low[i]) / parameters.pool_cell + 0.999);
  };
  m.columns = cells(0);
  m.rows = cells(1);
  const double d = parameters.spacing, h = 2 * d;
  m.whole = d * d * d;
  m.h = static_cast<float>(h);
  // Sums over a cubic lattice of spacing d within the kernel: density 1 there.
  double density = 0, slopes = 0;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (int k = -2; k <= 2; ++k) {
        const double r2 = (i * i + j * j + k * k) * d * d / (h * h);
        if (r2 < 1) density += (1 - r2) * (1 - r2) * (1 - r2);
      }
    }
  }
  m.density_scale = static_cast<float>(1.0 / density);
  // Both kernels integrate to 1: 315/(64 pi h³) and, for the gradient, 45/(pi h⁴). Their ratio is kept.
  const double gradient = (45.0 / h) / (315.0 / 64.0) / density;
  m.gradient_scale = static_cast<float>(gradient);
  // Integrals of both over a plane with one particle per spacing².
  m.layer_density = static_cast<float>(kPi * h * h / (4 * d * d) / density);
  m.layer_slope = static_cast<float>(2 * kPi * gradient * h * h / (3 * d * d));
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (int k = -2; k <= 2; ++k) {
        const double q = std::sqrt(static_cast<double>(i * i + j * j + k * k)) * d / h;
        if (q > 0 && q < 1) slopes += gradient * gradient * (1 - q) * (1 - q) * (1 - q) * (1 - q);
      }
    }
  }
  m.relaxation = static_cast<float>(0.02 * slopes);
  // A pair of whole particles attracts with the acceleration c·C(r). Work to part two half spaces, per area:
  // 2 sigma = (pi/4) rho/V · c · integral of C(r)·r⁴ (Rayleigh; Rowlinson and Widom 1982, section 1.3).
  double integral = 0;
  const int steps = 2000;
  for (int k = 0; k < steps; ++k) {
    const double r = (k + 0.5) * h / steps;
    integral += cohesionShape(r, h) / (h * h * h * h * h * h) * r * r * r * r * h / steps;
  }
  const auto cohesion = [&](double sigma) {
    return static_cast<float>(8 * sigma * m.whole / (kPi * parameters.density * integral));
  };
  m.cohesion_water = cohesion(parameters.water_tension);
  m.cohesion_blood = cohesion(parameters.blood_tension);
  // A wall pulls with a (1 − z/h) up to z = 0.75 h: the work to part the fluid from it, per area, is
  // rho·a·h²·0.1406.
  const auto adhesion = [&](double sigma) {
    return static_cast<float>(sigma * (1 + parameters.contact_angle_cosine) /
                              (0.1406 * parameters.density * h * h));
  };
  m.adhesion_water = adhesion(parameters.water_tension);
  m.adhesion_blood = adhesion(parameters.blood_tension);
  return m;
}

}  // namespace vest::fluid
