#include "vest_bringup/ros/moment_bag.h"

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include <vest_msgs/InstrumentStates.h>

#include "vest_bringup/ros/effects_shell.h"
#include "vest_bringup/ros/field_messages.h"
#include "vest_instruments/ros/frames.h"
#include "vest_tissue/ros/conversions.h"

namespace vest::ros_shell {
namespace {

geometry_msgs::Pose poseMsg(const Eigen::Vector3d& p, const Eigen::Quaterniond& q) {
  geometry_msgs::Pose m;
  m.position.x = p.x(), m.position.y = p.y(), m.position.z = p.z();
  m.orientation.w = q.w(), m.orientation.x = q.x(), m.orientation.y = q.y(), m.orientation.z = q.z();
  return m;
}

}  // namespace

MomentBag::MomentBag(const std::string& file) : file_(file) {
  std::error_code unknown;
  const auto is = std::filesystem::status(file, unknown);
  if (std::filesystem::exists(is) && !std::filesystem::is_regular_file(is))
    throw std::invalid_argument(file + ": is no ordinary file (allowed: a new file, or one to replace)");
  try {
    bag_->open(file, rosbag::bagmode::Write);
  } catch (const rosbag::BagException&) {
    static_cast<void>(bag_.release());  // as in giveUp(): of a full disk it is open
    throw std::invalid_argument(file + ": cannot be written");
  }
}

void MomentBag::giveUp() {
  static_cast<void>(bag_.release());  // its destructor would write again, and end the program
  std::remove(file_.c_str());
  throw std::invalid_argument(file_ + ": cannot be written (is the disk full?)");
}

void MomentBag::close() {
  try {
    bag_->close();
  } catch (const rosbag::BagException&) {
    giveUp();
  }
}

template <class M>
void MomentBag::put(const std::string& topic, ros::Time& time, M& message) {
  message.header.stamp = time;
  try {
    bag_->write("/vest/" + topic, time, message);
  } catch (const rosbag::BagException&) {
    giveUp();
  }
  time += ros::Duration(1e-6);  // a bag keeps the order of different times only
}

bool MomentBag::current(const scene::World& world) {
  if (surface_.update()) has_surface_ = true;
  return surface_.front().step == 0 || surface_.front().revision == world.revision();
}

void MomentBag::write(double t, const scene::World& world, const kinematics::TrainerBox& box,
                      const scene::StepInput& input) {
  ros::Time time(t + 1.0);  // a bag has no time 0
  vest_msgs::TissueTopology topology;
  toMsg(world, topology);
  if (topology.revision != revision_ || topology.scene_hash != scene_hash_)
    put("tissue/topology", time, topology);
  revision_ = topology.revision, scene_hash_ = topology.scene_hash;

  vest_msgs::InstrumentStates instruments;
  instruments.header.frame_id = frameId("world");
  for (std::size_t i = 0; i < input.tools.size(); ++i) {
    const scene::ToolInput& tool = input.tools[i];
    if (!tool.present) continue;
    const Eigen::Isometry3d tip = Eigen::Translation3d(tool.position) * tool.orientation;
    joints_[i].jaw = tool.jaw;
    joints_[i] = kinematics::inverseKinematics(box.arms[i].X_BTrocar, tip, joints_[i], box.arms[i].limits).q;
    vest_msgs::InstrumentState s;
    s.name = std::string(tools::instrumentName(static_cast<tools::Instrument>(i)));
    s.tool = static_cast<std::uint8_t>(tool.tool);
    s.source = vest_msgs::InstrumentState::SOURCE_BOX;
    s.valid = true;
    s.joint_position = {joints_[i].yaw, joints_[i].pitch, joints_[i].insertion, joints_[i].roll, tool.jaw};
    s.tip = poseMsg(tool.position, tool.orientation);
    s.shaft = poseMsg(tool.pivot, tool.orientation);
    s.functions = tool.functions;
    for (std::size_t k = 0; k < 3; ++k) s.sight[k] = tool.sight[static_cast<Eigen::Index>(k)];
    instruments.instruments.push_back(s);
  }
  put("instruments", time, instruments);

  current(world);
  if (has_surface_) {
    has_surface_ = false;
    vest_msgs::SurfaceBleeding surface;
    toMsg(surface_.front(), surface);
    put("effects/surface", time, surface);
  }
  if (gas_.update()) {
    vest_msgs::GasState gas;
    toMsg(gas_.front(), gas);
    put("effects/gas", time, gas);
  }
  if (field_->update()) {
    const simulation::FieldFrame& frame = field_->front();
    vest_msgs::FluidState fluid;
    vest_msgs::SmokeState smoke;
    vest_msgs::LensState lens;
    toMsg(frame, fluid), toMsg(frame, smoke), toMsg(frame, lens);
    put("effects/fluid", time, fluid);
    put("effects/smoke", time, smoke);
    put("effects/lens", time, lens);
  }

  scene::StateFrame state;
  scene::readState(world, true, state);
  vest_msgs::TissueAttachments attachments;
  toMsg(state, world.description(), attachments);
  put("tissue/attachments", time, attachments);
  vest_msgs::SutureStates sutures;
  toMsg(state, world.description(), sutures);
  put("tissue/sutures", time, sutures);
  // Last: whoever renders each state has then read all that belongs to it.
  vest_msgs::TissueState message;
  toMsg(state, message);
  put("tissue/state", time, message);
}

}  // namespace vest::ros_shell
