// Instruments in pictures drawn in this process.
#include <algorithm>
#include <vector>

#include "offscreen.h"
#include "sheet.h"
#include "truth_output.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_viz/instrument/shadow.h"
#include "vest_viz/picture/quality.h"

namespace vest::displays {
namespace {

TEST_F(Offscreen, AnInstrumentCastsAShadowFromTheLampBesideTheLens) {
  load(sheet("uterus"));
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  const cv::Mat before = picture(X_WO);
  vest_msgs::InstrumentStates states;
  states.instruments.resize(1);
  vest_msgs::InstrumentState& left = states.instruments[0];
  left.name = "left";
  left.tool = vest_msgs::InstrumentState::TOOL_GRASPER;
  left.tip.position.x = 0.012, left.tip.position.z = 0.018;
  left.tip.orientation.y = left.tip.orientation.w = std::sqrt(0.5);  // along x, level
  view.setInstruments(states);
  const cv::Mat after = picture(X_WO);
  TruthOutput truth;
  cv::Mat labels;
  truth.draw(view, store, &states, X_WO).segmentation(&labels);
  const double radius = tools::toolGeometry(tools::ToolKind::Grasper).shaft_radius;
  // The picture's down is -y of world; the lamp stands 4 mm above the lens.
  const Vector3d lamp = X_WO * Vector3d(0, -0.004, 0);
  const instrument::CastShadow shadow =
      instrument::castShadow(lamp, Vector3d(0.0, 0, 0.018), Vector3d(-0.1, 0, 0.018), radius);
  double dark[2] = {0, 0}, lit[2] = {0, 0};
  int in_shadow = 0, in_light = 0;
  for (int v = 90; v < 486; v += 2)
    for (int u = 160; u < 560; u += 2) {
      if (labels.at<std::uint16_t>(v, u) != 1) continue;
      const Eigen::Vector2d n = camera::unproject(view.camera(), {double(u), double(v)});
      const Vector3d p = X_WO * Vector3d(0.06 * n.x(), 0.06 * n.y(), 0.06);
      const double hidden = instrument::shadowAt(shadow, p, radius);
      const double was = before.at<cv::Vec3b>(v, u)[0], is = after.at<cv::Vec3b>(v, u)[0];
      if (hidden > 0.95) dark[0] += was, dark[1] += is, ++in_shadow;
      if (hidden == 0 && p.x() > 0.022) lit[0] += was, lit[1] += is, ++in_light;
    }
  ASSERT_GT(in_shadow, 100) << "beside the shaft, on the side away from the lamp";
  ASSERT_GT(in_light, 300);
  EXPECT_LT(dark[1], 0.8 * dark[0]);
  EXPECT_NEAR(lit[1], lit[0], 0.08 * lit[0]) << "beyond the tip it only takes some of the sky";
}

/// The seam of closed jaws from the side, 8 cm away, at the coarsest level of the live view: a tooth is two
/// rendered pixels there. With its teeth drawn half a tooth changes the grey by more than its mean.
TEST_F(Offscreen, TheSeamOfClosedJawsIsALineAndNotARowOfDots) {
  load(sheet("uterus"));
  view.setCamera(sampleCamera(), 1.0, picture::kResolutions.back());
  view.setFixedGain(5);
  const Eigen::Isometry3d X_WO = fromAbove(0.11);
  vest_msgs::InstrumentStates states;
  states.instruments.resize(1);
  vest_msgs::InstrumentState& left = states.instruments[0];
  left.name = "left";
  left.tool = vest_msgs::InstrumentState::TOOL_GRASPER;
  left.tip.position.x = 0.01, left.tip.position.z = 0.03;
  // The shaft along x, the jaws open along y.
  left.tip.orientation.x = left.tip.orientation.y = left.tip.orientation.z = left.tip.orientation.w = 0.5;
  view.setInstruments(states);
  cv::Mat rgb = picture(X_WO), grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  const double length = tools::toolGeometry(tools::ToolKind::Grasper).jaw_length;
  const Vector3d tip(0.01, 0, 0.03);
  std::vector<double> seam;
  for (double s = 0.2; s < 0.85; s += 0.005) {
    const Vector3d q = X_WO.inverse() * Vector3d(tip - s * length * Vector3d::UnitX());
    const Eigen::Vector2d u = camera::project(view.camera(), {q.x() / q.z(), q.y() / q.z()});
    cv::Mat one;
    cv::getRectSubPix(grey, {1, 1}, cv::Point2f(static_cast<float>(u.x()), static_cast<float>(u.y())), one);
    seam.push_back(one.at<std::uint8_t>(0, 0));
  }
  constexpr std::size_t kApart = 4;  // half a tooth
  double jump = 0, sum = 0;
  for (std::size_t i = kApart; i < seam.size(); ++i) {
    jump = std::max(jump, std::fabs(seam[i] - seam[i - kApart]));
    sum += seam[i];
  }
  const double mean = sum / static_cast<double>(seam.size() - kApart);
  EXPECT_GT(mean, 50) << "lit";
  EXPECT_LT(jump, 0.2 * mean);
}

}  // namespace
}  // namespace vest::displays
