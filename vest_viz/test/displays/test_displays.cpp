// Drives the displays inside a real rviz over topics, and looks at the pictures that come back.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <vector>

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

#include "ball.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_viz/camera/model.h"
#include "vest_viz/picture/check.h"

namespace {

using vest::displays::ball;

/// What moves, at one time.
struct Moment {
  float dx = 0;                                        ///< m, the ball's way to the right
  Eigen::Vector3d eye{0, 0, 0}, left{-0.03, 0, 0.05};  ///< m, world: tips of endoscope and left instrument
};

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
    ros::Publisher instruments = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1000);
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
        "endoscope/segmentation/image_raw", 2, [this](const sensor_msgs::Image::ConstPtr& m) {
          segmentation = m;
          labels[m->header.stamp] = m;
        });
    ros::Subscriber flow_sub = handle.subscribe<sensor_msgs::Image>(
        "endoscope/flow/image_raw", 2,
        [this](const sensor_msgs::Image::ConstPtr& m) { flows[m->header.stamp] = m; });
    std::map<ros::Time, sensor_msgs::Image::ConstPtr> labels, flows;
    ros::Subscriber keypoints_sub = handle.subscribe<vest_msgs::Keypoints>(
        "endoscope/keypoints", 100, [this](const vest_msgs::Keypoints::ConstPtr& m) {
          keypoints = m;
          all_keypoints.push_back(m);
        });
    sensor_msgs::Image::ConstPtr depth, segmentation;
    vest_msgs::Keypoints::ConstPtr keypoints;
    std::vector<vest_msgs::Keypoints::ConstPtr> all_keypoints;  ///< one of each picture with ground truth
    std::map<ros::Time, Moment> shown;                          ///< of each state published
    ros::Time told;                                             ///< instruments were published up to it
    sensor_msgs::Image::ConstPtr last, last_second;
    sensor_msgs::CameraInfo::ConstPtr last_info;
    sensor_msgs::CompressedImage::ConstPtr last_jpeg;
    int images = 0;
    std::uint64_t step = 0;
    vest_msgs::TissueTopology scene;
    ros::Time last_stamp;
    Eigen::Vector3d left_tip{-0.03, 0, 0.05};
    Eigen::Vector3d sight{0, 0, 1};  ///< in the endoscope tip's frame: a straight optic

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

    void publishState(const ros::Time& stamp, const Moment& now, std::uint32_t revision) {
      vest_msgs::TissueState s;
      s.header.frame_id = "world";
      s.header.stamp = last_stamp = stamp;
      s.revision = revision;
      for (const auto& o : scene.objects)
        for (std::size_t i = 0; i < o.rest_position.size(); ++i)
          s.positions.push_back(o.rest_position[i] + (i % 3 == 0 && o.name == "uterus" ? now.dx : 0.0f));
      s.step = ++step;
      shown[stamp] = now;
      state.publish(s);
    }

    void publishInstruments(const ros::Time& stamp, const Moment& now) {
      vest_msgs::InstrumentStates m;
      m.header.frame_id = "world";
      m.header.stamp = stamp;
      m.instruments.resize(2);
      m.instruments[0].name = "left";
      m.instruments[0].tool = vest_msgs::InstrumentState::TOOL_GRASPER;
      m.instruments[1].name = "endoscope";
      m.instruments[1].tool = vest_msgs::InstrumentState::TOOL_ENDOSCOPE;
      for (int k = 0; k < 3; ++k) m.instruments[1].sight[k] = sight[k];
      for (auto& i : m.instruments) {
        const Eigen::Vector3d& p = i.name == "left" ? now.left : now.eye;
        i.tip.orientation.w = 1;
        i.tip.position.x = p.x(), i.tip.position.y = p.y(), i.tip.position.z = p.z();
      }
      instruments.publish(m);
    }

    void publishOnce(float dx, std::uint32_t revision) {
      Moment now;
      now.dx = dx;
      now.left = left_tip;
      publishState(ros::Time::now(), now, revision);
      publishInstruments(last_stamp, now);
    }

    /// As in the trainer: instruments at 1 kHz, states at some 30 Hz that are a few steps old when they come.
    bool runMoving(const std::function<Moment(double)>& motion, std::size_t wanted, double seconds = 60) {
      const ros::WallTime begin = ros::WallTime::now();
      const ros::Duration step(0.001), age(0.012);
      while (ros::ok() && (ros::WallTime::now() - begin).toSec() < seconds) {
        const ros::Time now = ros::Time::now();
        if (now - told > ros::Duration(0.1)) told = now - ros::Duration(0.05);
        for (; told + step < now; told += step)
          publishInstruments(told + step, motion((told + step).toSec()));
        ros::WallDuration(0.005).sleep();
        publishState(told - age, motion((told - age).toSec()), 1);
        ros::WallDuration(0.03).sleep();
        ros::spinOnce();
        if (all_keypoints.size() >= wanted) return true;
      }
      return false;
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

/// Distance along the optical axis to the nearest triangle; infinite where the ray misses all.
double castAt(const vest_msgs::TissueTopology& scene, const Moment& now, const Eigen::Vector3d& ray,
              std::uint16_t* label) {
  double best = std::numeric_limits<double>::infinity();
  for (const vest_msgs::TissueObject& o : scene.objects)
    for (std::size_t t = 0; t + 2 < o.triangles.size(); t += 3) {
      Eigen::Vector3d p[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const float* q = &o.rest_position[3 * o.triangles[t + k]];
        p[k] = Eigen::Vector3d(q[0] + (o.name == "uterus" ? now.dx : 0.0f), q[1], q[2]) - now.eye;
      }
      Eigen::Matrix3d M;
      M << p[1] - p[0], p[2] - p[0], -ray;
      if (std::fabs(M.determinant()) < 1e-16) continue;
      const Eigen::Vector3d w = M.inverse() * -p[0];
      if (w.x() < 0 || w.y() < 0 || w.x() + w.y() > 1 || w.z() <= 0.002 || w.z() >= best) continue;
      best = w.z();
      *label = o.segmentation_label;
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
  ASSERT_EQ(world->shown.count(world->depth->header.stamp), 1u) << "the stamp is that of a state";
  const Moment now = world->shown[world->depth->header.stamp];
  ASSERT_EQ(world->segmentation->header.stamp, world->depth->header.stamp);
  int on_ball = 0, inside = 0, wrong_label = 0;
  unsigned random = 1;
  for (int i = 0; i < 300; ++i) {
    random = random * 1664525u + 1013904223u;
    const int u = 90 + static_cast<int>((random >> 8) % 540), v = 30 + static_cast<int>((random >> 18) % 510);
    const std::size_t at = static_cast<std::size_t>(v) * 720 + static_cast<std::size_t>(u);
    float depth;
    std::memcpy(&depth, &world->depth->data[4 * at], 4);
    std::uint16_t label, wanted = 0;
    std::memcpy(&label, &world->segmentation->data[2 * at], 2);
    if (!std::isfinite(depth) || label > 2) continue;  // outside, or an instrument
    ++inside;
    const double expected = castAt(world->scene, now, rayOf(*world->last_info, u, v), &wanted);
    if (label != wanted) {
      ++wrong_label;
      continue;
    }
    on_ball += label == 1;
    EXPECT_NEAR(depth, expected, 0.005 * expected) << u << " " << v;
  }
  EXPECT_GT(inside, 150);
  EXPECT_GT(on_ball, 25);
  EXPECT_LE(wrong_label, 2) << "only pixels on the silhouette may differ";
}

TEST_F(Displays, InstrumentsOfTheStatesReplaceTheFastTopicWhileThereAreAny) {
  ASSERT_TRUE(world->run(3));
  const std::uint32_t before = world->instruments.getNumSubscribers();
  ASSERT_GT(before, 0U);
  const auto until = [&](const std::function<bool()>& done, const std::function<void()>& also) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(40);
    while (ros::ok() && !done() && ros::WallTime::now() < end) {
      world->publishOnce(0, 1);
      also();
      ros::spinOnce();
      ros::WallDuration(0.03).sleep();
    }
    return done();
  };
  ros::Publisher slow = world->handle.advertise<vest_msgs::InstrumentStates>("tissue/instruments", 10);
  vest_msgs::InstrumentStates m;
  m.instruments.resize(1);
  m.instruments[0].name = "endoscope";
  m.instruments[0].tool = vest_msgs::InstrumentState::TOOL_ENDOSCOPE;
  m.instruments[0].tip.orientation.w = 1;
  EXPECT_TRUE(until([&] { return world->instruments.getNumSubscribers() < before; },
                    [&] {
                      m.header.stamp = world->last_stamp;
                      slow.publish(m);
                    }))
      << "a thousand messages a second are still read";
  slow.shutdown();
  EXPECT_TRUE(until([&] { return world->instruments.getNumSubscribers() == before; }, [] {}))
      << "the simulation is gone: the instruments move on";
  EXPECT_TRUE(world->run(3));
}

/// Ball, endoscope and left instrument at a time (s): a few pixels from picture to picture, and the
/// instrument 9 pixels in the 12 ms by which a state is older than the newest instruments.
Moment moving(double t) {
  const double a = 2 * M_PI * std::fmod(t, 10.0);
  Moment now;
  now.dx = static_cast<float>(0.004 * std::sin(0.5 * a));
  now.eye = {0.003 * std::sin(0.7 * a), 0.002 * std::cos(0.4 * a), 0.004 * std::sin(0.3 * a)};
  now.left = {-0.012 + 0.012 * std::sin(a), 0.012 * std::cos(a), 0.05};
  return now;
}

/// Pixels between the left instrument's tip and where `expected` (optical frame, m) is seen; 1e9: no tip.
double tipError(const vest_msgs::Keypoints& keypoints, const sensor_msgs::CameraInfo& info,
                const Eigen::Vector3d& expected) {
  for (const vest_msgs::Keypoint& k : keypoints.keypoints) {
    if (k.instrument != "left" || k.name != "tip") continue;
    const Eigen::Vector2d pixel =
        vest::camera::project(cameraOf(info), {expected.x() / expected.z(), expected.y() / expected.z()});
    return std::hypot(k.u - pixel.x(), k.v - pixel.y());
  }
  return 1e9;
}

TEST_F(Displays, FlowIsTheReprojectedMotionSinceThePictureBefore) {
  ASSERT_TRUE(world->run(6));
  world->all_keypoints.clear(), world->flows.clear(), world->labels.clear();
  int pictures = 0, on_ball = 0, on_cavity = 0;
  double largest = 0;
  unsigned random = 1;
  const auto& all = world->all_keypoints;
  const auto judge = [&](std::size_t i) {
    // Each picture with ground truth has its keypoints: those before are of the picture before.
    const ros::Time now = all[i]->header.stamp, before = all[i - 1]->header.stamp;
    if (now == before || !world->flows.count(now) || !world->labels.count(now)) return;
    // Unless keypoints were lost on their way, or a state was drawn again: this test was held up, and tissue
    // that stands still is shown with the instruments as they are by then.
    bool whole = true;
    for (const std::size_t k : {i - 1, i, i + 1})
      whole = whole && all[k]->header.seq == all[k - 1]->header.seq + 1;
    if (!whole || all[i - 2]->header.stamp == before || all[i + 1]->header.stamp == now) return;
    ASSERT_EQ(world->shown.count(now) + world->shown.count(before), 2u);
    const Moment &is = world->shown[now], &was = world->shown[before];
    // Held up before it was drawn, a state stands still by then, too: its instruments tell.
    if (tipError(*all[i], *world->last_info, is.left - is.eye) > 0.5 ||
        tipError(*all[i - 1], *world->last_info, was.left - was.eye) > 0.5)
      return;
    ++pictures;
    const vest::camera::Intrinsics camera = cameraOf(*world->last_info);
    for (int k = 0; k < 60; ++k) {
      random = random * 1664525u + 1013904223u;
      const int u = 90 + static_cast<int>((random >> 8) % 540),
                v = 30 + static_cast<int>((random >> 18) % 510);
      const std::size_t at = static_cast<std::size_t>(v) * 720 + static_cast<std::size_t>(u);
      float flow[2];
      std::memcpy(flow, &world->flows[now]->data[8 * at], 8);
      std::uint16_t label, wanted = 0;
      std::memcpy(&label, &world->labels[now]->data[2 * at], 2);
      const Eigen::Vector3d ray = rayOf(*world->last_info, u, v);
      const double z = castAt(world->scene, is, ray, &wanted);
      if (label != wanted) continue;  // silhouette, instrument, outside of the round picture
      Eigen::Vector3d p = ray * z + is.eye - was.eye;
      if (label == 1) p.x() -= static_cast<double>(is.dx) - static_cast<double>(was.dx);
      const Eigen::Vector2d pixel = vest::camera::project(camera, {p.x() / p.z(), p.y() / p.z()});
      EXPECT_NEAR(flow[0], u - pixel.x(), 0.1) << u << " " << v << " of object " << label;
      EXPECT_NEAR(flow[1], v - pixel.y(), 0.1) << u << " " << v << " of object " << label;
      largest = std::max(largest, std::hypot(u - pixel.x(), v - pixel.y()));
      (label == 1 ? on_ball : on_cavity) += 1;
    }
  };
  std::size_t next = 2;
  for (int round = 0; round < 10 && pictures < 4; ++round) {
    ASSERT_TRUE(world->runMoving(moving, all.size() + 16));
    // The last one may be drawn again, with its flow here and its keypoints not yet.
    for (; next + 1 < all.size(); ++next) judge(next);
  }
  EXPECT_GT(pictures, 3);
  EXPECT_GT(on_ball, 10 * pictures / 4);
  EXPECT_GT(on_cavity, 10 * pictures);
  EXPECT_GT(largest, 2) << "pixels: it moves";
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

TEST_F(Displays, KeypointsOfAMovingInstrumentLieWhereItWasAtThePicturesStamp) {
  ASSERT_TRUE(world->run(6));
  world->all_keypoints.clear();
  const auto& all = world->all_keypoints;
  std::size_t next = 2;
  int at_its_stamp = 0;
  for (int round = 0; round < 10 && at_its_stamp < 8; ++round) {
    ASSERT_TRUE(world->runMoving(moving, all.size() + 12));
    for (; next < all.size(); ++next) {
      const ros::Time stamp = all[next]->header.stamp;
      ASSERT_EQ(world->shown.count(stamp), 1u);
      // Where this test was held up, tissue stands still, and is shown with the newest instruments: one of
      // those that were published more than 0.1 s after it.
      const auto error = [&](const Moment& now) {
        return tipError(*all[next], *world->last_info, now.left - now.eye);
      };
      double newest = 1e9;
      for (ros::Time t = stamp + ros::Duration(0.1); t < world->told; t += ros::Duration(0.001))
        newest = std::min(newest, error(moving(t.toSec())));
      const Moment& then = world->shown[stamp];
      if (newest < 1 && error(then) > 1) continue;
      expectTip(*all[next], *world->last_info, then.left - then.eye);
      ++at_its_stamp;
    }
  }
  EXPECT_GE(at_its_stamp, 8);
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

TEST_F(Displays, KeypointsLieWhereTheKinematicsOfOpticAndLightPostSay) {
  world->left_tip = {-0.01, 0.03, 0.05};
  for (const double light_post : {0.0, 0.9}) {
    const Eigen::Isometry3d X_TipO = vest::kinematics::opticalFrame(M_PI / 6, light_post);
    world->sight = X_TipO.linear().col(2);
    ASSERT_TRUE(world->run(12));
    expectTip(*world->keypoints, *world->last_info, X_TipO.inverse() * world->left_tip);
  }
  world->sight = Eigen::Vector3d::UnitZ();
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_displays");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
