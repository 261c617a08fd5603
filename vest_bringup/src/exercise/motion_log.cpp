#include "vest_bringup/exercise/motion_log.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::exercise {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// Whether a row of a snapshot could have been logged.
bool plausible(double step, double t, const std::array<double, 3>& p, const std::array<double, 4>& q) {
  double turn = 0;
  for (const double v : q) turn += v * v;
  return step >= 0 && step < MotionLog::kEver && std::abs(t) < 1e9 && std::abs(p[0]) < 1e3 &&
         std::abs(p[1]) < 1e3 && std::abs(p[2]) < 1e3 && std::abs(turn - 1) < 1e-3;
}

}  // namespace

MotionLog::MotionLog(const Tools& logged, std::size_t rows) : logged_(logged), most_(rows) {
  for (std::size_t i = 0; i < kTools; ++i)
    if (logged_[i]) rows_[i].reserve(most_);
}

MotionLog& MotionLog::operator=(const MotionLog& other) {
  if (this == &other) return *this;
  const bool same = life_ == other.life_;
  logged_ = other.logged_, most_ = other.most_, life_ = other.life_;
  for (std::size_t i = 0; i < kTools; ++i) {
    const auto& from = other.rows_[i];
    auto& to = rows_[i];
    to.resize(same ? std::min(to.size(), from.size()) : 0);
    if (logged_[i]) to.reserve(most_);
    to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(to.size()), from.end());
  }
  return *this;
}

void MotionLog::add(double t, std::uint64_t step, const scene::StepInput& input) {
  for (std::size_t i = 0; i < kTools; ++i) {
    const scene::ToolInput& tool = input.tools[i];
    if (!logged_[i] || !tool.present || (most_ != 0 && rows_[i].size() >= most_)) continue;
    const auto& q = tool.orientation.coeffs();
    rows_[i].push_back({static_cast<double>(step),
                        t,
                        {tool.position.x(), tool.position.y(), tool.position.z()},
                        {q[0], q[1], q[2], q[3]}});
  }
}

void MotionLog::clear() {
  ++life_;
  for (auto& rows : rows_) rows.clear();
}

session::motion::Figures MotionLog::figures(const std::vector<Moment>& moments, double from,
                                            double to) const {
  using session::MotionTable;
  session::motion::Figures out;
  const auto addTo = [](MotionTable& table, std::size_t as, const Row& row) {
    const auto& q = row.orientation;
    if (table.tools.size() <= as) table.tools.resize(as + 1);
    if (as == 0) table.time.push_back(row.t);
    table.tools[as].position.emplace_back(row.position[0], row.position[1], row.position[2]);
    table.tools[as].orientation.emplace_back(q[3], q[0], q[1], q[2]);
  };
  const auto counts = [&](const Row& row) { return row.step >= from && row.step <= to; };
  MotionTable both;
  for (std::size_t l = 0, r = 0; l < rows_[0].size() && r < rows_[1].size();) {
    const Row &left = rows_[0][l], &right = rows_[1][r];
    if (left.step == right.step && counts(left)) addTo(both, 0, left), addTo(both, 1, right);
    l += left.step <= right.step, r += right.step <= left.step;
  }
  if (both.time.size() > 1) out = session::motion::figuresOf(both);
  out.tools.clear(), out.duration = out.path = 0;
  for (std::size_t i = 0; i < kTools; ++i) {
    MotionTable table;
    std::vector<double> steps;
    for (const Row& row : rows_[i])
      if (counts(row)) addTo(table, 0, row), steps.push_back(row.step);
    if (steps.size() < 2) continue;
    out.tools.push_back(session::motion::figuresOf(table).tools.front());
    session::motion::ToolFigures& f = out.tools.back();
    f.name = tools::instrumentName(static_cast<tools::Instrument>(i));
    out.path += f.path, out.duration = std::max(out.duration, f.duration);
    const std::vector<Eigen::Vector3d>& tip = table.tools.front().position;
    double straight = 0;
    std::size_t at = 0, goals = 0;
    for (const Moment& m : moments) {
      const auto step = static_cast<double>(m.step);
      if (m.kind != Moment::Kind::PhaseEnded || step < from || step > to) continue;
      const auto next = std::lower_bound(steps.begin(), steps.end(), step);
      const std::size_t goal = std::min(static_cast<std::size_t>(next - steps.begin()), steps.size() - 1);
      straight += (tip[goal] - tip[at]).norm();
      at = goal, ++goals;
    }
    if (goals > 0 && f.path > 0) f.economy = std::min(1.0, straight / f.path);
  }
  return out;
}

void MotionLog::save(std::vector<std::uint8_t>& bytes) const {
  const auto put = [&bytes](const void* data, std::size_t count) {
    const auto* from = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), from, from + count);
  };
  for (const auto& rows : rows_) {
    const std::uint64_t count = rows.size();
    put(&count, sizeof count), put(rows.data(), rows.size() * sizeof(Row));
  }
}

const std::uint8_t* MotionLog::restore(const std::uint8_t* bytes, const std::uint8_t* end) {
  ++life_;
  for (std::size_t i = 0; i < kTools; ++i) {
    std::uint64_t count = 0;
    if (static_cast<std::size_t>(end - bytes) < sizeof count) return nullptr;
    std::memcpy(&count, bytes, sizeof count);
    bytes += sizeof count;
    const std::size_t room = logged_[i] ? (most_ != 0 ? most_ : kNone) : 0;
    if (count > room || count > static_cast<std::size_t>(end - bytes) / sizeof(Row)) return nullptr;
    rows_[i].resize(count);
    if (count > 0) std::memcpy(rows_[i].data(), bytes, count * sizeof(Row));
    bytes += count * sizeof(Row);
    double step = -1, t = -1e9;
    for (const Row& row : rows_[i]) {
      // The figures divide by what lies between two rows.
      if (!(row.step > step && row.t > t + 1e-9) ||
          !plausible(row.step, row.t, row.position, row.orientation))
        return nullptr;
      step = row.step, t = row.t;
    }
  }
  return bytes;
}

}  // namespace vest::exercise
