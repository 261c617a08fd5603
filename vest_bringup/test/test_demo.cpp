#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <ros/package.h>

#include "play.h"
#include "vest_bringup/simulation/rehearsal.h"
#include "vest_bringup/simulation/trainer.h"

// Protects the demo of ./run: the scripted trainee takes a uterine tube, pulls it visibly, and lets it go.

namespace vest::simulation {
namespace {

const char* const kDemo = "/trajectories/demo.yaml";
constexpr double kFirstAct = 20.0;  ///< s: grasp and pull; behind it clip, cut, coagulation, bleeding

kinematics::TrainerBox box() {
  return kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml");
}

/// Where a point lies in the picture, pinhole with 70 degrees over 720 pixels: distance
/// from the middle over the radius of the round picture (288 pixels). More than 1, or behind the lens: not
/// seen.
double inPicture(const scene::ToolInput& endoscope, const Eigen::Vector3d& point) {
  const auto optic = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), endoscope.sight);
  const Eigen::Vector3d p = (endoscope.orientation * optic).inverse() * (point - endoscope.position);
  const double focal = 360.0 / std::tan(35.0 * M_PI / 180.0);
  return p.z() > 0 ? focal * p.head<2>().norm() / p.z() / 288.0 : 1e9;
}

/// The demo played once, step by step.
class DemoTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    using tools::ToolKind;
    const auto layout = box();
    const auto trajectory = trajectory::fromWaypoints(ros::package::getPath("vest_bringup") + kDemo, layout);
    scene::World world(
        scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml"), 2);
    const std::array<ToolKind, tools::kInstrumentCount> tool{ToolKind::Grasper, ToolKind::Grasper,
                                                             ToolKind::None, ToolKind::Endoscope};
    const auto knots = [&](std::size_t object) {
      std::vector<float> xyz(3 * world.knotCount(object));
      world.positions(object, xyz.data());
      return xyz;
    };
    std::vector<std::vector<float>> start;
    for (std::size_t i = 0; i < world.objectCount(); ++i) start.push_back(knots(i));
    const auto displacement = [&](std::size_t object) {
      const auto now = knots(object);
      double far = 0;
      for (std::size_t i = 0; i + 2 < now.size(); i += 3) {
        far = std::max<double>(far, (Eigen::Map<const Eigen::Vector3f>(&now[i]) -
                                     Eigen::Map<const Eigen::Vector3f>(&start[object][i]))
                                        .norm());
      }
      return far;
    };
    scene::StepReport report;
    std::array<Eigen::Vector3d, 2> force{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    std::array<Eigen::Vector3d, 4> before;
    before.fill(Eigen::Vector3d::Zero());
    const double dt = world.description().dt;
    for (std::uint64_t k = 0; static_cast<double>(k) * dt < kFirstAct; ++k) {
      const double t = static_cast<double>(k) * dt;
      scene::StepInput input = inputAt(layout, trajectory, tool, t);
      input.step = k + 1;
      input.dt = dt;
      worst_ = std::max(worst_, world.step(input, report));
      for (const scene::Event& e : report.events) {
        if (world.description().objects[e.object].name.rfind("tube", 0) != 0) continue;
        if (e.kind == scene::EventKind::Grasped && grasped_ < 0) {
          grasped_ = t;
          tube_ = e.object;
        }
        if (e.kind == scene::EventKind::Released && grasped_ >= 0) released_ = t;
        slipped_ = slipped_ || e.kind == scene::EventKind::Slipped;
      }
      for (std::size_t i = 0; i < 2; ++i) {
        const Eigen::Vector3d now = report.contacts[i].wrench.head<3>();
        force_ = std::max(force_, now.norm());
        jump_ = std::max(jump_, (now - force[i]).norm());
        force[i] = now;
        seen_[i] += inPicture(input.tools[3], input.tools[i].position) < 1.0;
      }
      ++steps_;
      if (k % 10 != 0) continue;
      for (const std::size_t i : {0, 1, 3}) {
        if (k > 0) speed_ = std::max(speed_, (input.tools[i].position - before[i]).norm() / (10 * dt));
        before[i] = input.tools[i].position;
      }
      if (grasped_ >= 0 && released_ < 0) held_ = std::max(held_, displacement(tube_));
      if (released_ >= 0 && t >= released_ + 1.5) residual_ = std::max(residual_, displacement(tube_));
    }
  }

  static inline scene::Status worst_ = scene::Status::Ok;
  static inline double grasped_ = -1, released_ = -1;  ///< s
  static inline std::size_t tube_ = 0;
  static inline bool slipped_ = false;
  static inline double held_ = 0, residual_ = -1;  ///< m
  static inline double force_ = 0, jump_ = 0;      ///< N
  static inline double speed_ = 0;                 ///< m/s
  static inline std::array<int, 2> seen_{};        ///< steps with the tip in the picture
  static inline int steps_ = 0;
};

TEST_F(DemoTest, TheGrasperTakesAUterineTubePullsItVisiblyAndLetsGo) {
  EXPECT_NE(worst_, scene::Status::Fault);
  ASSERT_GE(grasped_, 0.0);
  ASSERT_GT(released_, grasped_ + 5.0) << "held long enough to be seen";
  EXPECT_FALSE(slipped_);
  EXPECT_GE(held_, 0.015);
  EXPECT_LE(held_, 0.040) << "pulled, not torn away";
}

TEST_F(DemoTest, TheTubeComesBackAfterRelease) {
  ASSERT_GE(residual_, 0.0) << "the demo ends at least 1.5 s after the release";
  EXPECT_LE(residual_, 0.002);
}

TEST_F(DemoTest, ForcesAreThoseOfACarefulHandAndRiseSmoothly) {
  EXPECT_GE(force_, 0.1);
  EXPECT_LE(force_, 1.2) << "N; above, a tube would be pulled inside out";
  EXPECT_LE(jump_, 0.3) << "N between two steps";
}

TEST_F(DemoTest, BothInstrumentsAreInThePictureAndMoveLikeAHand) {
  for (const int seen : seen_) EXPECT_GE(seen, steps_ * 95 / 100);
  EXPECT_LE(speed_, 0.08);
  EXPECT_GE(speed_, 0.01);
}

/// Fluid of the pools in a rectangle seen from above, m³.
struct Pooled {
  double volume = 0, blood = 0;
};

// Protects the rest of the demo: a clip on the tube, a cut beside it, the stump coagulated, the ovarian
// artery cut, and clips on it, in this order and by the right hand; then water washes and suction clears.
// Without a fault and with forces of a careful hand. One play for all, with every effect.
class DemoLaterActs : public ::testing::Test {
 protected:
  static Pooled pooled(double x0, double x1, double y0, double y1) {
    const fluid::Model& m = play_->stage.field->fluidModel();
    const fluid::Pools& w = play_->stage.field->fluid().pools;
    const double cell = m.parameters.pool_cell;
    Pooled sum;
    for (int r = 0; r < m.rows; ++r) {
      for (int c = 0; c < m.columns; ++c) {
        const double x = m.parameters.low[0] + (c + 0.5) * cell, y = m.parameters.low[1] + (r + 0.5) * cell;
        const std::size_t i = static_cast<std::size_t>(r * m.columns + c);
        if (x < x0 || x > x1 || y < y0 || y > y1) continue;
        sum.volume += cell * cell * static_cast<double>(w.depth[i]);
        sum.blood += cell * cell * static_cast<double>(w.blood[i]);
      }
    }
    return sum;
  }
  static Pooled everywhere() { return pooled(-1, 1, -1, 1); }
  static Pooled pouch() { return pooled(-0.06, 0.06, 0.005, 0.065); }  ///< before the uterus, where it dips

  static void SetUpTestSuite() {
    play_ = std::make_unique<Play>("gynaecology", true, "demo");
    Play& p = *play_;
    p.run([&](double t, const scene::StepInput& input, const scene::StepReport&) {
      if (at(t, 44.0)) before_cut_ = lost(p.stage);
      if (t > 46.0 && t < 49.0)
        least_ = std::min(least_, leak(p.stage)), most_ = std::max(most_, leak(p.stage));
      if (at(t, 50.0)) before_clips_ = lost(p.stage);
      if (at(t, 56.0)) after_clips_ = lost(p.stage);
      if (at(t, 57.9)) end_ = lost(p.stage);
      if (at(t, kTaken)) p.stage.trainer->save(snapshot_);
      if (t > kTaken + 5e-4 && inputs_.size() < kAgain) inputs_.push_back(input);
      if (inputs_.size() == kAgain && hash_ == 0)
        hash_ = p.world().stateHash(), effects_hash_ = p.stage.trainer->effectsHash().value();
      if (at(t, 60.7)) bloody_ = everywhere();
      if (at(t, 62.55))
        washed_ = everywhere(), filled_ = pouch(), sucked_before_ = p.stage.field->fluid().sucked;
      if (at(t, 68.0)) cleared_ = everywhere(), emptied_ = pouch();
    });
  }
  static void TearDownTestSuite() { play_.reset(); }

  static constexpr double kTaken = 59.0;      ///< s: after cuts, heat, clips and bleeding
  static constexpr std::size_t kAgain = 300;  ///< steps
  static inline std::unique_ptr<Play> play_;
  static inline double before_cut_ = -1, least_ = 1e9, most_ = 0, before_clips_ = 0, after_clips_ = 0,
                       end_ = 0;
  static inline Pooled bloody_, washed_, filled_, cleared_, emptied_;
  static inline double sucked_before_ = -1;
  static inline std::vector<std::uint8_t> snapshot_;
  static inline std::vector<scene::StepInput> inputs_;
  static inline std::uint64_t hash_ = 0, effects_hash_ = 0;
};

TEST_F(DemoLaterActs, ClipsCutsCoagulatesAndTheCutArterySpurtsWithThePulseUntilTwoClipsStopIt) {
  using scene::EventKind;
  const Play& p = *play_;
  const double clip = p.first(EventKind::Clipped, "tube_right"), cut = p.first(EventKind::Cut, "tube_right");
  EXPECT_GT(clip, kFirstAct);
  EXPECT_GT(cut, clip);
  EXPECT_GT(p.first(EventKind::Coagulated, "tube_right"), cut);
  const double through = p.first(EventKind::Separated, "ovarian_artery_right");
  EXPECT_GT(through, p.first(EventKind::Coagulated, "tube_right"));
  EXPECT_LT(through, 46.0) << "cut through, not nicked";
  EXPECT_EQ(p.times(EventKind::Clipped, "ovarian_artery_right").size(), 2U);
  EXPECT_TRUE(p.times(EventKind::Cut, "iliac_artery_right").empty() &&
              p.times(EventKind::Cut, "iliac_vein_right").empty())
      << "nothing beside it is cut";
  EXPECT_LT(before_cut_, 1e-8) << "m³: the tube's cut seeps, no vessel is open";
  EXPECT_GT(most_, 1.1 * least_) << "in step with the pulse: pressure of 120 over 80 alone makes 1.2";
  EXPECT_GT(before_clips_, 2e-6) << "m³: the loss counts up";
  EXPECT_LT(end_ - after_clips_, 0.01 * (after_clips_ - before_cut_)) << "the clips stop it";
  EXPECT_LT(p.report.greatest_force, 2.0) << "N";
  std::printf("leak %.3f to %.3f ml/s, lost %.2f ml, after the clips %.4f ml\n", 1e6 * least_, 1e6 * most_,
              1e6 * after_clips_, 1e6 * (end_ - after_clips_));
}

TEST_F(DemoLaterActs, IrrigationWashesTheBloodAndSuctionClearsThePouch) {
  const fluid::State& f = play_->stage.field->fluid();
  const auto share = [](const Pooled& p) { return p.blood / p.volume; };
  EXPECT_GT(bloody_.volume, 1e-6) << "m³; the rest lies on the organs as a film";
  EXPECT_GT(share(bloody_), 0.99) << "what lies there is blood";
  EXPECT_LT(share(washed_), 0.12) << "1.6 s of 3 l/min upon 6 ml";
  EXPECT_GT(filled_.volume, 0.5 * washed_.volume) << "it runs down to where the tip will dip";
  // The mouth lies 2.5 mm over the lowest place of the floor: what stays there is a film and what stands in
  // corners, as in the scene irrigation_pool. Elsewhere lies what ran behind the ligament and the bowel.
  EXPECT_LT(emptied_.volume, 0.1 * filled_.volume);
  EXPECT_LT(cleared_.volume, 0.5 * washed_.volume) << "most of all free fluid";
  EXPECT_GT(f.sucked - sucked_before_, 0.5 * washed_.volume) << "into the suction";
  const double there = fluid::particleVolume(play_->stage.field->fluidModel(), f) +
                       fluid::poolVolume(play_->stage.field->fluidModel(), f) + fluid::pendingVolume(f);
  EXPECT_NEAR(there + f.sucked + f.lost + f.stained + fluid::filmVolume(play_->stage.field->fluidModel(), f),
              f.emitted, 1e-3 * f.emitted)
      << "nothing vanishes";
  std::printf(
      "pools %.1f ml, %.0f %% of it blood; pouch %.1f ml, after suction %.1f ml; everywhere %.1f ml\n",
      1e6 * washed_.volume, 100 * share(washed_), 1e6 * filled_.volume, 1e6 * emptied_.volume,
      1e6 * cleared_.volume);
}

TEST_F(DemoLaterActs, EachDropThatThePatientLostIsSomewhere) {
  // From the heart to pool, film, suction and what still flies, within a thousandth over the whole session.
  const Stage& s = play_->stage;
  const fluid::State& f = s.field->fluid();
  const fluid::Model& m = s.field->fluidModel();
  double flying = 0, waiting = 0;
  for (std::size_t i = 0; i < f.particles.count; ++i)
    flying +=
        m.whole * static_cast<double>(f.particles.volume[i]) * static_cast<double>(f.particles.blood[i]);
  for (std::size_t slot = 0; slot < 128; ++slot) waiting += f.pending[slot];  // of bleeding
  const double pooled = fluid::poolBlood(m, f), films = bleeding::filmVolume(s.surface->state());
  const double ground = fluid::filmVolume(m, f);
  const double found = flying + waiting + pooled + films + ground + f.sucked_blood, left = lost(s);
  std::printf(
      "lost %.4f ml: %.4f in pools, %.4f on organs, %.4f on the ground, %.4f sucked, %.4f in the air; %+.3f "
      "%%, %.4f ml left "
      "the "
      "field\n",
      1e6 * left, 1e6 * pooled, 1e6 * films, 1e6 * ground, 1e6 * f.sucked_blood, 1e6 * (flying + waiting),
      100 * (found / left - 1), 1e6 * f.lost);
  ASSERT_GT(left, 5e-6);
  EXPECT_NEAR(found + f.lost, left, 1e-3 * left);
  EXPECT_LT(f.lost, 0.01 * left) << "behind the wall";
}

TEST_F(DemoLaterActs, FromASnapshotInItTheSameInputsGiveTheSameBits) {
  ASSERT_EQ(inputs_.size(), kAgain);
  Trainer& trainer = *play_->stage.trainer;
  trainer.restore(snapshot_);
  scene::StepReport report;
  for (scene::StepInput input : inputs_) {
    // What effects gave back is in the snapshot and comes again by itself.
    input.impacts.clear(), input.dilatations.clear(), input.loads.clear();
    input.load_over = 0;
    trainer.step(input, report);
  }
  EXPECT_EQ(trainer.world().stateHash(), hash_);
  EXPECT_EQ(trainer.effectsHash(), effects_hash_);
}

TEST(DemoMotion, ItEndsWhereItBegins) {
  const auto t = trajectory::fromWaypoints(ros::package::getPath("vest_bringup") + kDemo, box());
  for (std::size_t i = 0; i < t.moves.size(); ++i) {
    if (!t.moves[i]) continue;
    const auto &a = t.rows.front().joints[i], &b = t.rows.back().joints[i];
    EXPECT_NEAR(a.yaw, b.yaw, 1e-6);
    EXPECT_NEAR(a.pitch, b.pitch, 1e-6);
    EXPECT_NEAR(a.insertion, b.insertion, 1e-6);
    EXPECT_NEAR(a.roll, b.roll, 1e-6);
    EXPECT_NEAR(a.jaw, b.jaw, 1e-6);
  }
}

}  // namespace
}  // namespace vest::simulation
