#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include <boost/make_shared.hpp>

#include "nets.h"
#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/ros/drawn_scene.h"
#include "vest_tissue/ros/nearest_stamp.h"

// Protects what recordings and viewers rely on: nothing is lost or turned on the way into messages and back.

namespace vest::ros_shell {
namespace {

scene::Description twoObjects() {
  scene::Description d;
  d.name = "two";
  d.hash = "0123456789abcdef";
  specimen::TubeOptions o;
  o.name = "first";
  d.objects.push_back(specimen::tube(o));
  o.name = "second";
  o.rings = 9;
  o.centre = {0.0, 0.1, 0.05};
  d.objects.push_back(specimen::tube(o));
  return d;
}

template <class T>
bool sameBits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

TEST(Conversions, AStepInputComesBackBitForBit) {
  const scene::Description d = twoObjects();
  scene::StepFrame frame;
  frame.input.step = 1234567890123ULL;
  frame.input.dt = 0.001;
  frame.input.seed = 77;
  frame.command = scene::Command::Restore;
  frame.command_argument = "start";
  for (std::size_t i = 0; i < frame.input.tools.size(); ++i) {
    scene::ToolInput& t = frame.input.tools[i];
    t.present = i != 2;
    t.tool = static_cast<tools::ToolKind>(i + 1);
    t.functions = static_cast<std::uint32_t>(3 * i);
    const double k = 1.0 / (3.0 + static_cast<double>(i));
    t.position = {k, -k / 7, std::nextafter(k, 1)};
    t.orientation = Eigen::Quaterniond(0.1 + k, 0.2, 0.3 * k, 0.4);
    t.pivot = {k * k, 1e-300, -0.0};
    t.jaw = k / 3;
    t.sight = {0.0, k, std::nextafter(k, 0)};
  }
  frame.input.edits.push_back({"first", "youngs_modulus", 1.0 / 3.0});
  scene::ImpactInput impact;
  impact.object = 1;
  impact.triangle = 5;
  impact.weights = {0.25, 0.5, 0.25};
  impact.momentum = {1e-6, 2e-6, -3e-6};
  frame.input.impacts.push_back(impact);
  frame.input.loads = {{0, 3, {1e-7f, 0, -1.0f / 3}, 1e-3f, 0.1f, -0.01f},
                       {0, 9, {0, 0, -2}, 0},
                       {1, 4, {5, 6, 7}, 8, -9, 10}};
  frame.input.load_over = 0.048;
  frame.input.sunk = 1.0 / 30;
  frame.input.requests.push_back({scene::TopologyRequest::Kind::SplitKnot, 1, 12, {1.0 / 3, -2e-7, 0.0}});
  frame.input.dilatations.push_back({"uterine_left", {1.0625f, 1.03125f, 1, 0.96875f}});
  vest_msgs::StepInput msg;
  toMsg(frame, d, msg);
  EXPECT_EQ(msg.command, 3);
  EXPECT_EQ(msg.command_argument, "start");
  EXPECT_EQ(msg.impacts.at(0).object, "second");
  scene::StepInput back;
  fromMsg(msg, d, back);
  EXPECT_EQ(back.step, frame.input.step);
  EXPECT_TRUE(sameBits(back.dt, frame.input.dt));
  EXPECT_EQ(back.seed, frame.input.seed);
  for (std::size_t i = 0; i < back.tools.size(); ++i) {
    const scene::ToolInput &a = frame.input.tools[i], &b = back.tools[i];
    EXPECT_EQ(a.present, b.present);
    EXPECT_EQ(a.tool, b.tool);
    EXPECT_EQ(a.functions, b.functions);
    EXPECT_TRUE(sameBits(a.position, b.position) && sameBits(a.pivot, b.pivot) && sameBits(a.jaw, b.jaw));
    EXPECT_TRUE(sameBits(a.sight, b.sight));
    EXPECT_TRUE(sameBits(a.orientation.coeffs(), b.orientation.coeffs())) << "orientation of " << i;
  }
  ASSERT_EQ(back.edits.size(), 1U);
  EXPECT_EQ(back.edits[0].value, 1.0 / 3.0);
  ASSERT_EQ(back.impacts.size(), 1U);
  EXPECT_EQ(back.impacts[0].object, 1);
  EXPECT_EQ(back.impacts[0].momentum, impact.momentum);
  ASSERT_EQ(msg.loads.size(), 2U) << "one for each object";
  ASSERT_EQ(back.loads.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back.loads[i].object, frame.input.loads[i].object);
    EXPECT_EQ(back.loads[i].knot, frame.input.loads[i].knot);
    EXPECT_EQ(back.loads[i].force, frame.input.loads[i].force);
    EXPECT_EQ(back.loads[i].damping, frame.input.loads[i].damping);
    EXPECT_EQ(back.loads[i].stiffness, frame.input.loads[i].stiffness);
    EXPECT_EQ(back.loads[i].depth, frame.input.loads[i].depth);
  }
  EXPECT_EQ(back.load_over, 0.048);
  EXPECT_TRUE(sameBits(back.sunk, frame.input.sunk));
  ASSERT_EQ(back.dilatations.size(), 1U);
  EXPECT_EQ(back.dilatations[0].dilatation, frame.input.dilatations[0].dilatation);
}

TEST(Conversions, AStepInputThatNamesAnUnknownObjectOrToolIsRefusedByName) {
  const scene::Description d = twoObjects();
  vest_msgs::StepInput msg;
  msg.impacts.resize(1);
  msg.impacts[0].object = "spleen";
  scene::StepInput in;
  try {
    fromMsg(msg, d, in);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("spleen"), std::string::npos);
  }
  msg.impacts.clear();
  msg.loads.resize(1);
  msg.loads[0].object = "spleen";
  EXPECT_THROW(fromMsg(msg, d, in), std::invalid_argument);
  msg.loads[0].object = "first";
  msg.loads[0].knots = {3, 4}, msg.loads[0].forces = {0, 0, 1, 0, 0}, msg.loads[0].damping = {0, 0};
  EXPECT_THROW(fromMsg(msg, d, in), std::invalid_argument) << "three forces for each knot";
  msg.loads[0].forces.push_back(0), msg.loads[0].damping.pop_back();
  EXPECT_THROW(fromMsg(msg, d, in), std::invalid_argument) << "and one damping";
  msg.loads.clear();
  msg.tools[1].tool = 99;
  EXPECT_THROW(fromMsg(msg, d, in), std::invalid_argument);
}

vest_msgs::InstrumentStates oneInstrument() {
  vest_msgs::InstrumentStates msg;
  msg.instruments.resize(1);
  auto& s = msg.instruments[0];
  s.name = "right";
  s.tool = vest_msgs::InstrumentState::TOOL_GRASPER;
  s.valid = true;
  s.joint_position[4] = 0.5;
  s.tip.position.x = 0.01;
  s.tip.orientation.w = 1.0;
  s.shaft.orientation.w = 1.0;
  s.shaft.position.z = 0.2;
  return msg;
}

TEST(Conversions, AnInstrumentWhosePoseWasNeverKnownIsNotThereAndASilentOneStays) {
  scene::ToolSample sample;
  auto msg = oneInstrument();
  msg.instruments[0].valid = false;
  EXPECT_TRUE(fromMsg(msg, sample));
  EXPECT_FALSE(sample.tools[1].present);
  msg.instruments[0].valid = true;
  EXPECT_TRUE(fromMsg(msg, sample));
  EXPECT_TRUE(sample.tools[1].present);
  EXPECT_EQ(sample.tools[1].position.x(), 0.01);
  EXPECT_EQ(sample.tools[1].pivot.z(), 0.2);
  EXPECT_EQ(sample.tools[1].jaw, 0.5);
  msg.instruments[0].valid = false;
  EXPECT_TRUE(fromMsg(msg, sample));
  EXPECT_TRUE(sample.tools[1].present)
      << "an instrument in tissue must not vanish when its source falls silent";
}

TEST(Conversions, NothingIsOnThatNoMessageSaysIsOn) {
  scene::ToolSample sample;
  auto msg = oneInstrument();
  msg.instruments[0].functions = vest_msgs::InstrumentState::FUNCTION_CUT;
  ASSERT_TRUE(fromMsg(msg, sample));
  EXPECT_EQ(sample.tools[1].functions, tools::kFunctionCut);
  auto silent = msg;
  silent.instruments[0].valid = false;
  EXPECT_TRUE(fromMsg(silent, sample));
  EXPECT_EQ(sample.tools[1].functions, 0U) << "an instrument whose source is silent";
  ASSERT_TRUE(fromMsg(msg, sample));
  auto spoiled = msg;
  spoiled.instruments[0].tip.position.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(fromMsg(spoiled, sample));
  EXPECT_EQ(sample.tools[1].functions, 0U) << "an instrument whose pose is nonsense";
  ASSERT_TRUE(fromMsg(msg, sample));
  EXPECT_TRUE(fromMsg(vest_msgs::InstrumentStates(), sample));
  EXPECT_EQ(sample.tools[1].functions, 0U) << "an instrument that is not told of";
}

TEST(Conversions, APoseThatIsNotFiniteOrNotAUnitQuaternionIsRefusedAndTheLastGoodOneKept) {
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  for (const double value : bad) {
    scene::ToolSample sample;
    auto msg = oneInstrument();
    ASSERT_TRUE(fromMsg(msg, sample));
    msg.instruments[0].tip.position.y = value;
    EXPECT_FALSE(fromMsg(msg, sample));
    EXPECT_EQ(sample.tools[1].position.y(), 0.0);
  }
  scene::ToolSample sample;
  auto msg = oneInstrument();
  msg.instruments[0].tip.orientation.w = 0.0;
  EXPECT_FALSE(fromMsg(msg, sample));
  msg = oneInstrument();
  msg.instruments[0].name = "fourth";
  EXPECT_FALSE(fromMsg(msg, sample));
}

TEST(Conversions, ContactMatricesAreRowMajorAndPlanesAreThoseInUse) {
  scene::ContactFrame frame;
  frame.step = 9;
  scene::ContactModel& c = frame.contacts[2];
  c.grasping = true;
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) c.stiffness(i, k) = 10 * i + k;
  }
  c.wrench << 1, 2, 3, 4, 5, 6;
  c.plane_count = 1;
  c.planes[0] = {Eigen::Vector3d::UnitZ(), 0.25};
  vest_msgs::ContactModels msg;
  toMsg(frame, 0.002, msg);
  ASSERT_EQ(msg.contacts.size(), 4U);
  EXPECT_EQ(msg.contacts[2].instrument, "third");
  EXPECT_EQ(msg.contacts[2].stiffness[6 * 3 + 5], 35.0);
  EXPECT_EQ(msg.contacts[2].wrench.torque.x, 4.0);
  EXPECT_EQ(msg.contacts[2].age, 0.002);
  ASSERT_EQ(msg.contacts[2].planes.size(), 1U);
  EXPECT_EQ(msg.contacts[2].planes[0].offset, 0.25);
  EXPECT_TRUE(msg.contacts[0].planes.empty());
}

TEST(Conversions, TheTopologyHoldsEveryObjectWithItsKnotsInSceneOrder) {
  const scene::Description d = twoObjects();
  const scene::World world(d);
  vest_msgs::TissueTopology msg;
  toMsg(world, msg);
  ASSERT_EQ(msg.objects.size(), 2U);
  EXPECT_EQ(msg.scene_hash, d.hash);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& o = msg.objects[i];
    EXPECT_EQ(o.name, d.objects[i].name);
    EXPECT_EQ(o.knot_count, d.objects[i].rest_position.size());
    EXPECT_EQ(o.rest_position.size(), 3 * o.knot_count);
    EXPECT_EQ(o.link_knots.size(), 2 * d.objects[i].links.size());
    EXPECT_EQ(o.ring_start.size(), d.objects[i].tube.rings.size() + 1);
    EXPECT_EQ(o.ring_start.back(), o.ring_knots.size());
    EXPECT_NE(o.segmentation_label, 0) << "0 is the background";
  }
}

TEST(Conversions, ADrawnSceneIsToldAsItsWorldTellsItBeforeTheFirstStep) {
  const scene::Description d = twoObjects();
  const scene::World world(d);
  vest_msgs::TissueTopology told;
  toMsg(world, told);
  const vest_msgs::TissueTopology drawn = topologyOf(d);
  EXPECT_EQ(drawn.scene_hash, told.scene_hash);
  ASSERT_EQ(drawn.objects.size(), told.objects.size());
  for (std::size_t i = 0; i < told.objects.size(); ++i) {
    vest_msgs::TissueObject o = told.objects[i];
    o.revision = drawn.objects[i].revision;
    EXPECT_EQ(drawn.objects[i], o) << o.name;
  }
  scene::StateFrame frame;
  scene::readState(world, false, frame);
  vest_msgs::TissueState state;
  toMsg(frame, state);
  EXPECT_EQ(stateOf(d, drawn).positions, state.positions);
}

// A viewer draws the thread that tissue hangs on as it draws every thread.
TEST(Conversions, ASuspensionIsAThreadFromTheTissueToTheWall) {
  const scene::Description d = twoObjects();
  scene::StateFrame frame;
  scene::SuspensionView view;
  view.id = 7;
  view.tissue = {0.01, 0.02, 0.05};
  view.wall = {0.01, 0.02, 0.17};
  view.force = {0.0, 3.0, 4.0};
  frame.suspensions.push_back(view);
  vest_msgs::SutureStates msg;
  toMsg(frame, d, msg);
  ASSERT_EQ(msg.threads.size(), 1u);
  EXPECT_EQ(msg.threads[0].id, 0xffff0007u);
  EXPECT_GT(msg.threads[0].radius, 0.0);
  EXPECT_EQ(msg.threads[0].positions, (std::vector<float>{0.01f, 0.02f, 0.05f, 0.01f, 0.02f, 0.17f}));
  EXPECT_EQ(msg.threads[0].tension, std::vector<float>{5.0f});
}

TEST(Conversions, FieldsAreScaledToBytesWithoutWrapping) {
  scene::StateFrame frame;
  frame.positions = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
  frame.has_fields = true;
  for (std::size_t f = 0; f < frame.fields.size(); ++f) {
    frame.fields[f].kind = scene::kFieldFrames[f].kind;
    frame.fields[f].minimum = scene::kFieldFrames[f].minimum;
    frame.fields[f].maximum = std::max(scene::kFieldFrames[f].maximum, 1.0F);
  }
  frame.fields[0].values = {0.0F, 0.5F, 7.0F, std::numeric_limits<float>::quiet_NaN()};
  frame.fields[1].values = {310.15F, 373.15F, 0.0F, 2000.0F};
  vest_msgs::TissueState msg;
  toMsg(frame, msg);
  ASSERT_EQ(msg.fields.size(), 6U);
  EXPECT_EQ(msg.fields[0].kind, vest_msgs::TissueField::STRAIN);
  EXPECT_EQ(msg.fields[0].data, (std::vector<std::uint8_t>{0, 128, 255, 0}));
  EXPECT_EQ(msg.fields[1].kind, vest_msgs::TissueField::TEMPERATURE);
  EXPECT_EQ(msg.fields[1].data, (std::vector<std::uint8_t>{37, 100, 0, 255})) << "one kelvin a step";
  EXPECT_EQ(msg.fields[2].kind, vest_msgs::TissueField::DAMAGE);
  EXPECT_EQ(msg.fields[3].kind, vest_msgs::TissueField::PERFUSION);
  EXPECT_EQ(msg.fields[4].kind, vest_msgs::TissueField::CHAR);
  EXPECT_EQ(msg.fields[5].kind, vest_msgs::TissueField::STRESS);
  frame.has_fields = false;
  toMsg(frame, msg);
  EXPECT_TRUE(msg.fields.empty());
  EXPECT_EQ(msg.positions.size(), 12U);
}

TEST(NearestStamp, IsTheMessageNextToTheMomentAndTheEarlierOfTwo) {
  std::deque<vest_msgs::InstrumentStates::ConstPtr> messages;
  EXPECT_EQ(nearestStamp(messages, ros::Time(1)), nullptr);
  for (const double t : {1.0, 2.0, 4.0}) {
    const auto m = boost::make_shared<vest_msgs::InstrumentStates>();
    m->header.stamp = ros::Time(t);
    messages.push_back(m);
  }
  const std::pair<double, std::size_t> wanted[] = {{0.5, 0}, {1.0, 0}, {1.4, 0}, {1.5, 0}, {1.6, 1},
                                                   {2.0, 1}, {3.0, 1}, {3.1, 2}, {4.0, 2}, {1e9, 2}};
  for (const auto& [moment, index] : wanted)
    EXPECT_EQ(nearestStamp(messages, ros::Time(moment)), messages[index]) << moment;
}

}  // namespace
}  // namespace vest::ros_shell
