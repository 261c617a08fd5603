// Looks at pictures drawn in this process: camera calibration, and what happened to the tissue, clips, fluid
// and smoke where the ground truth says they are.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include <OgreHighLevelGpuProgram.h>
#include <OgreHighLevelGpuProgramManager.h>
#include <OgreMaterialManager.h>
#include <OgreTechnique.h>
#include <gtest/gtest.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rviz/ogre_helpers/render_system.h>
#include <vest_msgs/TissueField.h>
#include <vest_msgs/TissueState.h>
#include <boost/make_shared.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "conversion.h"
#include "endoscope_pipeline.h"
#include "ogre_assets.h"
#include "scene_messages.h"
#include "truth_output.h"

namespace vest::displays {
namespace {

using Eigen::Vector3d;

camera::Intrinsics sampleCamera() {
  return camera::fromFieldOfView(720, 576, 70 * M_PI / 180, {-0.18, 0.03, 0, 0, 0});
}

/// A square sheet of organ `organ`, 6 cm wide, seen from 6 cm above: world z up, the camera looks down.
vest_msgs::TissueTopology sheet(const std::string& organ, int cells = 40) {
  vest_msgs::TissueTopology t;
  t.revision = 1;
  t.scene = "sheet";
  vest_msgs::TissueObject o;
  o.name = o.organ = organ;
  o.segmentation_label = 1;
  const auto n = static_cast<std::uint32_t>(cells);
  o.binding_start = {0};
  for (std::uint32_t r = 0; r <= n; ++r)
    for (std::uint32_t c = 0; c <= n; ++c) {
      const float x = 0.06f * (static_cast<float>(c) / n - 0.5f),
                  y = 0.06f * (static_cast<float>(r) / n - 0.5f);
      o.rest_position.insert(o.rest_position.end(), {x, y, 0.0f});
      o.texture_coordinates.insert(o.texture_coordinates.end(), {x, y});
      o.binding_knots.push_back(o.knot_count++);
      o.binding_weights.push_back(1);
      o.binding_start.push_back(o.knot_count);
      if (r == n || c == n) continue;
      const std::uint32_t k = r * (n + 1) + c;
      o.triangles.insert(o.triangles.end(), {k, k + 1, k + n + 2, k, k + n + 2, k + n + 1});
    }
  t.objects = {o};
  return t;
}

Eigen::Isometry3d fromAbove(double height) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation().z() = height;
  X.linear() << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  return X;
}

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

/// A board that fills the round picture, as a person holds it before an endoscope: 5.5 mm squares 7 cm away,
/// turned by up to 40 degrees about ever other axes.
class Chessboard : public Offscreen {
 protected:
  static constexpr int kColumns = 10, kRows = 8;
  static constexpr double kSquare = 0.0055;

  static Eigen::Isometry3d place(int i) {
    const double around = 2.4 * i, tilt = 0.7 * ((i % 4) / 3.0);
    Eigen::Isometry3d X_WO = Eigen::Isometry3d::Identity();
    X_WO.rotate(Eigen::AngleAxisd(tilt, Vector3d(std::cos(around), std::sin(around), 0)));
    X_WO = X_WO * fromAbove(0.072 + 0.004 * (i % 5));
    X_WO.translate(Vector3d(0.005 * std::cos(1.7 * i), 0.004 * std::sin(2.3 * i), 0));
    X_WO.rotate(Eigen::AngleAxisd(0.1 + 0.05 * (i % 7), Vector3d::UnitZ()));
    return X_WO;
  }

  /// Draws `views` pictures with `resolution` pixels per pixel, and lets OpenCV find the camera in them.
  void calibrate(int views, double resolution) {
    load(tools::chessboard(kColumns, kRows, kSquare));
    EXPECT_TRUE(view.scene().warning().empty()) << view.scene().warning();
    view.setCamera(sampleCamera(), 1.0, resolution);
    view.setFixedGain(6.0);
    const camera::Intrinsics camera = sampleCamera();
    std::vector<cv::Point3f> corners;
    for (int r = 1; r < kRows; ++r)
      for (int c = 1; c < kColumns; ++c)
        corners.emplace_back(static_cast<float>((c - 0.5 * kColumns) * kSquare),
                             static_cast<float>((r - 0.5 * kRows) * kSquare), 0.0f);
    std::vector<std::vector<cv::Point2f>> seen;
    std::vector<std::vector<cv::Point3f>> board;
    Eigen::Vector2d shift(0, 0);  // sum, of what was found against where the published camera has it
    for (int i = 0; i < views; ++i) {
      const Eigen::Isometry3d X_WO = place(i);
      cv::Mat grey;
      cv::cvtColor(picture(X_WO), grey, cv::COLOR_RGB2GRAY);
      std::vector<cv::Point2f> found;
      if (!cv::findChessboardCornersSB(grey, {kColumns - 1, kRows - 1}, found, cv::CALIB_CB_ACCURACY))
        continue;
      seen.push_back(found);
      board.push_back(corners);
      const Vector3d middle = X_WO.inverse() * Vector3d(corners[31].x, corners[31].y, 0);
      const Eigen::Vector2d wanted =
          camera::project(camera, {middle.x() / middle.z(), middle.y() / middle.z()});
      shift += Eigen::Vector2d(found[31].x, found[31].y) - wanted;
    }
    ASSERT_GE(static_cast<int>(seen.size()), views - views / 8) << "the board must be found";
    cv::Mat K, D;
    std::vector<cv::Mat> R, t;
    const double error = cv::calibrateCamera(board, seen, {720, 576}, K, D, R, t,
                                             cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3);
    shift /= static_cast<double>(seen.size());
    std::printf(
        "fx %.2f fy %.2f cx %.2f cy %.2f k1 %.4f k2 %.4f, %.3f px, middle off by %.3f %.3f px in %zu views\n",
        K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2), D.at<double>(0),
        D.at<double>(1), error, shift.x(), shift.y(), seen.size());
    EXPECT_LT(error, 0.3) << "pixels";
    EXPECT_LT(shift.norm(), 0.15) << "half a pixel would be a mistake of the pixels' centres";
    EXPECT_NEAR(K.at<double>(0, 0), camera.fx, 0.01 * camera.fx);
    EXPECT_NEAR(K.at<double>(1, 1), camera.fy, 0.01 * camera.fy);
    EXPECT_NEAR(K.at<double>(0, 2), camera.cx, 0.01 * camera.cx);
    EXPECT_NEAR(K.at<double>(1, 2), camera.cy, 0.01 * camera.cy);
    // Of the distortion it is its effect that counts: 1 % of the distance from the middle, at the border.
    const double r2 = 0.56 * 0.56, said = -0.18 * r2 + 0.03 * r2 * r2;
    EXPECT_NEAR(D.at<double>(0) * r2 + D.at<double>(1) * r2 * r2, said, 0.01);
  }
};

TEST_F(Chessboard, CalibrationByOpenCvGivesTheCamerasParametersBack) {
  calibrate(16, 1.0);
}

TEST_F(Chessboard, CalibrationHoldsAtEveryLevelOfQuality) {
  std::printf("count: 4 of 4 levels of quality\n");
  for (double resolution : {0.65, 0.85, 1.0, 1.8}) {
    SCOPED_TRACE(resolution);
    calibrate(40, resolution);
  }
}

TEST_F(Offscreen, BloodIsRedCharIsBlackCoagulatedIsPaleAndTheRestStaysAsItWas) {
  load(sheet("uterus"));
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  const cv::Mat before = picture(X_WO);
  const Vector3d left(-0.015, 0, 0), right(0.015, 0, 0), far(0, 0.022, 0);
  const cv::Scalar healthy = colourAt(before, X_WO, left);
  mark(vest_msgs::TissueField::BLEEDING, 2e-9f, -0.015, 0.008);
  const cv::Mat bloody = picture(X_WO);
  const cv::Scalar blood = colourAt(bloody, X_WO, left);
  EXPECT_GT(blood[0], 3 * blood[1]) << "red";
  EXPECT_LT(blood[1], 0.5 * healthy[1]);
  EXPECT_NEAR(colourAt(bloody, X_WO, far)[1], colourAt(before, X_WO, far)[1], 2)
      << "elsewhere nothing changes";
  mark(vest_msgs::TissueField::BLEEDING, 2e-9f, -0.015, 0.0);
  mark(vest_msgs::TissueField::WETNESS, 1, -0.015, 0.008);
  const cv::Scalar film = colourAt(picture(X_WO), X_WO, left);
  EXPECT_GT(film[0], 3 * film[1]) << "blood that lies there is as red as blood that comes";
  mark(vest_msgs::TissueField::CHAR, 1, 0.015, 0.006);
  mark(vest_msgs::TissueField::DAMAGE, 1, 0.015, 0.012);
  const cv::Mat burnt = picture(X_WO);
  const cv::Scalar charred = colourAt(burnt, X_WO, right, 5);
  EXPECT_LT(charred[0], 0.45 * healthy[0]) << "black";
  const Vector3d rim = right + Vector3d(0, 0.0095, 0);
  const cv::Scalar pale = colourAt(burnt, X_WO, rim, 4), was = colourAt(before, X_WO, rim, 4);
  EXPECT_GT(pale[1] / pale[0], was[1] / was[0] + 0.03) << "less red";
}

TEST_F(Offscreen, CutFaceShowsTheInsideColour) {
  vest_msgs::TissueTopology whole = sheet("uterus");
  load(whole);
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  const cv::Scalar skin = colourAt(picture(X_WO), X_WO, {0.01, 0, 0}, 20);
  whole.revision = 2;
  whole.objects[0].triangle_layer.assign(whole.objects[0].triangles.size() / 3, 0);
  for (std::size_t t = 0; t < whole.objects[0].triangle_layer.size(); ++t)
    if (whole.objects[0].rest_position[3 * whole.objects[0].triangles[3 * t]] > 0)
      whole.objects[0].triangle_layer[t] = 2;
  load(whole);
  const cv::Mat cut = picture(X_WO);
  const cv::Scalar inside = colourAt(cut, X_WO, {0.01, 0, 0}, 20);
  EXPECT_GT(cv::norm(inside - skin), 25);
  EXPECT_GT(inside[0] + inside[1] + inside[2], 60) << "not black";
}

TEST_F(Offscreen, ClipPoolAndDropsAreDrawnWhereTheTruthSays) {
  load(sheet("tube"));
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  const cv::Mat before = picture(X_WO);
  auto clips = boost::make_shared<vest_msgs::TissueAttachments>();
  clips->attachments.resize(1);
  clips->attachments[0].kind = vest_msgs::TissueAttachment::CLIP;
  clips->attachments[0].closure = 1;
  clips->attachments[0].pose.position.x = -0.012;
  clips->attachments[0].pose.position.z = 0.002;
  clips->attachments[0].pose.orientation.x = clips->attachments[0].pose.orientation.w = std::sqrt(0.5);
  view.setAttachments(clips);
  auto fluid = boost::make_shared<vest_msgs::FluidState>();
  fluid->particle_radius = 0.001f;
  fluid->positions = {0, 0.018f, 0.01f};
  fluid->velocities = {0, 0, 0};
  fluid->blood_fraction = {255};
  vest_msgs::FluidPool pool;
  pool.origin.position.x = 0.006, pool.origin.position.y = -0.006, pool.origin.position.z = 0.001;
  pool.origin.orientation.w = 1;
  pool.cell = 0.001, pool.columns = pool.rows = 12;
  pool.height.assign(144, 0.0f);
  pool.blood_fraction = 1;
  fluid->pools = {pool};
  view.setFluid(fluid);
  const cv::Mat after = picture(X_WO);
  TruthOutput truth;
  cv::Mat labels;
  truth.draw(view, store, nullptr, X_WO).segmentation(&labels);
  int metal = 0, metal_changed = 0, fluid_count = 0, fluid_red = 0, tissue = 0, tissue_changed = 0;
  for (int v = 0; v < labels.rows; ++v)
    for (int u = 0; u < labels.cols; ++u) {
      const auto a = after.at<cv::Vec3b>(v, u), b = before.at<cv::Vec3b>(v, u);
      const bool changed = cv::norm(cv::Vec3i(a) - cv::Vec3i(b)) > 25;
      const std::uint16_t label = labels.at<std::uint16_t>(v, u);
      if (label == truth::kMetal) ++metal, metal_changed += changed;
      if (label == truth::kFluid) ++fluid_count, fluid_red += a[0] > 2 * a[1] || a[0] < 60;
      if (label == 1) ++tissue, tissue_changed += changed;
    }
  EXPECT_GT(metal, 100);
  EXPECT_GT(metal_changed, 0.8 * metal);
  EXPECT_GT(fluid_count, 3000) << "the pool is 12 mm wide at 6 cm: some 100 pixels";
  EXPECT_GT(fluid_red, 0.75 * fluid_count);
  EXPECT_GT(tissue, 50000);
  EXPECT_LT(tissue_changed, 0.01 * tissue);
}

TEST_F(Offscreen, SmokeVeilsByBothMethods) {
  load(sheet("uterus"));
  const Eigen::Isometry3d X_WO = fromAbove(0.08);
  auto smoke = boost::make_shared<vest_msgs::SmokeState>();
  smoke->origin.x = smoke->origin.y = -0.03;
  smoke->origin.z = 0.01;
  smoke->cell = 0.005;
  smoke->size = {12, 12, 8};
  smoke->density_scale = 0.02f;
  smoke->density.assign(12 * 12 * 8, 200);
  vest_msgs::SmokePuff puff;
  puff.position.z = 0.03;
  puff.radius = 0.02f, puff.density = 0.05f, puff.seed = 3;
  smoke->puffs = {puff};
  const auto saturation = [&] {
    const cv::Scalar c = colourAt(picture(X_WO), X_WO, {0, 0, 0}, 30);
    return (c[0] - c[1]) / std::max(c[0], 1.0);
  };
  const double clear = saturation();
  view.setSmoke(smoke);
  view.setSmokeMethod(EndoscopePipeline::Smoke::Field);
  EXPECT_LT(saturation(), 0.75 * clear) << "smoke is grey";
  view.setSmokeMethod(EndoscopePipeline::Smoke::Billboards);
  EXPECT_LT(saturation(), 0.75 * clear);
  view.setSmokeMethod(EndoscopePipeline::Smoke::Off);
  EXPECT_NEAR(saturation(), clear, 0.02);
}

TEST_F(Offscreen, WithoutShadersTissueIsDrawnPlainAndTheStatusSaysWhy) {
  // What a machine without them does: the program does not compile.
  auto& programs = Ogre::HighLevelGpuProgramManager::getSingleton();
  const Ogre::HighLevelGpuProgramPtr broken =
      programs.createProgram("vest_viz/test_broken", kOgreGroup, "glsl", Ogre::GPT_FRAGMENT_PROGRAM);
  broken->setSource("#version 120\nvoid main() { this is no shader; }\n");
  const Ogre::MaterialPtr material =
      Ogre::MaterialManager::getSingleton().getByName("vest_viz/Tissue", kOgreGroup);
  Ogre::Pass* const pass = material->getTechnique(0)->getPass(0);
  const std::string good = pass->getFragmentProgramName();
  pass->setFragmentProgram(broken->getName());
  material->load();
  load(sheet("uterus"));
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  const cv::Scalar colour = colourAt(picture(X_WO), X_WO, {0, 0, 0}, 30);
  EXPECT_FALSE(view.scene().warning().empty());
  EXPECT_GT(colour[0] + colour[1] + colour[2], 60) << "not black";
  pass->setFragmentProgram(good);
  material->load();
  programs.remove(broken);
}

TEST(Render, BagBecomesPicturesVideoAndGroundTruthOfTheWishedSize) {
  const std::string folder = testing::TempDir() + "vest_render_" + std::to_string(getpid()),
                    file = folder + "/session.bag";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  {
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    vest_msgs::TissueTopology topology = sheet("uterus");
    topology.header.frame_id = "world";
    bag.write("/vest/tissue/topology", ros::Time(100), topology);
    for (int i = 0; i < 30; ++i) {
      vest_msgs::TissueState state;
      state.revision = 1;
      state.step = static_cast<std::uint64_t>(33 * i);
      state.positions = topology.objects[0].rest_position;
      bag.write("/vest/tissue/state", ros::Time(100 + i / 30.0), state);
      vest_msgs::InstrumentStates m;
      m.instruments.resize(2);
      m.instruments[0].name = "endoscope";
      m.instruments[0].tool = vest_msgs::InstrumentState::TOOL_ENDOSCOPE;
      m.instruments[0].tip.position.z = 0.06;
      m.instruments[0].tip.orientation.x = 1;  // z down
      m.instruments[1] = m.instruments[0];
      m.instruments[1].name = "left";
      m.instruments[1].tool = vest_msgs::InstrumentState::TOOL_GRASPER;
      m.instruments[1].tip.position.z = 0.01;
      // z from the trocar towards the tip: straight down the shaft would stand in front of the lens.
      m.instruments[1].tip.orientation = geometry_msgs::Quaternion();
      const double half = 0.5 * std::atan2(0.1, -0.09);
      m.instruments[1].tip.orientation.y = std::sin(half),
      m.instruments[1].tip.orientation.w = std::cos(half);
      m.instruments[1].shaft.position.x = -0.1, m.instruments[1].shaft.position.z = 0.1;
      bag.write("/vest/instruments", ros::Time(100 + i / 30.0), m);
    }
  }
  const std::string run = std::string(VEST_RENDER) + " " + file + " --output " + folder + " --video " +
                          folder +
                          "/session.avi --width 400 --height 320 --fps 5 --truth --optic 0 > /dev/null";
  ASSERT_EQ(std::system(run.c_str()), 0) << run;
  const cv::Mat picture = cv::imread(folder + "/frame_000002.png");
  ASSERT_EQ(picture.size(), cv::Size(400, 320));
  EXPECT_GT(cv::mean(picture(cv::Rect(180, 140, 40, 40)))[2], 40) << "lit tissue in the middle";
  EXPECT_FALSE(cv::imread(folder + "/frame_000004.png").empty()) << "1 s at 5 pictures a second";
  const cv::Mat depth = cv::imread(folder + "/depth_000002.tiff", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_32F);
  EXPECT_NEAR(depth.at<float>(200, 250), 0.06, 0.001);
  const cv::Mat labels = cv::imread(folder + "/segmentation_000002.png", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(labels.type(), CV_16U);
  EXPECT_EQ(labels.at<std::uint16_t>(200, 250), 1);
  cv::VideoCapture video(folder + "/session.avi");
  cv::Mat frame;
  int frames = 0;
  while (video.read(frame)) ++frames;
  EXPECT_GE(frames, 5);
  EXPECT_EQ(frame.empty() ? 400 : frame.cols, 400);
  std::ifstream points(folder + "/keypoints.csv");
  const std::string text((std::istreambuf_iterator<char>(points)), {});
  EXPECT_NE(text.find("left,tip"), std::string::npos);
  EXPECT_NE(std::system((std::string(VEST_RENDER) + " " + file + " > /dev/null 2>&1").c_str()), 0)
      << "neither --output nor --video";
  std::filesystem::remove_all(folder);
}

TEST_F(Offscreen, AMillionVerticesAreDrawn) {
  std::printf("count: 1000000 of 1000000 vertices\n");
  load(sheet("uterus", 1000));
  ASSERT_GT(store.skin(0).vertexCount(), 1000000u);
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  const cv::Scalar c = colourAt(picture(X_WO), X_WO, {0, 0, 0}, 40);
  EXPECT_GT(c[0], 60);
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  // Those that draw for minutes in software: with `./test --full`.
  if (std::getenv("VEST_FULL") == nullptr && testing::GTEST_FLAG(filter) == "*")
    testing::GTEST_FLAG(filter) = "-*EveryLevel*:*Million*";
  return RUN_ALL_TESTS();
}
