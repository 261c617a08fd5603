#include <algorithm>
#include <cmath>

#include "vest_tissue/fem/cut_factor.h"
#include "vest_tissue/fem/tissue.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;

bool turns(const TissueModel& t) {
  return t.model->description.strain == Strain::Corotational;
}

/// m/N, of a whole object.
Matrix3d wholeAnswer(const TissueModel& t, const TissueState& s, const TissueScratch& w, Index a, Index b) {
  const Index oa = s.origin[a], ob = s.origin[b];
  if (t.model->unknown[oa] < 0 || t.model->unknown[ob] < 0) return Matrix3d::Zero();
  const std::int32_t ra = t.answer_number[oa], rb = t.answer_number[ob];
  Matrix3d D = Matrix3d::Zero();
  if (t.condensed()) return t.compliance.block(static_cast<std::size_t>(ra), static_cast<std::size_t>(rb));
  const bool freed = t.motion == Motion::Elastostatic && s.factored && !w.cut->still(a);
  if (ra >= 0 && rb >= 0 && !freed) {
    D = t.answer.block<3, 3>(3 * ra, 3 * rb);
    if (turns(t)) D = w.rotation[s.knot_element[a]] * D * w.rotation[s.knot_element[b]].transpose();
  }
  // Where the cut mesh has no factor, or too many knots are touched: a copy, or an inner knot that a cut laid
  // open, can also move by itself.
  const bool alone =
      freed || (s.revision > 0 && (ra < 0 || a != oa || s.mass[a] < 0.999 * t.model->mass[oa]));
  if (a == b && alone) D += (t.step * t.step * t.loose_inverse[oa]) * Matrix3d::Identity();
  return D;
}

/// Columns of the knots of all points. False: no factor of the cut mesh, or no room.
bool touchAll(const TissueModel& t, const TissueState& s, TissueScratch& w) {
  if (!w.cut || !w.cut->renew(t, s)) return false;
  std::array<Index, 2 * kMostTouched> knots;
  std::size_t count = 0;
  for (const TissuePoint& point : w.points)
    for (int a = 0; a < point.used(); ++a)
      if (point.weights[a] != 0.0) knots[count++] = point.knots[a];
  return w.cut->touch(knots.data(), count);
}

}  // namespace

void answerPoints(const TissueModel& t, const TissueState& s, double h, TissueScratch& w) {
  const std::size_t count = w.points.size();
  const double ratio = h / t.step;
  const bool elastostatic = t.motion != Motion::BackwardEuler, turning = turns(t);
  const bool updated = (elastostatic ? s.factored : s.x.size() > t.model->mass.size()) && touchAll(t, s, w);
  // Knots of different parts do not answer each other.
  const auto scaleAt = [&](Index k) {
    const bool still = elastostatic && (!s.factored || w.cut->still(k));
    return still ? h / ((h + w.delay) * s.stiffness_scale) : std::min(1.0, ratio * ratio);
  };
  const double square = t.step * t.step;
  for (std::size_t p = 0; p < count; ++p) {
    for (std::size_t q = 0; q <= p; ++q) {
      Matrix3d sum = Matrix3d::Zero();
      for (int a = 0; a < w.points[p].used(); ++a) {
        if (w.points[p].weights[a] == 0.0) continue;
        for (int b = 0; b < w.points[q].used(); ++b) {
          if (w.points[q].weights[b] == 0.0) continue;
          const Index ka = w.points[p].knots[a], kb = w.points[q].knots[b];
          const double weight = scaleAt(ka) * w.points[p].weights[a] * w.points[q].weights[b];
          if (!updated) {
            sum += weight * wholeAnswer(t, s, w, ka, kb);
            continue;
          }
          Matrix3d D = (weight * square) * w.cut->answer(ka, kb);
          if (turning) D = w.rotation[s.knot_element[ka]] * D * w.rotation[s.knot_element[kb]].transpose();
          sum += D;
        }
      }
      w.answers[p * kMostTissuePoints + q] = sum;
      w.answers[q * kMostTissuePoints + p] = sum.transpose();
    }
  }
}

}  // namespace vest::fem
