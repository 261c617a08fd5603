#include <algorithm>
#include <cmath>
#include <map>

#include "vest_tissue/modelling/ring_net.h"

namespace vest::modelling {
namespace {

using Combination =
    std::map<std::uint32_t, double>;  // knot -> weight; ordered, so that results are reproducible

// Rows of knots that the patches run through: 0 is the start pole, 1 … rings, rings + 1 the end pole; one
// more row beyond each end is the opposite side of the nearest ring, which makes a pole smooth.
class Rows {
 public:
  explicit Rows(const RingNet& net) : net_(net) {}

  void add(int row, double place, double factor, Combination& out) const {
    const int rings = static_cast<int>(net_.rings);
    if (row >= 1 && row <= rings) return ring(row - 1, place, factor, out);
    const bool at_end = row > rings;
    const End end = at_end ? net_.end : net_.start;
    const int nearest = at_end ? rings - 1 : 0, inner = at_end ? rings - 2 : 1;
    if (end == End::Zip) {  // straight on
      ring(nearest, place, 2 * factor, out);
      return ring(inner, place, -factor, out);
    }
    if (row < 0 || row > rings + 1) return ring(nearest, place + 0.5 * net_.around, factor, out);
    if (end == End::Pole) {
      out[at_end ? net_.endPole() : net_.startPole()] += factor;
    } else {
      mean(nearest, factor, out);  // blunt; a bulge would need the next ring too: more than 16 knots a vertex
    }
  }

  void mean(int ring_index, double factor, Combination& out) const {
    for (std::uint32_t k = 0; k < net_.around; ++k) {
      out[net_.knot(static_cast<std::uint32_t>(ring_index), k)] += factor / net_.around;
    }
  }

 private:
  void ring(int ring_index, double place, double factor, Combination& out) const {
    const double whole = std::floor(place);
    const auto w = catmullRom(place - whole);
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t column =
          static_cast<std::uint32_t>(static_cast<int>(whole) + k - 1 + 2 * static_cast<int>(net_.around));
      if (w[k] != 0.0) out[net_.knot(static_cast<std::uint32_t>(ring_index), column)] += factor * w[k];
    }
  }
  const RingNet& net_;
};

double interpolate(const std::vector<double>& values, double place) {
  const double bounded = std::clamp(place, 0.0, static_cast<double>(values.size() - 1));
  const std::size_t i = std::min(static_cast<std::size_t>(bounded), values.size() - 2);
  const double t = bounded - static_cast<double>(i);
  return (1 - t) * values[i] + t * values[i + 1];
}

// Length along the meridians (mean over the ring) and radius, per row 0 … rings + 1.
void meridian(const RingNet& net, std::vector<double>& length, std::vector<double>& radius) {
  length.assign(1, 0.0);
  radius.assign(1, net.start == End::Zip ? net.mean_radius.front() : 0.0);
  const auto mean = [&](std::uint32_t ring) {
    Vector3 sum = Vector3::Zero();
    for (std::uint32_t k = 0; k < net.around; ++k) sum += net.knots[net.knot(ring, k)] / net.around;
    return sum;
  };
  const auto fromPole = [&](std::uint32_t ring, End end, std::uint32_t pole) {
    if (end == End::Zip) return 0.0;
    const Vector3 centre = end == End::Pole ? net.knots[pole] : mean(ring);
    double sum = 0;
    for (std::uint32_t k = 0; k < net.around; ++k)
      sum += (net.knots[net.knot(ring, k)] - centre).norm() / net.around;
    return sum;
  };
  for (std::uint32_t r = 0; r < net.rings; ++r) {
    double step = 0;
    if (r == 0) {
      step = fromPole(0, net.start, net.startPole());
    } else {
      for (std::uint32_t k = 0; k < net.around; ++k) {
        step += (net.knots[net.knot(r, k)] - net.knots[net.knot(r - 1, k)]).norm() / net.around;
      }
    }
    length.push_back(length.back() + step);
    radius.push_back(net.mean_radius[r]);
  }
  length.push_back(length.back() + fromPole(net.rings - 1, net.end, net.endPole()));
  radius.push_back(net.end == End::Zip ? net.mean_radius.back() : 0.0);
}

}  // namespace

scene::Skin makeSkin(const RingNet& net, std::uint32_t along, std::uint32_t around, std::uint32_t petals,
                     double petal_depth) {
  scene::Skin skin;
  const Rows rows(net);
  const int rings = static_cast<int>(net.rings);
  const std::uint32_t columns = net.around * around;
  std::vector<double> length, radius;
  meridian(net, length, radius);

  const auto vertex = [&](double place, double column, double angle) {
    Combination combination;
    const int span = std::min(static_cast<int>(std::floor(place)), rings);
    const auto w = catmullRom(place - span);
    for (int j = 0; j < 4; ++j) {
      if (w[j] != 0.0) rows.add(span + j - 1, column, w[j], combination);
    }
    if (petals > 0 && place > rings - 1) {  // fringes: grow from the last but one ring to the lip, end inside
      const double grown = place <= rings ? place - (rings - 1) : std::max(0.0, 1 - (place - rings) / 0.7);
      const double depth = petal_depth * grown * grown * std::cos(petals * angle);
      for (auto& entry : combination) entry.second *= 1 + depth;
      rows.mean(rings - 1, -depth, combination);
    }
    double sum = 0;
    for (auto& [knot, weight] : combination) {
      if (std::abs(weight) < 1e-9) weight = 0;
      sum += weight;
    }
    for (const auto& [knot, weight] : combination) {
      if (weight == 0) continue;
      skin.binding_knots.push_back(knot);
      skin.binding_weights.push_back(static_cast<float>(weight / sum));
    }
    skin.binding_start.push_back(static_cast<std::uint32_t>(skin.binding_knots.size()));
    const double r = interpolate(radius, place);
    double u = interpolate(length, place);
    if (net.inside) u += 0.35 * r * std::sin(angle);  // so that a cavity's two halves do not look mirrored
    const double turned = angle > M_PI ? 2 * M_PI - angle : angle;
    skin.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(r * (turned - M_PI / 2))});
  };
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    net.inside ? skin.triangles.push_back({a, c, b}) : skin.triangles.push_back({a, b, c});
  };

  skin.binding_start.push_back(0);
  const bool start_vertex = net.start != End::Zip, end_vertex = net.end != End::Zip;
  const int first = start_vertex ? 1 : static_cast<int>(along);
  const int last = static_cast<int>(along) * (rings + 1) - (end_vertex ? 1 : static_cast<int>(along));
  if (start_vertex) vertex(0.0, 0.0, M_PI / 2);
  const std::uint32_t base = start_vertex;
  for (int i = first; i <= last; ++i) {
    for (std::uint32_t k = 0; k < columns; ++k) {
      vertex(static_cast<double>(i) / along, static_cast<double>(k) / around, 2 * M_PI * k / columns);
    }
  }
  if (end_vertex) vertex(rings + 1.0, 0.0, M_PI / 2);
  const std::uint32_t row_count = static_cast<std::uint32_t>(last - first + 1);
  const auto at = [&](std::uint32_t row, std::uint32_t k) { return base + row * columns + k % columns; };

  for (const bool end : {false, true}) {
    const std::uint32_t row = end ? row_count - 1 : 0;
    if (end ? end_vertex : start_vertex) {
      const std::uint32_t pole = end ? base + row_count * columns : 0;
      for (std::uint32_t k = 0; k < columns; ++k) {
        end ? triangle(pole, at(row, k), at(row, k + 1)) : triangle(pole, at(row, k + 1), at(row, k));
      }
    } else {  // zip from the middle of the upper edge downwards
      std::uint32_t low = (net.around - 1) * around + (around + 1) / 2, high = low + columns - 1;
      const auto emit = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        end ? triangle(at(row, a), at(row, b), at(row, c)) : triangle(at(row, a), at(row, c), at(row, b));
      };
      while (low + 1 < high) {
        emit(low, low + 1, high);
        if (++low + 1 < high) {
          emit(low, high - 1, high);
          --high;
        }
      }
    }
  }
  for (std::uint32_t row = 0; row + 1 < row_count; ++row) {
    for (std::uint32_t k = 0; k < columns; ++k) {
      const std::uint32_t a = at(row, k), b = at(row, k + 1), c = at(row + 1, k + 1), d = at(row + 1, k);
      if ((row + k) % 2 == 0) {
        triangle(a, b, c);
        triangle(a, c, d);
      } else {
        triangle(a, b, d);
        triangle(b, c, d);
      }
    }
  }
  skin.layer.assign(skin.triangles.size(), 0);
  return skin;
}

}  // namespace vest::modelling
