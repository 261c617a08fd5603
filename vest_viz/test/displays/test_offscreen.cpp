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
#include "offscreen.h"
#include "ogre_assets.h"
#include "scene_messages.h"
#include "sheet.h"
#include "truth_output.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_viz/camera/board.h"

namespace vest::displays {
namespace {

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

  /// What vest_calibrate_camera writes of these pictures, and one without a board, and the view reads.
  static camera::Intrinsics byProgram(std::vector<cv::Mat> pictures) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::path(testing::TempDir()) / ("vest_calibration_" + std::to_string(::getpid()));
    fs::create_directories(folder);
    pictures.push_back(cv::Mat(pictures[0].size(), CV_8UC3, cv::Scalar::all(90)));
    std::string files;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      files += " shot_" + std::to_string(i) + ".png";
      cv::imwrite((folder / ("shot_" + std::to_string(i) + ".png")).string(), pictures[i]);
    }
    const std::string program = fs::read_symlink("/proc/self/exe").parent_path() / "vest_calibrate_camera";
    EXPECT_EQ(std::system(("cd '" + folder.string() + "' && '" + program + "'" + files +
                           " --columns 10 --rows 8 --square 5.5 --output endoscope.yaml")
                              .c_str()),
              0);
    const camera::Intrinsics is = camera::readCalibration((folder / "endoscope.yaml").string());
    fs::remove_all(folder);
    return is;
  }

  /// Draws `views` pictures with `resolution` pixels per pixel, and lets OpenCV find the camera in them.
  void calibrate(int views, double resolution) {
    load(tools::chessboard(kColumns, kRows, kSquare));
    EXPECT_TRUE(view.scene().warning().empty()) << view.scene().warning();
    view.setCamera(sampleCamera(), 1.0, resolution);
    view.setFixedGain(6.0);
    const camera::Intrinsics camera = sampleCamera();
    std::vector<cv::Mat> pictures;
    for (int i = 0; i < views; ++i) pictures.push_back(picture(place(i)));
    const camera::BoardCalibration board = camera::calibrate(pictures, {kColumns, kRows, kSquare});
    ASSERT_GE(static_cast<int>(board.corners.size()), views - views / 8) << "the board must be found";
    Eigen::Vector2d shift(0, 0);  // sum, of what was found against where the published camera has it
    std::size_t seen = 0;
    for (int i = 0; i < views; ++i) {
      if (!board.found[static_cast<std::size_t>(i)]) continue;
      const cv::Point2f found = board.corners[seen++][31];
      const Vector3d middle =
          place(i).inverse() * Vector3d((1 + 31 % (kColumns - 1) - 0.5 * kColumns) * kSquare,
                                        (1 + 31 / (kColumns - 1) - 0.5 * kRows) * kSquare, 0);
      const Eigen::Vector2d wanted =
          camera::project(camera, {middle.x() / middle.z(), middle.y() / middle.z()});
      shift += Eigen::Vector2d(found.x, found.y) - wanted;
    }
    shift /= static_cast<double>(seen);
    const camera::Intrinsics is = byProgram(pictures);
    std::printf(
        "fx %.2f fy %.2f cx %.2f cy %.2f k1 %.4f k2 %.4f, %.3f px, middle off by %.3f %.3f px in %zu views\n",
        is.fx, is.fy, is.cx, is.cy, is.distortion[0], is.distortion[1], board.error, shift.x(), shift.y(),
        seen);
    EXPECT_EQ(is.width, 720u);
    EXPECT_EQ(is.height, 576u);
    EXPECT_LT(board.error, 0.3) << "pixels";
    EXPECT_LT(shift.norm(), 0.15) << "half a pixel would be a mistake of the pixels' centres";
    EXPECT_NEAR(is.fx, camera.fx, 0.01 * camera.fx);
    EXPECT_NEAR(is.fy, camera.fy, 0.01 * camera.fy);
    EXPECT_NEAR(is.cx, camera.cx, 0.01 * camera.cx);
    EXPECT_NEAR(is.cy, camera.cy, 0.01 * camera.cy);
    // Of the distortion it is its effect that counts: 1 % of the distance from the middle, at the border.
    const double r2 = 0.56 * 0.56, said = -0.18 * r2 + 0.03 * r2 * r2;
    EXPECT_NEAR(is.distortion[0] * r2 + is.distortion[1] * r2 * r2, said, 0.01);
  }
};

TEST_F(Chessboard, CalibrationByOpenCvGivesTheCamerasParametersBack) {
  calibrate(16, 1.0);
}

TEST_F(Chessboard, AnEquidistantPictureAgreesWithItsCalibration) {
  load(tools::chessboard(kColumns, kRows, kSquare));
  camera::Intrinsics camera = sampleCamera();
  camera.model = camera::Distortion::Equidistant;
  camera.distortion = {0.05, -0.02, 0.004, 0, 0};
  view.setCamera(camera, 1.0, 1.0);
  view.setFixedGain(6.0);
  int boards = 0;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Isometry3d X_WO = place(i);
    cv::Mat grey;
    cv::cvtColor(picture(X_WO), grey, cv::COLOR_RGB2GRAY);
    std::vector<cv::Point2f> found;
    if (!cv::findChessboardCornersSB(grey, {kColumns - 1, kRows - 1}, found, cv::CALIB_CB_ACCURACY)) continue;
    ++boards;
    double sum = 0;
    int corners = 0;
    for (int r = 1; r < kRows; ++r)
      for (int c = 1; c < kColumns; ++c, ++corners) {
        const Vector3d p =
            X_WO.inverse() * Vector3d((c - 0.5 * kColumns) * kSquare, (r - 0.5 * kRows) * kSquare, 0);
        const Eigen::Vector2d wanted = camera::project(camera, {p.x() / p.z(), p.y() / p.z()});
        double nearest = 1e9;  // squares are some 40 pixels wide: it is the same corner
        for (const cv::Point2f& corner : found)
          nearest = std::min(nearest, (Eigen::Vector2d(corner.x, corner.y) - wanted).squaredNorm());
        sum += nearest;
      }
    EXPECT_LT(std::sqrt(sum / corners), 0.4) << "pixels, root mean square";
  }
  EXPECT_GE(boards, 3);
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

// Protects coagulated tissue from white paint: it has lost its water, so it mirrors no lamp, and no exposure
// makes it as bright as the lamp's image.
TEST_F(Offscreen, CoagulatedTissueIsDryAndMirrorsNoLamp) {
  load(sheet("liver"));
  const auto white = [&](double gain) {
    view.setFixedGain(gain);
    cv::Mat least;
    cv::extractChannel(picture(fromAbove(0.05)), least, 2);
    return cv::countNonZero(least > 245);
  };
  const int wet = white(1);
  mark(vest_msgs::TissueField::DAMAGE, 1, 0, 0.1);
  EXPECT_GT(wet, 300) << "pixels";
  for (const double gain : {1, 4, 8}) EXPECT_LT(white(gain), 10) << gain;
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

TEST_F(Offscreen, LightFallsOffWithDistanceAndTheExposureMakesUpForIt) {
  load(sheet("uterus"));
  view.setFixedGain(0.3);  // far from white
  const auto brightness = [&](double height, int pictures) {
    cv::Mat rgb;
    for (int k = 0; k < pictures; ++k) rgb = picture(fromAbove(height));
    const cv::Scalar c = colourAt(rgb, fromAbove(height), {0.3 * height, 0.2 * height, 0}, 25);
    return c[0] + c[1] + c[2];
  };
  // The sheet fills the round picture up to 5 cm.
  const double near = brightness(0.03, 1), middle = brightness(0.04, 1), far = brightness(0.05, 1);
  EXPECT_GT(near, 1.08 * middle);
  EXPECT_GT(middle, 1.08 * far);
  view.setFixedGain(0);
  const double bright = brightness(0.03, 40), same = brightness(0.05, 40);
  EXPECT_LT(std::fabs(bright / same - 1), 0.5 * (near / far - 1));
}

// Protects that blood lies in the same light as tissue: pools kept the light of a constant, however the
// camera exposed. And that what they and films mirror moves while nobody moves: waves run over them, and a
// slope lets films run.
TEST_F(Offscreen, PoolsAndFilmsAreExposedAndTheirReflectionsMove) {
  load(sheet("uterus"));
  const Eigen::Isometry3d X_WO = fromAbove(0.05);
  auto fluid = boost::make_shared<vest_msgs::FluidState>();
  vest_msgs::FluidPool pool;
  pool.origin.orientation.w = 1;
  pool.origin.position.x = pool.origin.position.y = -0.024, pool.origin.position.z = 0.002;
  pool.cell = 0.002, pool.columns = pool.rows = 24;
  pool.height.assign(576, 0.0f), pool.depth.assign(576, 30), pool.blood.assign(576, 255);
  fluid->pools = {pool};
  const auto at = [&](double seconds, double gain) {
    fluid->header.stamp.fromSec(seconds);
    view.setFixedGain(gain);
    view.setFluid(boost::make_shared<vest_msgs::FluidState>(*fluid));
    static_cast<void>(picture(X_WO));
    return picture(X_WO);
  };
  const auto red = [&](const cv::Mat& rgb) { return colourAt(rgb, X_WO, {-0.008, 0.008, 0}, 30)[0]; };
  EXPECT_GT(red(at(1, 1.2)), 1.3 * red(at(1, 0.3))) << "four times the light";
  const auto moved = [&](const cv::Mat& a, const cv::Mat& b) {
    cv::Mat difference;
    cv::absdiff(a, b, difference);
    cv::extractChannel(difference, difference, 1);
    return cv::countNonZero(difference > 40);
  };
  EXPECT_EQ(moved(at(1, 1), at(1, 1)), 0);
  EXPECT_GT(moved(at(1, 1), at(1.4, 1)), 100) << "pool";
  fluid->pools.clear();
  vest_msgs::FluidFilm& film = fluid->film;
  film.origin = pool.origin, film.origin.position.z = 0.0005;
  film.cell = pool.cell, film.columns = pool.columns, film.rows = pool.rows;
  for (int k = 0; k < 576; ++k) film.height.push_back(0.0012f * static_cast<float>(k % 24));
  film.thickness.assign(576, 120), film.set.assign(576, 0);
  EXPECT_GT(moved(at(1, 1), at(1.4, 1)), 30) << "film that runs";
  film.set.assign(576, 255);
  EXPECT_LT(moved(at(1, 1), at(1.4, 1)), 10) << "and set";
}

// Protects drops of blood from being black beads before the blood they fall into.
TEST_F(Offscreen, ADropOfBloodIsAsRedAsThePoolBelowIt) {
  load(sheet("uterus"));
  const Eigen::Isometry3d X_WO = fromAbove(0.06);
  auto fluid = boost::make_shared<vest_msgs::FluidState>();
  vest_msgs::FluidPool pool;
  pool.origin.orientation.w = 1;
  pool.origin.position.x = pool.origin.position.y = -0.024, pool.origin.position.z = 0.002;
  pool.cell = 0.002, pool.columns = pool.rows = 24;
  pool.height.assign(576, 0.0f), pool.depth.assign(576, 20), pool.blood.assign(576, 255);
  fluid->pools = {pool};
  const Vector3d place(0.006, 0.008, 0.006);
  const auto red = [&] {
    view.setFluid(boost::make_shared<vest_msgs::FluidState>(*fluid));
    return colourAt(picture(X_WO), X_WO, place, 4)[0];
  };
  view.setFixedGain(0);
  for (int k = 0; k < 80; ++k) static_cast<void>(red());  // until it is exposed
  const double below = red();
  fluid->particle_radius = 0.0015f;  // m, as of a session
  for (const double x : {place.x(), place.y(), place.z()}) fluid->positions.push_back(static_cast<float>(x));
  fluid->velocities = {0, 0, 0};
  fluid->blood_fraction = {255};
  EXPECT_GT(red(), 0.75 * below);
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

/// A recorded session of a second: a sheet that moves to the right below an endoscope, and a grasper that
/// moves before it. Instruments come four times as often as states.
class Render : public testing::Test {
 protected:
  static inline std::string folder;
  static double sheetAt(double t) { return 0.015 * t; }
  static Vector3d tipAt(double t) { return {0.01 * t, 0.006 * t, 0.01}; }

  static void SetUpTestSuite() {
    folder = testing::TempDir() + "vest_render_" + std::to_string(getpid());
    std::filesystem::create_directories(folder);
    rosbag::Bag bag(folder + "/session.bag", rosbag::bagmode::Write);
    const vest_msgs::TissueTopology topology = sheet("uterus");
    bag.write("/vest/tissue/topology", ros::Time(100), topology);
    for (int i = 0; i < 120; ++i) {
      const double t = i / 120.0;
      const ros::Time stamp(100 + t);
      vest_msgs::InstrumentStates m;
      m.header.stamp = stamp;
      m.instruments.resize(2);
      m.instruments[0].name = "endoscope";
      m.instruments[0].tool = vest_msgs::InstrumentState::TOOL_ENDOSCOPE;
      m.instruments[0].tip.position.z = 0.06;
      m.instruments[0].tip.orientation.x = 1;  // z down
      m.instruments[1] = m.instruments[0];
      m.instruments[1].name = "left";
      m.instruments[1].tool = vest_msgs::InstrumentState::TOOL_GRASPER;
      m.instruments[1].tip.position.x = tipAt(t).x(), m.instruments[1].tip.position.y = tipAt(t).y();
      m.instruments[1].tip.position.z = tipAt(t).z();
      // z from the trocar towards the tip: straight down the shaft would stand in front of the lens.
      m.instruments[1].tip.orientation = geometry_msgs::Quaternion();
      const double half = 0.5 * std::atan2(0.1, -0.09);
      m.instruments[1].tip.orientation.y = std::sin(half),
      m.instruments[1].tip.orientation.w = std::cos(half);
      m.instruments[1].shaft.position.x = -0.1, m.instruments[1].shaft.position.z = 0.1;
      bag.write("/vest/instruments", stamp, m);
      if (i % 4 != 0) continue;
      vest_msgs::TissueState state;
      state.header.stamp = stamp;
      state.revision = 1;
      state.step = static_cast<std::uint64_t>(1000 * i) / 120;
      state.positions = topology.objects[0].rest_position;
      for (std::size_t k = 0; k < state.positions.size(); k += 3)
        state.positions[k] += static_cast<float>(sheetAt(t));
      // Told a few ms later, as in a session.
      bag.write("/vest/tissue/state", stamp + ros::Duration(0.02), state);
    }
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder); }

  static int run(const std::string& words) {
    return std::system(
        (std::string(VEST_RENDER) + " " + folder + "/session.bag " + words + " > /dev/null 2>&1").c_str());
  }
  static cv::Mat flowOf(const std::string& path, int width, int height) {
    std::ifstream in(path, std::ios::binary);
    cv::Mat flow(height, width, CV_32FC2);
    in.ignore(12);
    in.read(reinterpret_cast<char*>(flow.data), static_cast<std::streamsize>(flow.total() * 8));
    return in ? flow : cv::Mat();
  }
};

TEST_F(Render, BagBecomesPicturesVideoAndGroundTruthOfTheWishedSize) {
  ASSERT_EQ(run("--output " + folder + " --video " + folder +
                "/session.avi --width 400 --height 320 --fps 5 --truth"),
            0);
  const cv::Mat picture = cv::imread(folder + "/frame_000002.png");
  ASSERT_EQ(picture.size(), cv::Size(400, 320));
  EXPECT_GT(cv::mean(picture(cv::Rect(180, 140, 40, 40)))[2], 40) << "lit tissue in the middle";
  EXPECT_FALSE(cv::imread(folder + "/frame_000004.png").empty()) << "1 s at 5 pictures a second";
  cv::VideoCapture video(folder + "/session.avi");
  cv::Mat frame;
  int frames = 0;
  while (video.read(frame)) ++frames;
  EXPECT_GE(frames, 5);
  EXPECT_EQ(frame.empty() ? 400 : frame.cols, 400);

  // Keypoints lie where the instrument was at the step of the picture.
  const camera::Intrinsics camera =
      camera::fromFieldOfView(400, 320, 70 * M_PI / 180, {-0.18, 0.03, 0, 0, 0});
  const auto pixel = [&](const Vector3d& p) {
    const Vector3d q = fromAbove(0.06).inverse() * p;
    return camera::project(camera, {q.x() / q.z(), q.y() / q.z()});
  };
  std::ifstream points(folder + "/keypoints.csv");
  std::vector<double> time;  // s, of each picture
  std::string line;
  std::getline(points, line);
  while (std::getline(points, line)) {
    int number = 0;
    unsigned long step = 0;
    char name[32] = "", u[32] = "", v[32] = "", depth[32] = "";
    ASSERT_EQ(std::sscanf(line.c_str(), "%d,%lu,left,%31[^,],%31[^,],%31[^,],%31[^,]", &number, &step, name,
                          u, v, depth),
              6)
        << line;
    time.resize(static_cast<std::size_t>(number) + 1, std::round(static_cast<double>(step) * 0.03) / 30);
    if (std::string(name) != "tip") continue;
    const Vector3d tip = tipAt(time.back());
    EXPECT_NEAR(std::atof(u), pixel(tip).x(), 0.1) << line;
    EXPECT_NEAR(std::atof(v), pixel(tip).y(), 0.1) << line;
    EXPECT_NEAR(std::atof(depth), 0.05, 1e-4);
  }
  ASSERT_GE(time.size(), 5u);
  for (std::size_t k = 1; k < 5; ++k) {
    const std::string end = "_00000" + std::to_string(k) + ".";
    const cv::Mat depth = cv::imread(folder + "/depth" + end + "tiff", cv::IMREAD_UNCHANGED);
    const cv::Mat labels = cv::imread(folder + "/segmentation" + end + "png", cv::IMREAD_UNCHANGED);
    const cv::Mat flow = flowOf(folder + "/flow" + end + "flo", 400, 320);
    ASSERT_EQ(depth.type(), CV_32F);
    ASSERT_EQ(labels.type(), CV_16U);
    ASSERT_FALSE(flow.empty());
    int seen = 0;
    for (int v = 60; v < 260; v += 17)
      for (int u = 120; u < 300; u += 13) {
        if (labels.at<std::uint16_t>(v, u) != 1) continue;
        ++seen;
        EXPECT_NEAR(depth.at<float>(v, u), 0.06, 0.005 * 0.06);
        const Eigen::Vector2d n = camera::unproject(camera, {double(u), double(v)});
        const Vector3d p = fromAbove(0.06) * Vector3d(0.06 * n.x(), 0.06 * n.y(), 0.06);
        const Eigen::Vector2d was = pixel(p - Vector3d(sheetAt(time[k]) - sheetAt(time[k - 1]), 0, 0));
        EXPECT_NEAR(flow.at<cv::Vec2f>(v, u)[0], u - was.x(), 0.05);
        EXPECT_NEAR(flow.at<cv::Vec2f>(v, u)[1], v - was.y(), 0.05);
      }
    EXPECT_GT(seen, 80);
    EXPECT_GT(time[k], time[k - 1] + 0.1) << "it moves by more than ten pixels";
  }
  EXPECT_NE(run(""), 0) << "neither --output nor --video";
}

TEST_F(Render, AnySizeIsDrawn) {
  for (const cv::Size size :
       {cv::Size(320, 256), cv::Size(321, 257), cv::Size(1280, 720), cv::Size(1920, 1080)}) {
    SCOPED_TRACE(size.width);
    const std::string video = folder + "/size.mp4";
    ASSERT_EQ(run("--fps 10 --to 0.15 --output " + folder + "/size --video " + video + " --width " +
                  std::to_string(size.width) + " --height " + std::to_string(size.height)),
              0);
    const cv::Mat picture = cv::imread(folder + "/size/frame_000001.png");
    ASSERT_EQ(picture.size(), size);
    cv::Mat middle, corner;
    EXPECT_GT(cv::mean(picture(cv::Rect(size.width / 2 - 30, size.height / 2 - 30, 20, 20)))[2], 40);
    EXPECT_EQ(cv::sum(picture(cv::Rect(0, 0, size.width / 20, size.height / 20))), cv::Scalar::all(0))
        << "black outside of the circle";
    cv::VideoCapture film(video);
    cv::Mat frame;
    ASSERT_TRUE(film.read(frame));
    EXPECT_LE(std::abs(frame.cols - size.width) + std::abs(frame.rows - size.height), 2)
        << "a video format may want even sizes";
    cv::resize(frame, frame, size);
    EXPECT_LT(cv::norm(frame, cv::imread(folder + "/size/frame_000000.png"), cv::NORM_L1),
              4.0 * 3 * static_cast<double>(size.area()))
        << "the same picture";
    std::filesystem::remove_all(folder + "/size");
  }
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
