#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <ros/ros.h>
#include <vest_msgs/InstrumentStates.h>
#include <Eigen/Geometry>

#include "endoscope_pipeline.h"
#include "vest_viz/truth/keypoints.h"
#include "vest_viz/truth/raster.h"

namespace vest::displays {

/// Ground truth of the endoscopic view: depth, segmentation, flow, keypoints. Computed only while somebody
/// subscribes, on the processor, from the same meshes and the same pose as the picture.
class TruthOutput {
 public:
  /// Topics are PREFIX/depth/image_raw, PREFIX/segmentation/image_raw, PREFIX/flow/image_raw,
  /// PREFIX/keypoints.
  void advertise(ros::NodeHandle& handle, const std::string& prefix);
  void shutdown();
  bool wanted() const;

  /// @param step simulation step of the state shown
  void publish(EndoscopePipeline& view, const mesh::Store& store, const vest_msgs::InstrumentStates* states,
               const Eigen::Isometry3d& X_WO, const std_msgs::Header& header, std::uint64_t step);

  /// For those who write files: draws, and gives access to the raster.
  truth::Raster& draw(EndoscopePipeline& view, const mesh::Store& store,
                      const vest_msgs::InstrumentStates* states, const Eigen::Isometry3d& X_WO);
  std::vector<truth::Keypoint> keypoints(const vest_msgs::InstrumentStates* states,
                                         const EndoscopePipeline& view, const Eigen::Isometry3d& X_WO) const;
  /// What draw() has drawn becomes the picture before, for the next flow.
  void remember(const Eigen::Isometry3d& X_WO);
  const Eigen::Isometry3d& before() const { return X_WO_before_; }

 private:
  /// Vertices of one thing now and at the picture before.
  struct Shape {
    std::vector<float> now, before;
    std::vector<std::uint32_t> triangles;
    std::uint16_t label = 0;
    bool drawn = false;
  };
  Shape& shape(const std::string& name, std::uint16_t label);

  ros::Publisher depth_pub_, segmentation_pub_, flow_pub_, keypoints_pub_;
  std::unique_ptr<truth::Raster> raster_;
  std::uint64_t made_for_ = 0;  ///< camera version of the pipeline
  std::map<std::string, Shape> shapes_;
  Eigen::Isometry3d X_WO_before_ = Eigen::Isometry3d::Identity();
  cv::Mat picture_;
};

}  // namespace vest::displays
