#include "effect_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace vest::tools {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

const Vector3d kWound(0.012, 0.045, 0.085), kBurn(-0.012, 0.045, 0.085), kClipPlace(0.07, 0.06, 0.06);

/// 0 … 1, the same on every machine.
double hash(std::uint32_t i) {
  i = (i ^ 61u) ^ (i >> 16);
  i *= 9u;
  i ^= i >> 4;
  i *= 0x27d4eb2du;
  i ^= i >> 15;
  return i / 4294967295.0;
}

geometry_msgs::Pose poseOf(const Vector3d& p, const Vector3d& z, const Vector3d& towards_x) {
  Eigen::Matrix3d R;
  R.col(2) = z.normalized();
  R.col(0) = (towards_x - towards_x.dot(R.col(2)) * R.col(2)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  const Eigen::Quaterniond q(R);
  geometry_msgs::Pose pose;
  pose.position.x = p.x(), pose.position.y = p.y(), pose.position.z = p.z();
  pose.orientation.w = q.w(), pose.orientation.x = q.x(), pose.orientation.y = q.y(),
  pose.orientation.z = q.z();
  return pose;
}

vest_msgs::TissueField fieldOf(std::uint8_t kind, float low, float high) {
  vest_msgs::TissueField f;
  f.kind = kind, f.minimum = low, f.maximum = high;
  return f;
}

std::uint8_t scaled(double value) {
  return static_cast<std::uint8_t>(255 * std::clamp(value, 0.0, 1.0));
}

/// The uterus, or what moves first in a scene without one.
std::string hurtObject(const vest::scene::Description& scene) {
  std::string first;
  for (const auto& o : scene.objects) {
    if (o.name == "uterus") return o.name;
    if (first.empty() && o.model != vest::scene::ObjectModel::Rigid) first = o.name;
  }
  return first;
}

}  // namespace

std::set<std::string> effectWords(const std::string& text) {
  static const std::set<std::string> kAllowed{"fields", "cut",   "clips", "sutures",
                                              "fluid",  "smoke", "lens",  "monitor"};
  std::set<std::string> words;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, ',');) {
    if (word == "all") {
      words = kAllowed;
    } else if (kAllowed.count(word) == 0) {
      throw std::invalid_argument(
          "effects: '" + word +
          "' (allowed: all, or some of fields,cut,clips,sutures,fluid,smoke,lens,monitor)");
    } else {
      words.insert(word);
    }
  }
  return words;
}

bool placeOn(const vest::scene::Description& scene, const std::string& object, const Vector3d& near,
             Vector3d* place, Vector3d* out) {
  for (const auto& o : scene.objects) {
    if (o.name != object || o.rest_position.empty()) continue;
    Vector3d middle = Vector3d::Zero();
    double best = std::numeric_limits<double>::infinity();
    for (const Vector3d& p : o.rest_position) {
      middle += p / static_cast<double>(o.rest_position.size());
      if ((p - near).norm() < best) {
        best = (p - near).norm();
        *place = p;
      }
    }
    *out = (*place - middle).normalized();
    return out->allFinite();
  }
  return false;
}

void addFields(const vest::scene::Description& scene, double t, vest_msgs::TissueState* state) {
  const double grown = std::clamp(t / 4, 0.0, 1.0);
  auto bleeding = fieldOf(vest_msgs::TissueField::BLEEDING, 0, 2e-9f);
  auto damage = fieldOf(vest_msgs::TissueField::DAMAGE, 0, 1);
  auto burnt = fieldOf(vest_msgs::TissueField::CHAR, 0, 1);
  auto perfusion = fieldOf(vest_msgs::TissueField::PERFUSION, 0, 1);
  auto oxygen = fieldOf(vest_msgs::TissueField::OXYGENATION, 0, 1);
  auto strain = fieldOf(vest_msgs::TissueField::STRAIN, 0, 1);
  auto temperature = fieldOf(vest_msgs::TissueField::TEMPERATURE, 310, 373);
  auto stress = fieldOf(vest_msgs::TissueField::STRESS, 0, 5000);
  auto wetness = fieldOf(vest_msgs::TissueField::WETNESS, 0, 1);
  Vector3d wound = kWound, burn = kBurn, out;
  const std::string hurt = hurtObject(scene);
  placeOn(scene, hurt, kWound, &wound, &out);
  placeOn(scene, hurt, kBurn, &burn, &out);
  for (const auto& o : scene.objects)
    for (const Vector3d& p : o.rest_position) {
      const double a = (p - wound).norm() / (0.004 + 0.008 * grown), b = (p - burn).norm() / 0.006;
      const bool soft = o.model != vest::scene::ObjectModel::Rigid;
      bleeding.data.push_back(scaled(soft ? 1.3 * std::exp(-a * a) : 0));
      damage.data.push_back(scaled(soft ? 1.4 * grown * std::exp(-0.5 * b * b) : 0));
      burnt.data.push_back(scaled(soft ? 1.3 * grown * std::exp(-2.2 * b * b) : 0));
      oxygen.data.push_back(scaled(o.name == "tube_right" ? 0.8 - 0.6 * grown : 0.8));
      perfusion.data.push_back(scaled(o.name == "ovary_left" ? 1 - 0.9 * grown : 1));
      strain.data.push_back(scaled(soft ? 0.6 * std::exp(-0.3 * a * a) : 0));
      temperature.data.push_back(scaled(soft ? grown * std::exp(-0.4 * b * b) : 0));
      stress.data.push_back(scaled(soft ? 0.9 * std::exp(-0.25 * a * a) : 0));
      wetness.data.push_back(scaled(soft ? 0.9 * std::exp(-1.2 * a * a) : 0));
    }
  state->fields = {strain, bleeding, damage, burnt, perfusion, temperature, stress, wetness, oxygen};
}

void addCut(vest_msgs::TissueTopology* topology) {
  for (vest_msgs::TissueObject& o : topology->objects) {
    if (o.name != "uterus") continue;
    o.triangle_layer.resize(o.triangles.size() / 3, 0);
    for (std::size_t t = 0; t < o.triangle_layer.size(); ++t) {
      Vector3d middle = Vector3d::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t entry = o.binding_start[o.triangles[3 * t + k]];
        const std::uint32_t knot = o.binding_knots[entry];
        for (int c = 0; c < 3; ++c)
          middle[c] += o.rest_position[3 * knot + static_cast<std::uint32_t>(c)] / 3;
      }
      if (std::fabs(middle.x()) < 0.004 && middle.z() > 0.06) o.triangle_layer[t] = 2;
    }
  }
}

vest_msgs::TissueAttachments attachmentsAt(const vest::scene::Description& scene) {
  vest_msgs::TissueAttachments m;
  m.header.frame_id = "world";
  m.header.stamp = ros::Time::now();
  std::uint64_t id = 1;
  for (const auto& [object, near] : {std::pair<const char*, Vector3d>{"tube_right", {0.035, 0.045, 0.065}},
                                     {"tube_right", {0.042, 0.045, 0.065}},
                                     {"uterine_artery_right", kClipPlace}}) {
    Vector3d p, out;
    if (!placeOn(scene, object, near, &p, &out)) continue;
    vest_msgs::TissueAttachment a;
    a.id = id++;
    a.kind = vest_msgs::TissueAttachment::CLIP;
    a.object = object;
    a.pose = poseOf(p + Vector3d(0, 0, 0.001), Vector3d(-0.2, 0.9, -0.3), Vector3d(1, 0, 0));
    a.closure = 1;
    m.attachments.push_back(a);
  }
  return m;
}

vest_msgs::SutureStates suturesAt(const vest::scene::Description& scene, double t) {
  vest_msgs::SutureStates m;
  m.header.frame_id = "world";
  m.header.stamp = ros::Time::now();
  Vector3d p, out;
  if (placeOn(scene, "tube_left", {-0.045, 0.045, 0.06}, &p, &out)) {
    vest_msgs::SutureSling sling;
    sling.id = 1;
    sling.object = "tube_left";
    for (int i = 0; i < 24; ++i) {
      const double a = 2 * kPi * i / 24;
      const Vector3d q = p + 0.0055 * Vector3d(0.1 * std::cos(a), std::cos(a), std::sin(a));
      for (int k = 0; k < 3; ++k) sling.positions.push_back(static_cast<float>(q[k]));
    }
    sling.knot.x = p.x(), sling.knot.y = p.y(), sling.knot.z = p.z() + 0.0055;
    sling.tied = true;
    m.slings.push_back(sling);
  }
  vest_msgs::SutureNeedle needle;
  needle.id = 1, needle.thread = 1;
  needle.wire_radius = 0.0004;
  const Vector3d centre(0.005, 0.028, 0.088), x = Vector3d(0.2, -1, 0.3).normalized(),
                                              y = Vector3d(0.2, 0.1, 1).cross(x).normalized();
  for (int i = 0; i <= 24; ++i) {
    const double a = kPi * (0.5 - i / 24.0);
    const Vector3d q = centre + 0.008 * (std::cos(a) * x + std::sin(a) * y);
    for (int k = 0; k < 3; ++k) needle.positions.push_back(static_cast<float>(q[k]));
  }
  m.needles.push_back(needle);
  vest_msgs::SutureThread thread;
  thread.id = 1;
  thread.radius = 0.0002f;
  const Vector3d tail = centre - 0.008 * y;
  for (int i = 0; i < 60; ++i) {
    const double s = i / 59.0;
    const Vector3d q = tail + Vector3d(-0.03 * s + 0.004 * std::sin(9 * s + 0.5 * t), -0.02 * s,
                                       -0.02 * s + 0.004 * std::cos(11 * s));
    for (int k = 0; k < 3; ++k) thread.positions.push_back(static_cast<float>(q[k]));
  }
  m.threads.push_back(thread);
  return m;
}

vest_msgs::FluidState fluidAt(const vest::scene::Description& scene, double t) {
  vest_msgs::FluidState m;
  m.header.frame_id = "world";
  m.header.stamp = ros::Time::now();
  m.particle_radius = 0.0008f;
  Vector3d hole(0.02, 0.045, 0.07), out(0, -0.4, 0.9);
  placeOn(scene, "tube_right", {0.025, 0.045, 0.07}, &hole, &out);
  out = Vector3d(0.15, -0.45, 0.9).normalized();
  // A spurting jet by ballistics: speed follows the pulse at 72 per minute.
  // One particle after the other, as a vessel gives them (1 ml/s), and splashes where they land.
  constexpr std::uint32_t kStream = 45, kSplashes = 40;
  for (std::uint32_t i = 0; i < kStream + kSplashes; ++i) {
    const bool splash = i >= kStream;
    const double age = splash ? 0.15 + 0.03 * hash(i) : 0.18 * (i + 0.5) / kStream, born = t - age;
    const double pulse = 0.55 + 0.45 * std::max(0.0, std::sin(2 * kPi * 1.2 * born));
    const Vector3d side(hash(3 * i + 1) - 0.5, hash(3 * i + 2) - 0.5, hash(3 * i + 3) - 0.5);
    const Vector3d v0 = pulse * 0.75 * out + (splash ? 0.30 : 0.003) * side;
    const Vector3d p = hole + v0 * age + Vector3d(0, 0, -4.905 * age * age);
    const Vector3d v = v0 + Vector3d(0, 0, -9.81 * age);
    if (p.z() < 0.032) continue;
    for (int k = 0; k < 3; ++k) {
      m.positions.push_back(static_cast<float>(p[k]));
      m.velocities.push_back(static_cast<float>(v[k]));
    }
    m.blood_fraction.push_back(255);
    m.volume.push_back(static_cast<std::uint8_t>(splash ? 8 + 40 * hash(5 * i) : 255));
  }
  // A pool in front of the uterus, another one of diluted blood beside it.
  for (int which = 0; which < 2; ++which) {
    vest_msgs::FluidPool pool;
    pool.id = static_cast<std::uint32_t>(which);
    pool.cell = 0.0015;
    pool.columns = pool.rows = 30;
    pool.origin =
        poseOf({which == 0 ? -0.024 : 0.018, which == 0 ? 0.000 : 0.002, which == 0 ? 0.034 : 0.038},
               {0, 0, 1}, {1, 0, 0});
    for (std::uint32_t r = 0; r < pool.rows; ++r)
      for (std::uint32_t c = 0; c < pool.columns; ++c) {
        const double x = (c + 0.5) / pool.columns - 0.5, y = (r + 0.5) / pool.rows - 0.5;
        const double d = std::hypot(x, 1.1 * y), a = std::atan2(y, x) + 2.1 * which,
                     edge = 0.40 + 0.05 * std::sin(3 * a) + 0.03 * std::sin(5 * a + 1),
                     under = 5.0 * (1 - d * d / (edge * edge));  // mm
        double ripples = 0;  // m: they come from all sides and stay nowhere
        for (int wave = 0; wave < 5; ++wave) {
          const double way = 1.3 * wave + which,
                       across = 24 + 9 * wave;  // a pool's width holds so much phase
          ripples +=
              3e-5 * std::sin(across * (x * std::cos(way) + y * std::sin(way)) - (5 + wave) * t + 2.4 * wave);
        }
        pool.height.push_back(under > 0.1 ? static_cast<float>(ripples)
                                          : std::numeric_limits<float>::quiet_NaN());
        pool.velocity.push_back(0);
        pool.depth.push_back(under > 0.1 ? static_cast<std::uint8_t>(10 * under) : 0);
      }
    pool.blood_fraction = which == 0 ? 0.95f : 0.10f;
    pool.volume = 5e-6;
    for (std::uint32_t i = 0; i < 6; ++i)
      pool.bubbles.insert(
          pool.bubbles.end(),
          {static_cast<float>(pool.origin.position.x + 0.022 + 0.012 * (hash(7 * i) - 0.5)),
           static_cast<float>(pool.origin.position.y + 0.020 + 0.012 * (hash(7 * i + 1) - 0.5)),
           static_cast<float>(pool.origin.position.z + 0.0004),
           static_cast<float>(0.0006 + 0.0010 * hash(7 * i + 2))});
    m.pools.push_back(pool);
  }
  m.emitted = 20e-6, m.sucked = 4e-6;
  return m;
}

vest_msgs::SmokeState smokeAt(const vest::scene::Description& scene, double t) {
  vest_msgs::SmokeState m;
  m.header.frame_id = "world";
  m.header.stamp = ros::Time::now();
  Vector3d source = kBurn, out;
  placeOn(scene, "uterus", kBurn, &source, &out);
  m.cell = 0.006;
  m.size = {24, 24, 24};
  m.origin.x = source.x() - 0.072, m.origin.y = source.y() - 0.10, m.origin.z = source.z() - 0.02;
  m.density_scale = 0.02f;  // kg/m3: 2 % of it gives the look of the pictures
  for (std::uint32_t z = 0; z < 24; ++z)
    for (std::uint32_t y = 0; y < 24; ++y)
      for (std::uint32_t x = 0; x < 24; ++x) {
        const Vector3d p(m.origin.x + (x + 0.5) * m.cell, m.origin.y + (y + 0.5) * m.cell,
                         m.origin.z + (z + 0.5) * m.cell);
        const Vector3d d = p - source;
        const double up = std::max(0.0, d.z()), width = 0.006 + 0.35 * up;
        const double lean = d.y() + 0.25 * up, r2 = d.x() * d.x() + lean * lean;
        const double plume = d.z() > -0.004 ? std::exp(-r2 / (width * width)) * 0.9 / (1 + 25 * up) : 0;
        m.density.push_back(scaled(plume + 0.008));
      }
  for (std::uint32_t i = 0; i < 26; ++i) {
    const double age = std::fmod(t + 2.5 * hash(i), 2.5);
    vest_msgs::SmokePuff puff;
    puff.position.x = source.x() + 0.010 * (hash(5 * i) - 0.5) * (1 + age);
    puff.position.y = source.y() - 0.010 * age + 0.010 * (hash(5 * i + 1) - 0.5);
    puff.position.z = source.z() + 0.024 * age;
    puff.radius = static_cast<float>(0.003 + 0.006 * age);
    puff.density = static_cast<float>(0.03 / (1 + 4 * age));
    puff.age = static_cast<float>(age);
    puff.phase = static_cast<float>(age / 2.5);
    puff.seed = i;
    m.puffs.push_back(puff);
  }
  return m;
}

vest_msgs::LensState lensAt(double fog) {
  vest_msgs::LensState m;
  m.header.frame_id = "endoscope_optical_frame";
  m.header.stamp = ros::Time::now();
  m.temperature = 305, m.humidity = 0.95f;
  m.fog = static_cast<float>(fog);
  m.columns = 60, m.rows = 48;
  const double spots[][4] = {{22, 15, 4.0, 1}, {38, 31, 3.0, 1}, {30, 20, 2.0, 0}, {44, 18, 2.5, 0}};
  for (std::uint32_t r = 0; r < m.rows; ++r)
    for (std::uint32_t c = 0; c < m.columns; ++c) {
      double soil = 0, blood = 0;
      for (const auto& s : spots) {
        const double d = std::hypot(c - s[0], r - s[1]) / s[2];
        const double v = std::clamp(1.6 - d, 0.0, 1.0);
        soil = std::max(soil, 0.9 * v);
        if (v > 0) blood = std::max(blood, s[3]);
      }
      m.soiling.push_back(scaled(soil));
      m.soiling_blood.push_back(scaled(blood));
    }
  return m;
}

vest_msgs::HaemodynamicsState haemodynamicsAt(double t) {
  vest_msgs::HaemodynamicsState m;
  m.header.frame_id = "world";
  m.header.stamp = ros::Time::now();
  m.step = static_cast<std::uint64_t>(std::max(0.0, t) * 1000);
  m.heart_rate = 1.2;
  constexpr double kMmHg = 133.322;
  m.systolic = 118 * kMmHg, m.diastolic = 76 * kMmHg, m.mean_pressure = 90 * kMmHg;
  m.blood_loss = 2e-6 * std::max(0.0, t);
  m.blood_volume = 5e-3 - m.blood_loss;
  const double beat = std::fmod(t * m.heart_rate, 1.0);
  const double wave = std::exp(-std::pow((beat - 0.16) / 0.09, 2)) +
                      0.35 * std::exp(-std::pow((beat - 0.42) / 0.07, 2)) + 0.25 * std::exp(-3 * beat);
  // P, Q, R, S and T as bells; the upstroke of the pressure follows R.
  const double bells[][3] = {{0.86, 0.022, 0.12},
                             {0.985, 0.010, -0.08},
                             {0.01, 0.010, 1.0},
                             {0.035, 0.010, -0.18},
                             {0.27, 0.040, 0.28}};
  for (const auto& bell : bells) {
    const double off = std::remainder(beat - bell[0], 1.0) / bell[1];
    m.ecg += static_cast<float>(1e-3 * bell[2] * std::exp(-off * off));
  }
  m.pleth = static_cast<float>(0.08 * wave);
  m.spo2 = 0.98f, m.haematocrit = 0.38f, m.given = 5e-4;
  vest_msgs::VesselState vessel;
  vessel.name = "aorta";
  vessel.pressure_mid = static_cast<float>(m.diastolic + (m.systolic - m.diastolic) * std::min(1.0, wave));
  vessel.pressure_prox = vessel.pressure_dist = vessel.pressure_mid;
  m.pressure = vessel.pressure_mid;
  m.loss_rate = 2e-6;
  vessel.flow_mid = 83e-6f, vessel.radius_mid = 0.012f, vessel.dilatation = 1;
  m.vessels.push_back(vessel);
  return m;
}

vest_msgs::GasState gasAt() {
  constexpr float kMmHg = 133.322f;
  vest_msgs::GasState m;
  m.header.frame_id = "world";
  m.header.stamp = ros::Time::now();
  m.set_pressure = 12 * kMmHg, m.pressure = 11.8f * kMmHg;
  m.flow = 2.5e-5f, m.leak = 1.7e-5f, m.supplied = 6.2e-3;
  m.volume = 4e-3f, m.humidity = 0.93f, m.temperature = 309.5f;
  return m;
}

}  // namespace vest::tools
