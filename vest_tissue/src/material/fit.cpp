#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Dense>

#include "../files/csv_reader.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"

namespace vest::material {

Fit fitLaw(const std::vector<Point>& points, int terms) {
  if (terms < 1 || terms > 4)
    throw std::invalid_argument("terms: " + std::to_string(terms) + " (allowed: 1 … 4)");
  std::vector<double> strains;
  for (const Point& p : points)
    if (p.strain != 0.0) strains.push_back(p.strain);
  std::sort(strains.begin(), strains.end());
  strains.erase(std::unique(strains.begin(), strains.end()), strains.end());
  const auto tensile = std::count_if(strains.begin(), strains.end(), [](double e) { return e > 0.0; });
  if (static_cast<int>(strains.size()) < terms || (terms > 1 && tensile < terms)) {
    throw std::invalid_argument("curve: " + std::to_string(strains.size()) + " different strains, " +
                                std::to_string(tensile) + " in tension (at least " + std::to_string(terms) +
                                " in tension for " + std::to_string(terms) + " coefficients)");
  }
  // Columns scaled by the greatest strain: the fourth powers of 0.1 beside 1 would lose digits.
  const double top = std::max(std::fabs(strains.front()), std::fabs(strains.back()));
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(static_cast<int>(points.size()), terms);
  Eigen::VectorXd b(points.size());
  for (int i = 0; i < a.rows(); ++i) {
    const double e = points[i].strain / top;
    double power = e;
    for (int k = 0; k < (e > 0.0 ? terms : 1); ++k, power *= e) a(i, k) = power;
    b[i] = points[i].stress;
  }
  const auto factor = a.colPivHouseholderQr();
  if (factor.rank() < terms)
    throw std::invalid_argument("curve: its strains do not tell " + std::to_string(terms) +
                                " coefficients apart");
  const Eigen::VectorXd c = factor.solve(b), off = a * c - b;
  Fit fit;
  fit.terms = terms;
  fit.law.youngs_modulus = c[0] / top;
  if (!(fit.law.youngs_modulus > 0.0))
    throw std::invalid_argument("curve: E comes out as " + std::to_string(fit.law.youngs_modulus) +
                                " Pa (must be > 0: stress rises with strain from the origin)");
  double* const coefficients[] = {&fit.law.a2, &fit.law.a3, &fit.law.a4};
  for (int k = 1; k < terms; ++k) *coefficients[k - 1] = c[k] / (c[0] * std::pow(top, k));
  fit.least_strain = strains.front();
  fit.greatest_strain = strains.back();
  fit.law.max_strain = std::max(1e-3, fit.greatest_strain);
  fit.rms = std::sqrt(off.squaredNorm() / static_cast<double>(off.size()));
  fit.greatest = off.cwiseAbs().maxCoeff();
  const double spread = (b.array() - b.mean()).matrix().squaredNorm();
  fit.determination = spread > 0.0 ? 1.0 - off.squaredNorm() / spread : 0.0;
  fit.monotone = isMonotone(fit.law);
  return fit;
}

std::vector<Point> readCurve(const std::string& path) {
  const auto table = scene::csv::read(path, scene::yaml::readFile(path, 16u << 20), {"strain", "stress"}, {});
  const auto strain = static_cast<std::size_t>(table.column("strain"));
  const auto stress = static_cast<std::size_t>(table.column("stress"));
  std::vector<Point> points;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const Point p{table.rows[i][strain], table.rows[i][stress]};
    if (!(p.strain > -1.0 && p.strain <= 10.0))
      scene::yaml::fail(path, table.lines[i], "strain", std::to_string(p.strain),
                        "must be above -1 and at most 10 (no unit: 0.1 is 10 %)");
    if (!(std::fabs(p.stress) <= 1e12))
      scene::yaml::fail(path, table.lines[i], "stress", std::to_string(p.stress), "must be within ± 1e12 Pa");
    if (p.strain * p.stress < 0.0)
      scene::yaml::fail(path, table.lines[i], "stress", std::to_string(p.stress),
                        "must have the sign of its strain, " + std::to_string(p.strain));
    points.push_back(p);
  }
  if (points.size() < 3)
    scene::yaml::fail(path, 0, "rows", std::to_string(points.size()), "must be at least 3");
  return points;
}

}  // namespace vest::material
