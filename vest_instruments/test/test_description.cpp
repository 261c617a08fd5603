#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <urdf/model.h>

#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_instruments/urdf/description.h"

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using vest::kinematics::JointPositions;
using vest::tools::ToolKind;
using vest::urdf::checkUrdf;
using vest::urdf::UrdfError;

const std::string kPackage = VEST_INSTRUMENTS_DIR;

std::string readFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

vest::kinematics::TrainerBox shipped() {
  return vest::kinematics::loadTrainerBox(kPackage + "/config/trainer_box.yaml");
}

vest::urdf::ToolSet defaultTools(const vest::kinematics::TrainerBox& box) {
  vest::urdf::ToolSet tools;
  for (std::size_t i = 0; i < tools.size(); ++i) tools[i] = box.arms[i].tool;
  return tools;
}

/// Pose of a link in world: the chain of the URDF walked upwards, an implementation of its own.
Isometry3d poseInWorld(const urdf::Model& model, std::string link, const std::map<std::string, double>& q) {
  Isometry3d X = Isometry3d::Identity();
  while (link != "world") {
    const auto joint = model.getLink(link)->parent_joint;
    const auto& o = joint->parent_to_joint_origin_transform;
    Isometry3d T = Isometry3d::Identity();
    T.translate(Vector3d(o.position.x, o.position.y, o.position.z));
    T.rotate(Eigen::Quaterniond(o.rotation.w, o.rotation.x, o.rotation.y, o.rotation.z));
    double value = 0.0;
    if (joint->mimic) {
      value = joint->mimic->multiplier * q.at(joint->mimic->joint_name) + joint->mimic->offset;
    } else if (q.count(joint->name) != 0) {
      value = q.at(joint->name);
    }
    const Vector3d axis(joint->axis.x, joint->axis.y, joint->axis.z);
    if (joint->type == urdf::Joint::REVOLUTE) T.rotate(Eigen::AngleAxisd(value, axis));
    if (joint->type == urdf::Joint::PRISMATIC) T.translate(value * axis);
    X = T * X;
    link = joint->parent_link_name;
  }
  return X;
}

TEST(Description, TheCommittedUrdfIsWhatTheGeneratorMakesNow) {
  const auto box = shipped();
  EXPECT_EQ(readFile(kPackage + "/urdf/trainer.urdf"), vest::urdf::makeUrdf(box, defaultTools(box)))
      << "run: rosrun vest_instruments make_urdf --box config/trainer_box.yaml --output urdf/trainer.urdf";
}

TEST(Description, ItsTreeMovesAsTheKinematicsDo) {
  const auto box = shipped();
  urdf::Model model;
  ASSERT_TRUE(model.initString(vest::urdf::makeUrdf(box, defaultTools(box))));
  std::mt19937_64 engine(3);
  auto in = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  for (int n = 0; n < 100; ++n) {
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& arm = box.arms[i];
      const std::string name(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)));
      const JointPositions j{in(-1.2, 1.2), in(-1.2, 1.2), in(0, 0.28), in(-3, 3), in(0, 1.2)};
      std::map<std::string, double> q{
          {name + "_yaw", j.yaw},   {name + "_pitch", j.pitch}, {name + "_insertion", j.insertion},
          {name + "_roll", j.roll}, {name + "_jaw", j.jaw},     {"endoscope_light_post", j.jaw}};
      const Isometry3d tip = forwardKinematics(arm.X_BTrocar, j);
      EXPECT_TRUE(poseInWorld(model, name + "_tip", q).isApprox(tip, 1e-9));
      if (name == "endoscope") {
        EXPECT_TRUE(poseInWorld(model, "endoscope_optical_frame", q)
                        .isApprox(tip * vest::kinematics::opticalFrame(arm.optic_angle, j.jaw), 1e-9));
        continue;
      }
      // Jaw 0 (left) opens to +x by half of the angle, jaw 1 to the other side.
      const Isometry3d axis =
          tip * Eigen::Translation3d(0, 0, -vest::tools::toolGeometry(arm.tool).jaw_length);
      EXPECT_TRUE(poseInWorld(model, name + "_jaw_left", q)
                      .isApprox(axis * Eigen::AngleAxisd(0.5 * j.jaw, Vector3d::UnitY()), 1e-9));
      EXPECT_TRUE(poseInWorld(model, name + "_jaw_right", q)
                      .isApprox(axis * Eigen::AngleAxisd(-0.5 * j.jaw, Vector3d::UnitY()), 1e-9));
    }
  }
}

TEST(Description, EveryToolMakesAUrdfWhoseMeshesExistWithTriangles) {
  const auto box = shipped();
  std::set<std::string> meshes;
  for (int kind = 0; kind < vest::tools::kToolKindCount; ++kind) {
    if (static_cast<ToolKind>(kind) == ToolKind::Endoscope) continue;  // no hand holds it
    auto tools = defaultTools(box);
    tools[0] = static_cast<ToolKind>(kind);
    const std::string xml = vest::urdf::makeUrdf(box, tools);
    EXPECT_NO_THROW(checkUrdf(xml));
    urdf::Model model;
    ASSERT_TRUE(model.initString(xml)) << kind;
    for (const auto& [name, link] : model.links_) {
      for (const auto& visual : link->visual_array) {
        if (const auto mesh = std::dynamic_pointer_cast<urdf::Mesh>(visual->geometry))
          meshes.insert(mesh->filename);
      }
    }
  }
  EXPECT_GE(meshes.size(), 25u);
  const std::string prefix = "package://vest_instruments/";
  for (const std::string& uri : meshes) {
    ASSERT_EQ(uri.rfind(prefix, 0), 0u) << uri;
    const std::string stl = readFile(kPackage + "/" + uri.substr(prefix.size()));
    ASSERT_GT(stl.size(), 84u) << uri;
    std::uint32_t count = 0;
    std::memcpy(&count, stl.data() + 80, 4);
    EXPECT_EQ(stl.size(), 84u + 50u * count) << uri;
    EXPECT_LE(count, uri.find("_shaft") != std::string::npos ? 200u : 1500u) << uri;
    float least = 1e9f, most = -1e9f;
    for (std::uint32_t i = 0; i < 9 * count; ++i) {
      float v;
      std::memcpy(&v, stl.data() + 84 + 50 * (i / 9) + 12 + 4 * (i % 9), 4);
      ASSERT_TRUE(std::isfinite(v)) << uri;
      least = std::min(least, v);
      most = std::max(most, v);
    }
    EXPECT_GT(most - least, 0.002f) << uri << " is in metres and not flat";
    EXPECT_LT(most - least, 0.5f) << uri << " is in metres, not millimetres";
  }
}

std::string refusal(const std::string& xml) {
  try {
    checkUrdf(xml);
  } catch (const UrdfError& e) {
    return e.what();
  }
  return "";
}

TEST(UrdfCheck, RefusesWhatTheUrdfLibraryCrashesOnOrTakesWrongly) {
  EXPECT_EQ(refusal("<robot><link name='a'/></robot>"), "");
  EXPECT_EQ(refusal("<robot><link/><link name='a'/></robot>"), "a link without a name");
  std::string deep = "<robot>";
  for (int i = 0; i < 200000; ++i) deep += "<a>";
  EXPECT_NE(refusal(deep).find("deeper than 64"), std::string::npos);
  EXPECT_NE(refusal("<robot>" + std::string(5 << 20, ' ') + "</robot>").find("4 MB"), std::string::npos);
  const std::string links = "<link name='a'/><link name='b'/>";
  const std::string ab = "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>";
  const std::string ba = "<joint name='k' type='fixed'><parent link='b'/><child link='a'/></joint>";
  EXPECT_EQ(refusal("<robot>" + links + ab + "</robot>"), "");
  EXPECT_NE(refusal("<robot>" + links + ab + ba + "</robot>").find("cycle"), std::string::npos);
  EXPECT_NE(refusal("<robot><link name='r'/>" + links + ab + ba + "</robot>").find("cycle"),
            std::string::npos);
  EXPECT_NE(refusal("<robot>" + links + ab + ab + "</robot>").find("two parents"), std::string::npos);
  EXPECT_NE(refusal("<robot>" + links + "</robot>").find("not one tree"), std::string::npos);
  EXPECT_NE(refusal("<robot><link name='a'/>" + ab + "</robot>").find("unknown link 'b'"), std::string::npos);
  EXPECT_NE(refusal("<robot><link name='a'/><link name='a'/></robot>").find("twice"), std::string::npos);
  EXPECT_NE(refusal("<robot><link name='a'/>").find("not closed"), std::string::npos);
  EXPECT_NE(refusal("<robot><!-- ").find("does not end"), std::string::npos);
  EXPECT_NE(refusal("<!DOCTYPE x><robot/>").find("document type"), std::string::npos);
  EXPECT_NE(refusal("").find("no links"), std::string::npos);
}

}  // namespace
