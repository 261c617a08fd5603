#include "vest_instruments/kinematics/trainer_box.h"

#include <cmath>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <sstream>

#include <yaml-cpp/yaml.h>

namespace vest::kinematics {
namespace {

using Eigen::Vector3d;

/// A node together with where it stands, so that every refusal names file and field.
struct Field {
  const std::string& file;
  std::string path;
  YAML::Node node;

  [[noreturn]] void refuse(const std::string& value, const std::string& allowed) const {
    throw LayoutError(file + ": " + path + ": " + value + "; allowed: " + allowed);
  }
  std::string text() const {
    std::ostringstream out;
    out << node;
    return out.str();
  }
  void onlyKeys(std::initializer_list<const char*> keys) const {
    if (!node.IsMap()) refuse("not a map", "a map of keys");
    std::string known;
    for (const char* k : keys) known += (known.empty() ? "" : ", ") + std::string(k);
    for (auto it = node.begin(); it != node.end(); ++it) {
      if (!it->first.IsScalar()) refuse("a key that is no word", known);
      const std::string key = it->first.Scalar();
      bool found = false;
      int count = 0;
      for (const char* k : keys) found = found || key == k;
      for (auto other = node.begin(); other != node.end(); ++other) {
        if (other->first.IsScalar() && other->first.Scalar() == key) ++count;
      }
      if (!found) refuse("unknown key '" + key + "'", known);
      if (count > 1) refuse("key '" + key + "' given twice", "each key once");
    }
  }
  Field at(const char* key) const {
    Field child{file, path.empty() ? key : path + "." + key, node[key]};
    if (!child.node) child.refuse("missing", "it must be given");
    return child;
  }
  double number(double lower, double upper) const {
    double value = 0.0;
    try {
      value = node.as<double>();
    } catch (const YAML::Exception&) {
      refuse("'" + text() + "' is no number", "a number");
    }
    if (!(value >= lower && value <= upper)) {
      std::ostringstream allowed;
      allowed << lower << " … " << upper;
      refuse(text(), allowed.str());
    }
    return value;
  }
  Vector3d vector(double lower, double upper) const {
    if (!node.IsSequence() || node.size() != 3) refuse("'" + text() + "'", "three numbers [x, y, z]");
    Vector3d v;
    for (int i = 0; i < 3; ++i) v[i] = element(i).number(lower, upper);
    return v;
  }
  Field element(int i) const { return {file, path + "[" + std::to_string(i) + "]", node[i]}; }
};

void readLimit(const Field& limits, const char* name, double least, double most, double& lower,
               double& upper) {
  const Field f = limits.at(name);
  if (!f.node.IsSequence() || f.node.size() != 2) f.refuse("'" + f.text() + "'", "[lower, upper]");
  lower = f.element(0).number(least, most);
  upper = f.element(1).number(least, most);
  if (!(lower < upper)) f.refuse("lower is not below upper", "[lower, upper] with lower < upper");
}

TrainerArm readArm(const Field& f, tools::Instrument instrument, const JointLimits& limits) {
  TrainerArm arm;
  arm.present = true;
  arm.limits = limits;
  const bool endoscope = instrument == tools::Instrument::Endoscope;
  if (endoscope) {
    f.onlyKeys({"pivot", "aim", "optic_angle"});
    arm.tool = tools::ToolKind::Endoscope;
    arm.optic_angle = f.at("optic_angle").number(0.0, 1.6);
    arm.limits.lower.jaw = -M_PI;  // light_post turns all the way
    arm.limits.upper.jaw = M_PI;
  } else {
    f.onlyKeys({"pivot", "aim", "tool"});
    const Field tool = f.at("tool");
    const auto kind = tool.node.IsScalar() ? tools::toolFromName(tool.node.Scalar()) : std::nullopt;
    if (!kind || *kind == tools::ToolKind::Endoscope) {
      std::string names;
      for (int i = 0; i + 1 < tools::kToolKindCount; ++i) {
        names += (i ? ", " : "") + std::string(tools::toolName(static_cast<tools::ToolKind>(i)));
      }
      tool.refuse("'" + tool.text() + "'", names);
    }
    arm.tool = *kind;
  }
  arm.pivot_B = f.at("pivot").vector(-2.0, 2.0);
  arm.aim_B = f.at("aim").vector(-2.0, 2.0);
  try {
    arm.X_BTrocar = trocarFrame(arm.pivot_B, arm.aim_B);
  } catch (const LayoutError& e) {
    f.at("aim").refuse(e.what(), "a point away from the pivot, and not straight to its side");
  }
  return arm;
}

std::string readText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw LayoutError(path + ": cannot be read; allowed: a readable YAML file");
  constexpr std::size_t kMost = 64 * 1024;  // the shipped file has 2 kB
  std::string text(kMost + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMost)
    throw LayoutError(path + ": more than 64 KiB; allowed: a layout file up to 64 KiB");
  int depth = 0;
  bool comment = false;
  for (const char c : text) {
    if (c == '\n') comment = false;
    if (c == '#') comment = true;
    if (comment) continue;
    if (c == '&' || c == '*') throw LayoutError(path + ": YAML anchor or alias; allowed: plain YAML");
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > 8) throw LayoutError(path + ": nested deeper than 8; allowed: a layout file");
  }
  return text;
}

}  // namespace

Eigen::Isometry3d trocarFrame(const Vector3d& pivot_B, const Vector3d& aim_B) {
  const Vector3d along = aim_B - pivot_B;
  if (!along.allFinite() || along.norm() < 1e-6) throw LayoutError("aim and pivot coincide");
  const Vector3d z = along.normalized();
  const Vector3d side = Vector3d::UnitX() - z.x() * z;
  if (side.norm() < 1e-3) throw LayoutError("the shaft lies along x");
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear().col(0) = side.normalized();
  X.linear().col(1) = z.cross(side.normalized());
  X.linear().col(2) = z;
  X.translation() = pivot_B;
  return X;
}

TrainerBox loadTrainerBox(const std::string& path) {
  const std::string text = readText(path);
  Field root{path, "", {}};
  try {
    root.node = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw LayoutError(path + ": line " + std::to_string(e.mark.line + 1) + ": " + e.msg + "; allowed: YAML");
  }
  try {
    root.onlyKeys({"box", "limits", "instruments"});
    TrainerBox box;
    const Field f = root.at("box");
    f.onlyKeys({"inside", "dome"});
    box.inside = f.at("inside").vector(0.05, 2.0);
    box.dome = f.at("dome").number(0.0, 0.5);

    const Field l = root.at("limits");
    l.onlyKeys({"yaw", "pitch", "insertion", "roll", "jaw"});
    JointLimits limits;
    readLimit(l, "yaw", -1.57, 1.57, limits.lower.yaw, limits.upper.yaw);
    readLimit(l, "pitch", -1.57, 1.57, limits.lower.pitch, limits.upper.pitch);
    readLimit(l, "insertion", 0.0, 1.0, limits.lower.insertion, limits.upper.insertion);
    readLimit(l, "roll", -100.0, 100.0, limits.lower.roll, limits.upper.roll);
    readLimit(l, "jaw", 0.0, M_PI, limits.lower.jaw, limits.upper.jaw);

    const Field instruments = root.at("instruments");
    instruments.onlyKeys({"left", "right", "third", "endoscope"});
    for (int i = 0; i < tools::kInstrumentCount; ++i) {
      const auto instrument = static_cast<tools::Instrument>(i);
      const std::string name(tools::instrumentName(instrument));
      if (instrument == tools::Instrument::Third && !instruments.node[name]) continue;
      box.arms[static_cast<std::size_t>(i)] = readArm(instruments.at(name.c_str()), instrument, limits);
    }
    return box;
  } catch (const YAML::Exception& e) {
    throw LayoutError(path + ": line " + std::to_string(e.mark.line + 1) + ": " + e.msg +
                      "; allowed: a layout");
  }
}

}  // namespace vest::kinematics
