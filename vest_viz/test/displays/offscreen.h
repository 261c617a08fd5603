#pragma once

#include <cmath>

#include <gtest/gtest.h>
#include <ros/time.h>
#include <rviz/ogre_helpers/render_system.h>
#include <opencv2/imgproc.hpp>

#include "conversion.h"
#include "endoscope_pipeline.h"

namespace vest::displays {

using Eigen::Vector3d;

inline camera::Intrinsics sampleCamera() {
  return camera::fromFieldOfView(720, 576, 70 * M_PI / 180, {-0.18, 0.03, 0, 0, 0});
}

inline Eigen::Isometry3d fromAbove(double height) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation().z() = height;
  X.linear() << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  return X;
}

/// Draws what an endoscope sees, in this process.
class Offscreen : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    ros::Time::init();
    rviz::RenderSystem::get();
  }

  void load(const vest_msgs::TissueTopology& topology) {
    view.setCamera(sampleCamera(), 1.0, 1.0);
    view.setFixedGain(1.0);
    store.setTopology(toTopology(topology));
    store.rebuildSkins();
    view.settle(store);
  }

  /// RGB.
  cv::Mat picture(const Eigen::Isometry3d& X_WO) {
    cv::Mat out;
    view.draw(X_WO, 0, 0.05, &out);
    return out.clone();
  }

  void mark(std::uint8_t kind, float high, double centre_x, double radius) {
    mesh::Field field;
    field.kind = kind, field.minimum = 0, field.maximum = high;
    const mesh::Object& o = store.topology().objects[0];
    for (std::size_t k = 0; k < o.knot_count; ++k) {
      const double d = std::hypot(o.rest_position[3 * k] - centre_x, o.rest_position[3 * k + 1]);
      field.data.push_back(d < radius ? 255 : 0);
    }
    ASSERT_EQ(store.setField(1, field), mesh::Outcome::Accepted);
    view.setTissue(store);
  }

  /// Mean colour round a world point.
  cv::Scalar colourAt(const cv::Mat& rgb, const Eigen::Isometry3d& X_WO, const Vector3d& p, int half = 8) {
    const Vector3d q = X_WO.inverse() * p;
    const Eigen::Vector2d u = camera::project(view.camera(), {q.x() / q.z(), q.y() / q.z()});
    return cv::mean(
        rgb(cv::Rect(static_cast<int>(u.x()) - half, static_cast<int>(u.y()) - half, 2 * half, 2 * half)));
  }

  EndoscopePipeline view{1};
  mesh::Store store;
};

}  // namespace vest::displays
