#include "truth_output.h"

#include <algorithm>
#include <cmath>

#include <sensor_msgs/Image.h>
#include <vest_msgs/Keypoints.h>

#include "conversion.h"
#include "vest_instruments/tools/tool_geometry.h"

namespace vest::displays {
namespace {

std::uint16_t labelOf(const std::string& instrument) {
  for (std::uint16_t i = 0; i < tools::kInstrumentCount; ++i)
    if (instrument == tools::instrumentName(static_cast<tools::Instrument>(i)))
      return static_cast<std::uint16_t>(truth::kFirstInstrument + i);
  return truth::kFirstInstrument + tools::kInstrumentCount;
}

sensor_msgs::ImagePtr toImage(const cv::Mat& picture, const char* encoding, const std_msgs::Header& header) {
  auto m = boost::make_shared<sensor_msgs::Image>();
  m->header = header;
  m->width = static_cast<std::uint32_t>(picture.cols);
  m->height = static_cast<std::uint32_t>(picture.rows);
  m->encoding = encoding;
  m->step = static_cast<std::uint32_t>(picture.step);
  m->data.assign(picture.data, picture.data + picture.step * static_cast<std::size_t>(picture.rows));
  return m;
}

}  // namespace

void TruthOutput::advertise(ros::NodeHandle& handle, const std::string& prefix) {
  shutdown();
  if (prefix.empty()) return;
  depth_pub_ = handle.advertise<sensor_msgs::Image>(prefix + "/depth/image_raw", 2);
  segmentation_pub_ = handle.advertise<sensor_msgs::Image>(prefix + "/segmentation/image_raw", 2);
  flow_pub_ = handle.advertise<sensor_msgs::Image>(prefix + "/flow/image_raw", 2);
  keypoints_pub_ = handle.advertise<vest_msgs::Keypoints>(prefix + "/keypoints", 2);
}

void TruthOutput::shutdown() {
  for (ros::Publisher* p : {&depth_pub_, &segmentation_pub_, &flow_pub_, &keypoints_pub_}) p->shutdown();
  shapes_.clear();
}

bool TruthOutput::wanted() const {
  const ros::Publisher* all[] = {&depth_pub_, &segmentation_pub_, &flow_pub_, &keypoints_pub_};
  return std::any_of(std::begin(all), std::end(all), [](const ros::Publisher* p) {
    return !p->getTopic().empty() && p->getNumSubscribers() > 0;
  });
}

TruthOutput::Shape& TruthOutput::shape(const std::string& name, std::uint16_t label) {
  Shape& s = shapes_[name];
  s.drawn = true;
  s.label = label;
  return s;
}

truth::Raster& TruthOutput::draw(EndoscopePipeline& view, const mesh::Store& store,
                                 const vest_msgs::InstrumentStates* states, const Eigen::Isometry3d& X_WO) {
  if (!raster_ || made_for_ != view.cameraVersion()) {
    raster_ = std::make_unique<truth::Raster>(view.camera(), view.finisher().circle());
    made_for_ = view.cameraVersion();
  }
  for (auto& [name, s] : shapes_) s.drawn = false;
  const auto& objects = store.topology().objects;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::uint16_t label = objects[i].segmentation_label != 0 ? objects[i].segmentation_label
                                                                   : static_cast<std::uint16_t>(i + 1);
    Shape& s = shape("tissue/" + objects[i].name, label);
    s.now = view.scene().drawnSkin(store, i);
    if (s.triangles != store.skin(i).triangles) {
      s.triangles = store.skin(i).triangles;
      s.before.clear();  // a cut: what was where before is unknown
    }
  }
  const auto add = [&](const std::string& name, std::uint16_t label, const instrument::TriangleMesh& m) {
    Shape& s = shape(name, label);
    if (s.triangles != m.triangles) s.before.clear();
    s.triangles = m.triangles;
    s.now = m.positions;
  };
  if (states != nullptr)
    for (const auto& [name, visual] : view.scene().instruments())
      if (visual->visible()) add("instrument/" + name, labelOf(name), visual->worldMesh());
  const EffectsVisual& effects = view.scene().effects();
  add("metal", truth::kMetal, effects.metal());
  add("threads", truth::kThread, effects.threads());
  for (std::size_t i = 0; i < effects.pools().size(); ++i) {
    Shape& s = shape("pool/" + std::to_string(i), truth::kFluid);
    s.now = effects.pools()[i].positions;
    s.triangles = effects.pools()[i].triangles;
    s.before.clear();
  }
  // Drops: the quads that the picture shows them with; air bubbles are not fluid, but lie in it.
  Shape& drops = shape("drops", truth::kFluid);
  drops.now = effects.drops().corners;
  drops.before.clear();
  drops.triangles.clear();
  for (std::uint32_t q = 0; q < effects.drops().count(); ++q)
    for (std::uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u}) drops.triangles.push_back(4 * q + k);
  std::vector<truth::Body> bodies;
  for (auto& [name, s] : shapes_) {
    if (!s.drawn || s.triangles.empty()) continue;
    truth::Body body;
    body.label = s.label;
    body.positions = s.now.data();
    body.previous = s.before.size() == s.now.size() ? s.before.data() : nullptr;
    body.vertices = s.now.size() / 3;
    body.triangles = s.triangles.data();
    body.triangle_count = s.triangles.size() / 3;
    bodies.push_back(body);
  }
  raster_->draw(bodies, X_WO);
  return *raster_;
}

void TruthOutput::remember(const Eigen::Isometry3d& X_WO) {
  for (auto it = shapes_.begin(); it != shapes_.end();) {
    if (!it->second.drawn) {
      it = shapes_.erase(it);
      continue;
    }
    it->second.before = it->second.now;
    ++it;
  }
  X_WO_before_ = X_WO;
}

std::vector<truth::Keypoint> TruthOutput::keypoints(const vest_msgs::InstrumentStates* states,
                                                    const EndoscopePipeline& view,
                                                    const Eigen::Isometry3d& X_WO) const {
  std::vector<truth::Keypoint> all;
  if (states == nullptr || !raster_) return all;
  for (const vest_msgs::InstrumentState& state : states->instruments) {
    truth::InstrumentPose pose;
    if (state.name == "endoscope" || state.tool == 0 || state.tool >= tools::kToolKindCount ||
        !toPose(state.tip, &pose.X_WTip))
      continue;
    const tools::ToolGeometry& geometry = tools::toolGeometry(static_cast<tools::ToolKind>(state.tool));
    pose.name = state.name;
    pose.label = labelOf(state.name);
    pose.pivot = {state.shaft.position.x, state.shaft.position.y, state.shaft.position.z};
    pose.jaw = std::isfinite(state.joint_position[4]) ? state.joint_position[4] : 0.0;
    pose.jaw_length = geometry.jaw_length;
    pose.shaft_radius = geometry.shaft_radius;
    if (!pose.pivot.allFinite()) continue;
    truth::appendKeypoints(pose, view.camera(), view.finisher().circle(), X_WO, *raster_, &all);
  }
  return all;
}

void TruthOutput::publish(EndoscopePipeline& view, const mesh::Store& store,
                          const vest_msgs::InstrumentStates* states, const Eigen::Isometry3d& X_WO,
                          const std_msgs::Header& header, std::uint64_t step) {
  const truth::Raster& raster = draw(view, store, states, X_WO);
  if (depth_pub_.getNumSubscribers() > 0) {
    raster.depth(&picture_);
    depth_pub_.publish(toImage(picture_, "32FC1", header));
  }
  if (segmentation_pub_.getNumSubscribers() > 0) {
    raster.segmentation(&picture_);
    segmentation_pub_.publish(toImage(picture_, "mono16", header));
  }
  if (flow_pub_.getNumSubscribers() > 0) {
    raster.flow(X_WO_before_, &picture_);
    flow_pub_.publish(toImage(picture_, "32FC2", header));
  }
  if (keypoints_pub_.getNumSubscribers() > 0) {
    vest_msgs::Keypoints m;
    m.header = header;
    m.step = step;
    for (const truth::Keypoint& k : keypoints(states, view, X_WO)) {
      vest_msgs::Keypoint point;
      point.instrument = k.instrument;
      point.name = k.name;
      point.u = static_cast<float>(k.u);
      point.v = static_cast<float>(k.v);
      point.depth = static_cast<float>(k.depth);
      point.visibility = k.visibility;
      m.keypoints.push_back(point);
    }
    keypoints_pub_.publish(m);
  }
  remember(X_WO);
}

}  // namespace vest::displays
