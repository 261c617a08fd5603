// A scene that is edited while it runs: what stays the same goes on, what is new begins, and nothing holds on
// to what is gone.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "slab.h"
#include "theatre.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;
using scene::EventKind;

constexpr double kJaws = 0.0435;  // m: tips about a tube at 0.05

scene::Object vessel(const std::string& name, double y, double youngs_modulus = 20e3) {
  specimen::TubeOptions o;
  o.name = name, o.radius = 0.0025, o.rings = 24, o.length = 0.07, o.mass = 0.0012;
  o.youngs_modulus = youngs_modulus, o.centre.y() = y;
  return specimen::tube(o);
}
scene::Suture thread(const std::string& name, double y) {
  scene::Suture s;
  s.strength = s.knot_strength = 40.0, s.friction = 0.2;
  s.rod.name = name;
  for (int i = 0; i <= 20; ++i) s.rod.nodes.emplace_back(0.001 * i, y, 0.05);
  s.rod.section = suture::solidSection(0.00016, 1125.0, 6e9, 0.4);
  s.rod.section.bend *= 0.05, s.rod.section.twist *= 0.05, s.rod.section.drag = 1e-4;
  return s;
}
scene::Connection tie(const scene::Description& d, std::size_t a, std::size_t b) {
  scene::Connection c;
  c.object0 = d.objects[a].name, c.object1 = d.objects[b].name;
  c.knot0 = 160, c.triangle1 = {160, 161, 168}, c.weights1 = {0.5, 0.25, 0.25};
  Vector3d anchor = Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) anchor += c.weights1[k] * d.objects[b].position[c.triangle1[k]];
  c.offset = d.objects[a].position[c.knot0] - anchor;
  c.stiffness = 20.0, c.damping = 0.01;
  return c;
}
scene::Description sceneOf(std::vector<scene::Object> objects, std::vector<scene::Suture> sutures) {
  scene::Description d;
  d.name = "edited", d.hash = "00000000000000ad";
  d.objects = std::move(objects), d.sutures = std::move(sutures);
  return d;
}
scene::Description before() {
  scene::Description d = sceneOf({vessel("kept", 0.0), vessel("gone", 0.06), vessel("beside", 0.03)},
                                 {thread("kept_thread", 0.2), thread("gone_thread", 0.3)});
  d.connections = {tie(d, 0, 2)};
  return d;
}
/// Another object and another thread stand before those that are kept.
scene::Description after() {
  scene::Description d = sceneOf({vessel("new", 0.06), vessel("beside", 0.03), vessel("kept", 0.0)},
                                 {thread("new_thread", 0.4), thread("kept_thread", 0.2)});
  d.connections = {tie(d, 2, 1)};
  return d;
}

struct Theatre : test::Theatre {
  using test::Theatre::Theatre;
  /// Jaws of the right instrument about the tube at y.
  void jaws(tools::ToolKind kind, double x, double y, double from, double to, int steps) {
    use(kind, Vector3d(x, y, kJaws), from, to, steps);
  }
  void clip(double x, double y) {
    jaws(tools::ToolKind::ClipApplier, x, y, 0.6, 0.6, 60);
    jaws(tools::ToolKind::ClipApplier, x, y, 0.6, 0.0, 300);
    jaws(tools::ToolKind::ClipApplier, x, y, 0.0, 0.6, 100);
  }
  void grasp(double x, double y) {
    jaws(tools::ToolKind::Grasper, x, y, 0.8, 0.8, 20);
    jaws(tools::ToolKind::Grasper, x, y, 0.8, 0.0, 100);
  }
  Theatre edited(const scene::Description& d, int threads = 1) const {
    Theatre next(d, threads);
    next.world = scene::World(scene::buildModel(d, &world.model()), threads);
    next.world.adopt(world);
    next.input = input;
    return next;
  }
};

std::size_t numberOf(const scene::World& w, const std::string& name) {
  const auto& objects = w.description().objects;
  const auto found =
      std::find_if(objects.begin(), objects.end(), [&](const auto& o) { return o.name == name; });
  return static_cast<std::size_t>(found - objects.begin());
}
std::vector<float> places(const scene::World& w, const std::string& name) {
  return fem::specimen::positionsOf(w, numberOf(w, name));
}
std::vector<Vector3d> nodes(const scene::World& w, const std::string& name) {
  std::vector<scene::ThreadView> all;
  w.threads(all);
  for (const auto& t : all)
    if (w.description().sutures[t.suture].rod.name == name) return t.positions;
  return {};
}
std::vector<scene::Attachment> attachments(const scene::World& w) {
  std::vector<scene::Attachment> all;
  w.attachments(all);
  return all;
}

/// A clip, a tear, jaws that hold, a thread that has fallen.
Theatre operated() {
  Theatre t(before());
  t.clip(-0.01, 0.0);
  EXPECT_TRUE(t.saw(EventKind::Clipped));
  EXPECT_TRUE(t.world.removeLink(0, 7));
  t.grasp(0.01, 0.0);
  EXPECT_TRUE(t.saw(EventKind::Grasped));
  return t;
}

TEST(Adopt, WhatBothScenesSayGoesOnToTheBitUnderItsNewNumber) {
  Theatre t = operated();
  Theatre next = t.edited(after());
  EXPECT_EQ(next.world.steps(), t.world.steps());
  EXPECT_EQ(next.world.time(), t.world.time());
  ASSERT_EQ(numberOf(next.world, "kept"), 2U);
  EXPECT_EQ(next.world.topology(2).link_alive[7], 0);
  for (int i = 0; i < 300; ++i) {
    for (Theatre* of : {&t, &next}) of->input.tools[1].position.z() += 2e-5;
    t.step(), next.step();
    ASSERT_EQ(places(t.world, "kept"), places(next.world, "kept")) << "step " << i;
  }
  EXPECT_EQ(places(t.world, "beside"), places(next.world, "beside")) << "and what it is tied to";
  EXPECT_EQ(attachments(next.world).size(), 2U) << "the clip and the jaws";
  for (const auto& a : attachments(next.world)) EXPECT_EQ(a.anchor.object, 2);
  const auto was = nodes(t.world, "kept_thread"), is = nodes(next.world, "kept_thread");
  ASSERT_EQ(was.size(), is.size());
  ASSERT_FALSE(is.empty());
  EXPECT_LT(is[10].z(), 0.0) << "it fell";
  for (std::size_t i = 0; i < is.size(); ++i) EXPECT_LT((was[i] - is[i]).norm(), 1e-6);
  EXPECT_GT(nodes(next.world, "new_thread")[10].z(), was[10].z()) << "it began to fall later";
}

TEST(Adopt, WhatIsNewOrChangedBeginsAsTheSceneSays) {
  Theatre t = operated();
  scene::Description d = before();
  d.objects[0] = vessel("kept", 0.0, 21e3);
  Theatre next = t.edited(d);
  std::vector<float> begin;
  for (const Vector3d& x : d.objects[0].position)
    for (int axis = 0; axis < 3; ++axis) begin.push_back(static_cast<float>(x[axis]));
  EXPECT_EQ(places(next.world, "kept"), begin);
  EXPECT_EQ(next.world.topology(0).link_alive[7], 1);
  EXPECT_TRUE(attachments(next.world).empty()) << "the clip and the jaws held on to what was there before";
  EXPECT_EQ(places(next.world, "gone"), places(t.world, "gone"));
  next.run(500);
}

TEST(Adopt, WhatHeldOnToWhatIsGoneLetsGo) {
  scene::Description d = before();
  d.connections.push_back(tie(d, 1, 2));
  Theatre t(d);
  t.clip(-0.01, 0.06);
  t.grasp(0.01, 0.06);
  ASSERT_EQ(attachments(t.world).size(), 2U);
  Theatre next = t.edited(after());
  EXPECT_TRUE(attachments(next.world).empty());
  next.run(500);
  EXPECT_FALSE(next.saw(EventKind::Fault));
  d = after();
  d.connections.push_back(tie(d, 0, 1));
  t.edited(d).run(500);  // what is drawn in its place is tied to where the others are
}

TEST(Adopt, AnObjectThatOnlyBeginsElsewhereKeepsItsState) {
  Theatre t = operated();
  scene::Description d = before();
  for (Vector3d& x : d.objects[0].position) x.z() += 0.001;
  d.connections[0].offset.z() += 0.001;
  Theatre next = t.edited(d);
  EXPECT_EQ(places(next.world, "kept"), places(t.world, "kept"));
  EXPECT_EQ(attachments(next.world).size(), 2U);
}

TEST(Adopt, TheSameBitsForAnyNumberOfWorkersAndThroughASnapshot) {
  Theatre t = operated();
  Theatre one = t.edited(after(), 1), three = t.edited(after(), 3);
  std::vector<std::uint8_t> bytes;
  one.world.save(bytes);
  Theatre restored(after());
  restored.world.restore(bytes);  // what no State can be is refused
  restored.input = one.input;
  for (Theatre* of : {&one, &three, &restored}) of->run(200);
  EXPECT_EQ(one.world.stateHash(), three.world.stateHash());
  EXPECT_EQ(one.world.stateHash(), restored.world.stateHash());
}

TEST(Adopt, ThreadsThatTouchKeepTheirSidesUnderNewNumbers) {
  // Contacts are looked up by their numbers: in another order they would begin again, perhaps on the other
  // side.
  const auto pair = [](const std::string& name, double y) {
    scene::Suture below = thread(name + "_below", y), above = thread(name + "_above", y);
    below.rod.held = {{0, suture::Hold::Place, {}}, {20, suture::Hold::Place, {}}};
    for (Vector3d& x : above.rod.nodes) x = Vector3d(0.01, x.x() + y - 0.01, 0.0506);
    return std::vector<scene::Suture>{below, above};
  };
  const auto first = pair("first", 0.2), second = pair("second", 0.3);
  Theatre t(sceneOf({vessel("kept", 0.0)}, {first[0], first[1], second[0], second[1]}));
  t.run(60);
  ASSERT_GE(t.world.state().threads.rod.contact_count, 2U);
  Theatre next = t.edited(sceneOf({vessel("kept", 0.0)}, {second[0], second[1], first[0], first[1]}));
  const suture::State& rod = next.world.state().threads.rod;
  ASSERT_EQ(rod.contact_count, t.world.state().threads.rod.contact_count);
  for (std::uint32_t i = 1; i < rod.contact_count; ++i) {
    const auto &p = rod.contacts[i - 1], &q = rod.contacts[i];
    EXPECT_TRUE(p.a < q.a || (p.a == q.a && p.b < q.b)) << p.a << " " << p.b << ", " << q.a << " " << q.b;
  }
}

TEST(Adopt, AConnectionThatToreStaysTorn) {
  scene::Description d = before();
  d.connections[0].break_force = 1e-5;
  Theatre t(d);
  t.grasp(0.0, 0.0);
  for (int i = 0; i < 200; ++i) t.input.tools[1].position.z() += 5e-5, t.step();
  ASSERT_FALSE(t.world.state().connections[0].alive);
  scene::Description next = after();
  next.connections[0].break_force = 1e-5;
  EXPECT_FALSE(t.edited(next).world.state().connections[0].alive);
}

TEST(Adopt, AnotherStepLengthKeepsNothing) {
  Theatre t = operated();
  scene::Description d = before();
  d.dt = 0.0005;
  scene::World next(d);
  for (const std::uint32_t to : next.adopt(t.world)) EXPECT_EQ(to, scene::kNotAdopted);
}

TEST(Adopt, ElementsAtRestAnswerHeldForcesByTheirNewShareOfTheStep) {
  fem::specimen::SlabOptions o;
  o.motion = fem::Motion::Elastostatic, o.nx = 6, o.ny = 4, o.nz = 2;
  const scene::Object slab = fem::specimen::object(fem::specimen::slab(o));
  Theatre alone(fem::specimen::sceneOf({slab}));
  const scene::Description two = fem::specimen::sceneOf({slab, vessel("new", 0.1)});
  Theatre next = alone.edited(two);
  ASSERT_NE(next.world.state().objects[0].batches, alone.world.state().objects[0].batches);
  const auto masses = [](const scene::World& w) {
    const net::Block& b = w.state().objects[0].block;
    const float* const row = b.row(net::Block::kInverseMass);
    return std::vector<float>(row, row + b.knots());
  };
  EXPECT_EQ(masses(next.world), masses(scene::World(two)));
}

TEST(Adopt, ElementsGoOnMovingAndAtRestAndAreNotFactorisedAgain) {
  for (const auto motion : {fem::Motion::BackwardEuler, fem::Motion::Elastostatic}) {
    fem::specimen::SlabOptions o;
    o.motion = motion, o.nx = 6, o.ny = 4, o.nz = 2;
    const scene::Object slab = fem::specimen::object(fem::specimen::slab(o));
    o.name = "other";
    scene::Object other = fem::specimen::object(fem::specimen::slab(o));
    for (auto* list : {&other.position, &other.rest_position})
      for (Vector3d& x : *list) x.y() += 0.2;
    fem::Description moved = *other.fem;
    for (Vector3d& x : moved.nodes) x.y() += 0.2;
    other.fem = std::make_shared<const fem::Description>(moved);
    Theatre t(fem::specimen::sceneOf({other, slab}));
    t.grasp(0.0, 0.0);
    t.use(tools::ToolKind::Grasper, Vector3d(0, 0, 0.010), 0.0, 0.0, 200);
    Theatre next = t.edited(fem::specimen::sceneOf({slab, vessel("new", 0.1)}));
    EXPECT_EQ(next.world.model().objects[0].fem, t.world.model().objects[1].fem) << "built once";
    EXPECT_EQ(places(next.world, "slab"), places(t.world, "slab"));
    next.run(300);
    t.run(300);
    double apart = 0.0;
    const auto a = places(next.world, "slab"), b = places(t.world, "slab");
    for (std::size_t i = 0; i < a.size(); ++i)
      apart = std::max(apart, std::fabs(static_cast<double>(a[i] - b[i])));
    EXPECT_LT(apart, 1e-5);
  }
}

}  // namespace
