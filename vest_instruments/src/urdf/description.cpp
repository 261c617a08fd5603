#include "vest_instruments/urdf/description.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "vest_instruments/tools/tool_geometry.h"

namespace vest::urdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using tools::Capsule;

/// Text of the file, with the numbers' digits enough to come back exact to 1e-12.
class Writer {
 public:
  Writer() { out_.precision(13); }

  static double clean(double v) { return std::abs(v) < 1e-13 ? 0.0 : v; }

  std::string origin(const Isometry3d& X) {
    std::ostringstream o;
    o.precision(13);
    const Vector3d p = X.translation();
    const Eigen::Matrix3d R = X.linear();
    // URDF: fixed-axis roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
    const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
    const double yaw = std::atan2(R(1, 0), R(0, 0)), roll = std::atan2(R(2, 1), R(2, 2));
    o << "<origin xyz=\"" << clean(p.x()) << ' ' << clean(p.y()) << ' ' << clean(p.z()) << "\" rpy=\""
      << clean(roll) << ' ' << clean(pitch) << ' ' << clean(yaw) << "\"/>";
    return o.str();
  }

  void fixed(const std::string& name, const std::string& parent, const std::string& child,
             const Isometry3d& X) {
    out_ << "  <joint name=\"" << name << "\" type=\"fixed\"><parent link=\"" << parent
         << "\"/><child link=\"" << child << "\"/>" << origin(X) << "</joint>\n";
  }
  void moving(const std::string& name, const std::string& type, const std::string& parent,
              const std::string& child, const Isometry3d& X, const char* axis, double lower, double upper,
              const std::string& mimic = {}) {
    // Effort and velocity are required by the format; nothing here reads them (assumed values).
    out_ << "  <joint name=\"" << name << "\" type=\"" << type << "\"><parent link=\"" << parent
         << "\"/><child link=\"" << child << "\"/>" << origin(X) << "<axis xyz=\"" << axis
         << "\"/><limit lower=\"" << lower << "\" upper=\"" << upper << "\" effort=\"10\" velocity=\"10\"/>"
         << mimic << "</joint>\n";
  }
  void emptyLink(const std::string& name) { out_ << "  <link name=\"" << name << "\"/>\n"; }
  void openLink(const std::string& name) { out_ << "  <link name=\"" << name << "\">\n"; }
  void closeLink() { out_ << "  </link>\n"; }
  void mesh(const std::string& file, const char* material) {
    out_ << "    <visual><geometry><mesh filename=\"package://vest_instruments/meshes/" << file
         << ".stl\"/></geometry><material name=\"" << material << "\"/></visual>\n";
  }
  void box(const Vector3d& centre, const Vector3d& size, const char* material, bool visible) {
    const std::string geometry = origin(Isometry3d(Eigen::Translation3d(centre))) + boxSize(size);
    if (visible) out_ << "    <visual>" << geometry << "<material name=\"" << material << "\"/></visual>\n";
    out_ << "    <collision>" << geometry << "</collision>\n";
  }
  void capsule(const Capsule& c) {
    Isometry3d X = Isometry3d::Identity();
    X.translation() = 0.5 * (c.a + c.b);
    X.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), c.b - c.a).toRotationMatrix();
    out_ << "    <collision>" << origin(X) << "<geometry><cylinder radius=\"" << c.radius << "\" length=\""
         << (c.b - c.a).norm() << "\"/></geometry></collision>\n";
  }
  std::ostringstream out_;

 private:
  static std::string boxSize(const Vector3d& size) {
    std::ostringstream o;
    o.precision(13);
    o << "<geometry><box size=\"" << size.x() << ' ' << size.y() << ' ' << size.z() << "\"/></geometry>";
    return o.str();
  }
};

void writeBox(Writer& w, const kinematics::TrainerBox& box) {
  const double x = box.inside.x(), y = box.inside.y(), z = box.inside.z(),
               t = 0.005;  // wall of 5 mm, assumed
  w.openLink("phantom_box");
  w.box({0, 0, -0.5 * t}, {x + 2 * t, y + 2 * t, t}, "floor", true);
  w.box({-0.5 * (x + t), 0, 0.5 * z}, {t, y, z}, "wall", true);
  w.box({0.5 * (x + t), 0, 0.5 * z}, {t, y, z}, "wall", true);
  w.box({0, 0.5 * (y + t), 0.5 * z}, {x + 2 * t, t, z}, "wall", true);
  w.box({0, -0.5 * (y + t), 0.5 * z}, {x + 2 * t, t, z}, "wall", true);
  w.box({0, 0, z + box.dome + 0.5 * t}, {x, y, t}, "wall", false);
  w.closeLink();
}

void writeArm(Writer& w, const std::string& name, const kinematics::TrainerArm& arm, tools::ToolKind tool) {
  const Isometry3d I = Isometry3d::Identity();
  const tools::ToolGeometry& g = tools::toolGeometry(tool);
  const auto& lo = arm.limits.lower;
  const auto& hi = arm.limits.upper;
  const bool endoscope = tool == tools::ToolKind::Endoscope;
  const std::string kind(tools::toolName(tool));

  w.openLink(name + "_trocar");
  w.mesh(endoscope ? "endoscope_trocar" : "trocar", "trocar");
  w.closeLink();
  w.fixed(name + "_trocar", "phantom_box", name + "_trocar", arm.X_BTrocar);
  w.emptyLink(name + "_yaw");
  w.moving(name + "_yaw", "revolute", name + "_trocar", name + "_yaw", I, "0 1 0", lo.yaw, hi.yaw);
  w.emptyLink(name + "_pitch");
  w.moving(name + "_pitch", "revolute", name + "_yaw", name + "_pitch", I, "1 0 0", lo.pitch, hi.pitch);
  w.emptyLink(name + "_insertion");
  w.moving(name + "_insertion", "prismatic", name + "_pitch", name + "_insertion", I, "0 0 1", lo.insertion,
           hi.insertion);
  w.emptyLink(name + "_roll");
  w.moving(name + "_roll", "revolute", name + "_insertion", name + "_roll", I, "0 0 1", lo.roll, hi.roll);

  w.openLink(name + "_tip");
  w.mesh(kind + "_shaft", endoscope ? "steel" : "insulation");
  constexpr double kShaft = 0.35;  // m, as the meshes
  w.capsule({Vector3d(0, 0, -kShaft), Vector3d(0, 0, -g.jaw_length), g.shaft_radius});
  if (!g.fixed.empty() || tool == tools::ToolKind::SuctionIrrigator) w.mesh(kind + "_fixed", "steel");
  for (const Capsule& c : g.fixed) w.capsule(c);
  w.closeLink();
  w.fixed(name + "_tip", name + "_roll", name + "_tip", I);

  if (endoscope) {
    w.emptyLink("endoscope_light_post");
    w.moving("endoscope_light_post", "revolute", "endoscope_tip", "endoscope_light_post", I, "0 0 1", lo.jaw,
             hi.jaw);
    w.emptyLink("endoscope_optic");
    Isometry3d tilt = I;
    tilt.linear() = Eigen::AngleAxisd(-arm.optic_angle, Vector3d::UnitX()).toRotationMatrix();
    w.fixed("endoscope_optic", "endoscope_light_post", "endoscope_optic", tilt);
    w.emptyLink("endoscope_optical_frame");
    w.moving("endoscope_camera_head", "revolute", "endoscope_optic", "endoscope_optical_frame", I, "0 0 1",
             -hi.jaw, -lo.jaw, "<mimic joint=\"endoscope_light_post\" multiplier=\"-1\"/>");
    return;
  }
  // The joint NAME_jaw bears the full opening; each jaw turns by half of it.
  w.emptyLink(name + "_jaw");
  const Isometry3d axis(Eigen::Translation3d(0, 0, -g.jaw_length));
  w.moving(name + "_jaw", "revolute", name + "_tip", name + "_jaw", I, "0 1 0", lo.jaw, hi.jaw);
  for (int side = 0; side < 2; ++side) {
    const std::string link = name + (side == 0 ? "_jaw_left" : "_jaw_right");
    w.openLink(link);
    if (g.jaw_length > 0.0) {
      w.mesh(kind + (side == 0 ? "_jaw_left" : "_jaw_right"), "steel");
      for (const Capsule& c : g.jaw[static_cast<std::size_t>(side)]) w.capsule(c);
    }
    w.closeLink();
    const double half = side == 0 ? 0.5 : -0.5;
    w.moving(link, "revolute", name + "_tip", link, axis, "0 1 0", std::min(half * lo.jaw, half * hi.jaw),
             std::max(half * lo.jaw, half * hi.jaw),
             "<mimic joint=\"" + name + "_jaw\" multiplier=\"" + (side == 0 ? "0.5" : "-0.5") + "\"/>");
  }
}

}  // namespace

std::string makeUrdf(const kinematics::TrainerBox& box, const ToolSet& tools) {
  Writer w;
  w.out_ << "<?xml version=\"1.0\"?>\n<!-- Made by make_urdf from config/trainer_box.yaml: change those, not "
            "this. -->\n"
         << "<robot name=\"vest_trainer\">\n";
  const auto material = [&](const char* name, const char* rgba) {
    w.out_ << "  <material name=\"" << name << "\"><color rgba=\"" << rgba << "\"/></material>\n";
  };
  material("floor", "0.30 0.32 0.34 1");
  material("wall", "0.62 0.72 0.80 0.18");
  material("trocar", "0.75 0.77 0.72 0.75");
  material("insulation", "0.10 0.10 0.11 1");
  material("steel", "0.72 0.73 0.75 1");
  w.emptyLink("world");
  writeBox(w, box);
  w.fixed("phantom_box", "world", "phantom_box", Isometry3d::Identity());
  for (std::size_t i = 0; i < box.arms.size(); ++i) {
    if (!box.arms[i].present) continue;
    writeArm(w, std::string(tools::instrumentName(static_cast<tools::Instrument>(i))), box.arms[i], tools[i]);
  }
  w.out_ << "</robot>\n";
  return w.out_.str();
}

}  // namespace vest::urdf
