// Drives the displays inside a real rviz over topics, and looks at the pictures that come back.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <tf2/buffer_core.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/Keypoints.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>
#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "vest_viz/camera/model.h"
#include "vest_viz/picture/check.h"

namespace {

/// A ball: one of 2 cm radius, 8 cm before the camera, inside one of 15 cm round everything.
vest_msgs::TissueObject ball(const std::string& name, const std::string& organ, double radius, double z,
                             bool inward) {
  vest_msgs::TissueObject o;
  o.name = name;
  o.organ = organ;
  const std::uint32_t rows = 24, columns = 36;
  for (std::uint32_t i = 0; i <= rows; ++i)
    for (std::uint32_t j = 0; j <= columns; ++j) {
      const double a = M_PI * i / rows, b = 2 * M_PI * j / columns;
      o.rest_position.push_back(static_cast<float>(radius * std::sin(a) * std::cos(b)));
      o.rest_position.push_back(static_cast<float>(radius * std::sin(a) * std::sin(b)));
      o.rest_position.push_back(static_cast<float>(z + radius * std::cos(a)));
      o.texture_coordinates.push_back(static_cast<float>(radius * a));
      o.texture_coordinates.push_back(static_cast<float>(radius * b));
      o.binding_knots.push_back(o.knot_count);
      o.binding_weights.push_back(1);
      o.binding_start.push_back(o.knot_count++);
      if (i == rows || j == columns) continue;
      const std::uint32_t k = i * (columns + 1) + j, down = k + columns + 1;
      const std::uint32_t t[] = {k, down, down + 1, k, down + 1, k + 1};
      for (int n = 0; n < 6; ++n) o.triangles.push_back(t[inward ? 5 - n : n]);
    }
  o.binding_start.push_back(o.knot_count);
  o.link_knots = {0, 1, 1, 2};
  o.link_kind = {0, 0};
  o.link_alive = {1, 1};
  return o;
}

class Displays : public testing::Test {
 protected:
  static void SetUpTestSuite() { world = new World(); }
  static void TearDownTestSuite() {
    delete world;
    world = nullptr;
  }

  struct World {
    ros::NodeHandle handle;
    ros::Publisher topology = handle.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
    ros::Publisher delta = handle.advertise<vest_msgs::TissueTopologyDelta>("tissue/topology_delta", 10);
    ros::Publisher state = handle.advertise<vest_msgs::TissueState>("tissue/state", 1);
    ros::Publisher instruments = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1);
    ros::Subscriber image = handle.subscribe<sensor_msgs::Image>(
        "endoscope/image_raw", 2, [this](const sensor_msgs::Image::ConstPtr& m) { last = m, ++images; });
    ros::Subscriber second = handle.subscribe<sensor_msgs::Image>(
        "second/image_raw", 2, [this](const sensor_msgs::Image::ConstPtr& m) { last_second = m; });
    ros::Subscriber info = handle.subscribe<sensor_msgs::CameraInfo>(
        "endoscope/camera_info", 2, [this](const sensor_msgs::CameraInfo::ConstPtr& m) { last_info = m; });
    ros::Subscriber jpeg = handle.subscribe<sensor_msgs::CompressedImage>(
        "endoscope/image_raw/compressed", 2,
        [this](const sensor_msgs::CompressedImage::ConstPtr& m) { last_jpeg = m; });
    ros::Subscriber depth_sub = handle.subscribe<sensor_msgs::Image>(
        "endoscope/depth/image_raw", 2, [this](const sensor_msgs::Image::ConstPtr& m) { depth = m; });
    ros::Subscriber segmentation_sub = handle.subscribe<sensor_msgs::Image>(
        "endoscope/segmentation/image_raw", 2,
        [this](const sensor_msgs::Image::ConstPtr& m) { segmentation = m; });
    ros::Subscriber flow_sub = handle.subscribe<sensor_msgs::Image>(
        "endoscope/flow/image_raw", 2, [this](const sensor_msgs::Image::ConstPtr& m) {
          flow = m;
          const std::size_t middle = 288u * 720 + 360;
          std::memcpy(flows[m->header.stamp].data(), &m->data[8 * middle], 8);
        });
    std::map<ros::Time, std::array<float, 2>> flows;  ///< in the middle of each picture
    ros::Subscriber keypoints_sub = handle.subscribe<vest_msgs::Keypoints>(
        "endoscope/keypoints", 2, [this](const vest_msgs::Keypoints::ConstPtr& m) { keypoints = m; });
    sensor_msgs::Image::ConstPtr depth, segmentation, flow;
    vest_msgs::Keypoints::ConstPtr keypoints;
    std::map<ros::Time, float> shown_dx;  ///< of each state published
    sensor_msgs::Image::ConstPtr last, last_second;
    sensor_msgs::CameraInfo::ConstPtr last_info;
    sensor_msgs::CompressedImage::ConstPtr last_jpeg;
    int images = 0;
    std::uint64_t step = 0;
    vest_msgs::TissueTopology scene;
    ros::Time last_stamp;
    Eigen::Vector3d left_tip{-0.03, 0, 0.05};

    World() {
      scene.header.frame_id = "world";
      scene.revision = 1;
      scene.scene = "balls";
      scene.objects = {ball("uterus", "uterus", 0.02, 0.08, false),
                       ball("cavity", "cavity", 0.15, 0.0, true)};
      scene.objects[0].segmentation_label = 1;
      scene.objects[1].segmentation_label = 2;
      topology.publish(scene);
    }

    void publishOnce(float dx, std::uint32_t revision) {
      vest_msgs::TissueState s;
      s.header.frame_id = "world";
      s.header.stamp = ros::Time::now();
      s.revision = revision;
      for (const auto& o : scene.objects)
        for (std::size_t i = 0; i < o.rest_position.size(); ++i)
          s.positions.push_back(o.rest_position[i] + (i % 3 == 0 && o.name == "uterus" ? dx : 0.0f));
      last_stamp = s.header.stamp;
      s.step = ++step;
      shown_dx[s.header.stamp] = dx;
      state.publish(s);
      vest_msgs::InstrumentStates m;
      m.header = s.header;
      vest_msgs::InstrumentState scope;
      scope.name = "endoscope";
      scope.tool = vest_msgs::InstrumentState::TOOL_ENDOSCOPE;
      scope.tip.orientation.w = 1;
      vest_msgs::InstrumentState grasper = scope;
      grasper.name = "left";
      grasper.tool = vest_msgs::InstrumentState::TOOL_GRASPER;
      grasper.tip.position.x = left_tip.x();
      grasper.tip.position.y = left_tip.y();
      grasper.tip.position.z = left_tip.z();
      m.instruments = {grasper, scope};
      instruments.publish(m);
    }

    /// Publishes at 30 Hz until `images` more pictures came; false after `seconds`.
    bool run(int wanted, double seconds = 40, float dx = 0, std::uint32_t revision = 1) {
      const int start = images;
      const ros::WallTime begin = ros::WallTime::now();
      ros::WallRate rate(30);
      while (ros::ok() && (ros::WallTime::now() - begin).toSec() < seconds) {
        publishOnce(dx, revision);
        ros::spinOnce();
        if (images - start >= wanted) return true;
        rate.sleep();
      }
      return false;
    }

    cv::Mat bgr() const {
      const cv::Mat rgb(static_cast<int>(last->height), static_cast<int>(last->width), CV_8UC3,
                        const_cast<std::uint8_t*>(last->data.data()), last->step);
      cv::Mat out;
      cv::cvtColor(rgb, out, cv::COLOR_RGB2BGR);
      return out;
    }
  };
  static World* world;
};
Displays::World* Displays::world = nullptr;

/// Centre of what is clearly paler than the cavity behind: the uterus.
cv::Point2d paleCentre(const cv::Mat& bgr) {
  std::vector<cv::Mat> c;
  cv::Mat smooth;
  cv::GaussianBlur(bgr, smooth, {0, 0}, 5);
  cv::split(smooth, c);
  double brightest = 0;
  cv::minMaxLoc(c[1], nullptr, &brightest);
  const cv::Moments m = cv::moments(c[1] > 0.5 * brightest, true);
  return m.m00 > 0 ? cv::Point2d(m.m10 / m.m00, m.m01 / m.m00) : cv::Point2d(-1, -1);
}

TEST_F(Displays, PictureArrivesLitRoundAndAsTheCalibrationSays) {
  ASSERT_TRUE(world->run(25, 60)) << "no pictures: " << world->images;
  EXPECT_EQ(world->last->width, 720u);
  EXPECT_EQ(world->last->height, 576u);
  EXPECT_EQ(world->last->encoding, "rgb8");
  EXPECT_EQ(world->last->header.frame_id, "endoscope_optical_frame");
  const auto rows = vest::picture::checkPicture(world->bgr(), vest::picture::findCircle(world->bgr()));
  for (const auto& row : rows) {
    if (row.what == "luminance at 50 %") {
      EXPECT_GT(row.value, 20) << "too dark";
    }
    if (row.what == "brightest outside of the circle" || row.what == "round border, %") {
      EXPECT_TRUE(row.inside()) << vest::picture::format(rows);
    }
  }
  ASSERT_TRUE(world->last_info);
  EXPECT_EQ(world->last_info->width, world->last->width);
  EXPECT_EQ(world->last_info->distortion_model, "plumb_bob");
  EXPECT_NEAR(world->last_info->K[0], 360 / std::tan(35 * M_PI / 180), 0.01);
  // The ball on the axis appears at the principal point.
  const cv::Point2d centre = paleCentre(world->bgr());
  EXPECT_NEAR(centre.x, world->last_info->K[2], 12);
  EXPECT_NEAR(centre.y, world->last_info->K[5], 12);
}

TEST_F(Displays, PictureFollowsTheState) {
  // The ball alone before black: what is lit in the middle of the picture is the ball.
  const vest_msgs::TissueTopology whole = world->scene;
  world->scene.objects.resize(1);
  world->scene.revision = 3;
  world->topology.publish(world->scene);
  const auto centre = [&](float dx) {
    EXPECT_TRUE(world->run(12, 40, dx, 3));
    cv::Mat grey, inner = cv::Mat::zeros(world->bgr().size(), CV_8U);
    cv::cvtColor(world->bgr(), grey, cv::COLOR_BGR2GRAY);
    cv::circle(inner, {360, 288}, 265, 255, -1);  // without the rim and the instrument at the edge
    const cv::Moments m = cv::moments((grey > 40) & inner, true);
    EXPECT_GT(m.m00, 20000) << "the ball fills about 50,000 pixels";
    return m.m00 > 0 ? m.m10 / m.m00 : -1.0;
  };
  // World x is the picture's right here. 16 mm at 7 to 8 cm and 514 pixels of focal length: some 110 pixels.
  const double left = centre(-0.008f), right = centre(0.008f);
  EXPECT_GT(right, left + 80);
  EXPECT_LT(right, left + 140);
  EXPECT_NEAR(0.5 * (left + right), 360, 15);
  world->scene = whole;
  world->topology.publish(whole);
}

TEST_F(Displays, StampIsThatOfTheState) {
  ASSERT_TRUE(world->run(5));
  EXPECT_LE(world->last->header.stamp, world->last_stamp);
  EXPECT_GT(world->last->header.stamp, world->last_stamp - ros::Duration(2.0));
  EXPECT_NE(world->last->header.stamp, ros::Time());
}

TEST_F(Displays, JpegArrivesForThoseWhoSubscribe) {
  ASSERT_TRUE(world->run(20));
  ASSERT_TRUE(world->last_jpeg);
  EXPECT_GT(world->last_jpeg->data.size(), 5000u);
  EXPECT_EQ(world->last_jpeg->data[0], 0xff);
}

TEST_F(Displays, TwoViewsDrawAtTheSameTime) {
  ASSERT_TRUE(world->run(10));
  ASSERT_TRUE(world->last_second);
  EXPECT_EQ(world->last_second->width, 320u);
}

/// Distance along the optical axis to the triangles of the ball, moved by dx; infinite where the ray misses.
double castAtBall(const vest_msgs::TissueObject& o, float dx, const Eigen::Vector3d& ray) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t + 2 < o.triangles.size(); t += 3) {
    Eigen::Vector3d p[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const float* q = &o.rest_position[3 * o.triangles[t + k]];
      p[k] = Eigen::Vector3d(q[0] + dx, q[1], q[2]);
    }
    Eigen::Matrix3d M;
    M << p[1] - p[0], p[2] - p[0], -ray;
    if (std::fabs(M.determinant()) < 1e-16) continue;
    const Eigen::Vector3d w = M.inverse() * -p[0];
    if (w.x() >= 0 && w.y() >= 0 && w.x() + w.y() <= 1 && w.z() > 0.002) best = std::min(best, w.z());
  }
  return best;
}

vest::camera::Intrinsics cameraOf(const sensor_msgs::CameraInfo& info) {
  vest::camera::Intrinsics c;
  c.width = info.width, c.height = info.height;
  c.fx = info.K[0], c.cx = info.K[2], c.fy = info.K[4], c.cy = info.K[5];
  std::copy_n(info.D.begin(), 5, c.distortion.begin());
  return c;
}

/// Sub-pixel ray of a published picture, by its own camera_info.
Eigen::Vector3d rayOf(const sensor_msgs::CameraInfo& info, int u, int v) {
  const vest::camera::Intrinsics c = cameraOf(info);
  const Eigen::Vector2d n = vest::camera::unproject(c, {double(u), double(v)});
  return {n.x(), n.y(), 1};
}

TEST_F(Displays, DepthAndLabelsAreThoseOfRaysCastIntoTheStateOfTheSameStep) {
  ASSERT_TRUE(world->run(12, 40, 0.004f));
  // Each comes by a connection of its own: wait for a moment at which both are of one picture.
  for (int i = 0; i < 100 && !(world->depth && world->segmentation &&
                               world->depth->header.stamp == world->segmentation->header.stamp);
       ++i)
    world->run(1, 5, 0.004f);
  ASSERT_TRUE(world->depth && world->segmentation && world->last_info);
  ASSERT_EQ(world->depth->encoding, "32FC1");
  ASSERT_EQ(world->segmentation->encoding, "mono16");
  ASSERT_EQ(world->shown_dx.count(world->depth->header.stamp), 1u) << "the stamp is that of a state";
  const float dx = world->shown_dx[world->depth->header.stamp];
  ASSERT_EQ(world->segmentation->header.stamp, world->depth->header.stamp);
  int on_ball = 0, inside = 0;
  unsigned random = 1;
  for (int i = 0; i < 300; ++i) {
    random = random * 1664525u + 1013904223u;
    const int u = 90 + static_cast<int>((random >> 8) % 540), v = 30 + static_cast<int>((random >> 18) % 510);
    const std::size_t at = static_cast<std::size_t>(v) * 720 + static_cast<std::size_t>(u);
    float depth;
    std::memcpy(&depth, &world->depth->data[4 * at], 4);
    std::uint16_t label;
    std::memcpy(&label, &world->segmentation->data[2 * at], 2);
    if (!std::isfinite(depth)) continue;
    ++inside;
    if (label != 1) continue;  // the ball is the first object
    const double expected = castAtBall(world->scene.objects[0], dx, rayOf(*world->last_info, u, v));
    if (!std::isfinite(expected)) continue;  // its silhouette
    ++on_ball;
    EXPECT_NEAR(depth, expected, 0.005 * expected) << u << " " << v;
  }
  EXPECT_GT(inside, 150);
  EXPECT_GT(on_ball, 25);
}

TEST_F(Displays, FlowIsTheMotionSinceThePictureBefore) {
  ASSERT_TRUE(world->run(6, 40, 0.0f));
  // The ball moves by 4 mm at 6 cm before the camera, between two pictures: the first one that shows it there
  // has the flow.
  const float dx = 0.004f;
  world->flows.clear();
  ASSERT_TRUE(world->run(8, 40, dx));
  ASSERT_TRUE(world->flow);
  ASSERT_EQ(world->flow->encoding, "32FC2");
  bool moved = false;
  for (const auto& [stamp, flow] : world->flows) {
    if (world->shown_dx[stamp] != dx) continue;
    if (moved) {
      EXPECT_NEAR(flow[0], 0, 0.01) << "it rests again";
      continue;
    }
    moved = true;
    EXPECT_NEAR(flow[0], world->last_info->K[0] * 0.004 / 0.06, 2.5);
    EXPECT_NEAR(flow[1], 0, 0.5);
  }
  EXPECT_TRUE(moved);
}

/// The tip of the left instrument is at `expected` (optical frame, m), within a pixel.
void expectTip(const vest_msgs::Keypoints& keypoints, const sensor_msgs::CameraInfo& info,
               const Eigen::Vector3d& expected) {
  bool tip = false;
  for (const vest_msgs::Keypoint& k : keypoints.keypoints) {
    if (k.instrument != "left" || k.name != "tip") continue;
    tip = true;
    const Eigen::Vector2d pixel =
        vest::camera::project(cameraOf(info), {expected.x() / expected.z(), expected.y() / expected.z()});
    EXPECT_NEAR(k.u, pixel.x(), 1);
    EXPECT_NEAR(k.v, pixel.y(), 1);
    EXPECT_NEAR(k.depth, expected.z(), 1e-4);
  }
  EXPECT_TRUE(tip);
}

TEST_F(Displays, KeypointsLieWhereThePoseProjects) {
  ASSERT_TRUE(world->run(6));
  ASSERT_TRUE(world->keypoints);
  EXPECT_GT(world->keypoints->step, 0u);
  EXPECT_EQ(world->keypoints->header.frame_id, "endoscope_optical_frame");
  expectTip(*world->keypoints, *world->last_info, world->left_tip);
}

TEST_F(Displays, GarbageIsSurvivedAndTheNextGoodStateIsShown) {
  const auto nan = std::numeric_limits<float>::quiet_NaN();
  for (int round = 0; round < 10; ++round) {
    vest_msgs::TissueState s;
    s.revision = 1;
    s.positions.assign(3, nan);
    world->state.publish(s);
    s.positions.assign(3 * (world->scene.objects[0].knot_count + world->scene.objects[1].knot_count), nan);
    world->state.publish(s);
    s.revision = 77;
    world->state.publish(s);
    vest_msgs::TissueTopologyDelta d;
    d.from_revision = 1;
    d.revision = 2;
    d.object = 99;
    world->delta.publish(d);
    vest_msgs::InstrumentStates m;
    m.instruments.resize(3);  // zero quaternions
    m.instruments[0].name = "endoscope";
    m.instruments[1].tool = 200;
    m.instruments[1].tip.position.x = nan;
    world->instruments.publish(m);
    ros::WallDuration(0.03).sleep();
  }
  vest_msgs::TissueTopology empty;
  world->topology.publish(empty);
  ros::WallDuration(0.2).sleep();
  vest_msgs::TissueTopology broken = world->scene;
  broken.objects[0].triangles[0] = 4000000000u;
  broken.objects[1].binding_start.clear();
  world->topology.publish(broken);
  ros::WallDuration(0.2).sleep();
  world->topology.publish(world->scene);
  ros::WallDuration(0.2).sleep();
  world->topology.publish(world->scene);
  ASSERT_TRUE(world->run(15));
  const cv::Point2d centre = paleCentre(world->bgr());
  EXPECT_NEAR(centre.x, 360, 15);
}

// The last one: what it says to tf stays.
TEST_F(Displays, KeypointsLieWhereTfSaysTheInstrumentIs) {
  world->left_tip = {-0.01, 0.03, 0.05};
  tf2_ros::StaticTransformBroadcaster broadcaster;
  std::vector<geometry_msgs::TransformStamped> links(3);
  const auto link = [](const char* parent, const char* child, geometry_msgs::TransformStamped* t) {
    t->header.frame_id = parent;
    t->child_frame_id = child;
    t->transform.rotation.w = 1;
  };
  link("world", "endoscope_tip", &links[0]);
  link("endoscope_tip", "endoscope_optical_frame", &links[1]);
  links[1].transform.rotation.x = -std::sin(M_PI / 12);  // an optic of 30 degrees
  links[1].transform.rotation.w = std::cos(M_PI / 12);
  link("world", "left_tip", &links[2]);
  links[2].transform.translation.x = world->left_tip.x();
  links[2].transform.translation.y = world->left_tip.y();
  links[2].transform.translation.z = world->left_tip.z();
  broadcaster.sendTransform(links);
  tf2::BufferCore buffer;
  for (const auto& t : links) buffer.setTransform(t, "test", true);
  const auto tip =
      buffer.lookupTransform("endoscope_optical_frame", "left_tip", ros::Time()).transform.translation;
  ASSERT_TRUE(world->run(12));
  expectTip(*world->keypoints, *world->last_info, {tip.x, tip.y, tip.z});
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_displays");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
