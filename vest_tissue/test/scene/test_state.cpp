// The State has one description: what it names is hashed, saved, compared and given back after a fault. (A
// member that it does not name does not compile.)
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "nets.h"
#include "state_archives.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using scene::Limits;
using Bytes = std::vector<std::uint8_t>;

/// Changes the first number of the n-th group that the walk comes by; tells how many there are.
struct Toucher : scene::Archive {
  std::size_t wanted = 0, seen = 0;
  template <class T>
  void values(T* v, std::size_t count, const Limits&) {
    if (count == 0 || static_cast<const void*>(v) == &at.changed || seen++ != wanted) return;
    if constexpr (std::is_same_v<T, bool>)
      v[0] = !v[0];
    else if constexpr (std::is_enum_v<T>)
      v[0] = static_cast<T>(1 - static_cast<int>(v[0]));
    else
      v[0] = static_cast<T>(v[0] == T{1} ? 2 : 1);
  }
  void count(std::size_t, std::size_t, const Limits&) {}
};

scene::WorldState& stateOf(scene::World& w) {
  return const_cast<scene::WorldState&>(w.state());
}

Bytes bytesOf(scene::World& w, bool everything) {
  Bytes bytes;
  scene::Writer writer{{{nullptr, &w.model()}, true, everything}, bytes};
  visit(writer, scene::rule(stateOf(w)));
  return bytes;
}

scene::Description smallest() {
  specimen::TubeOptions o;
  o.rings = 4, o.around = 3, o.length = 0.02, o.mass = 0.001;
  scene::Description d = specimen::tubeScene(o);
  d.sutures.resize(1);
  auto& rod = d.sutures[0].rod;
  rod.nodes = {{0.1, 0, 0}, {0.11, 0, 0}, {0.12, 0, 0}, {0.13, 0, 0}};
  rod.section = suture::solidSection(0.0001, 1000.0, 1e9, 0.4);
  return d;
}

TEST(State, EveryScalarIsHashedSavedAndGivenBack) {
  scene::World w(smallest());
  // Something in every part of it.
  std::uint32_t copy;
  ASSERT_TRUE(w.splitKnot(0, 4, Eigen::Vector3d::UnitX(), copy));
  scene::WorldState& s = stateOf(w);
  s.objects[0].heat.touched = s.objects[0].load.any = true;
  s.objects[0].cut.crossings.resize(1), s.objects[0].cut.tracks.resize(1), s.objects[0].cut.faces.resize(1);
  s.objects[0].elements.bending.push_back({0, 1, 2, 1.0f, 0.0f});
  s.objects[0].elements.plastic.push_back({0, 1, 1.0f, 0.01f, 0.0f});
  s.objects[0].elements.tethers.push_back({0, {}, 1.0f, 0.0f});
  s.pairs.resize(1), s.sides.resize(1), s.fasteners.clips.resize(1), s.fasteners.slings.resize(1);
  s.fasteners.clips[0].count = s.fasteners.slings[0].count = 3;
  for (auto& g : s.grasps) g.count = 2;
  for (auto& h : s.suspensions.all) h.alive = true, h.count = 2;
  s.threads.touches.resize(1), s.threads.rod.contact_count = 1;
  for (auto& g : s.threads.grips) g.count = 1;
  const Bytes whole = bytesOf(w, true);
  const auto hash = w.stateHash();
  Bytes saved;
  w.save(saved);
  Toucher all{{{nullptr, &w.model()}, true, false}};
  all.wanted = ~std::size_t{0};
  visit(all, scene::rule(s));
  ASSERT_GT(all.seen, 1500u);
  for (std::size_t n = 0; n < all.seen; ++n) {
    Toucher touch{{{nullptr, &w.model()}, true, false}};
    touch.wanted = n;
    visit(touch, scene::rule(s));
    const std::string name = "number " + std::to_string(n) + " of the walk";
    ASSERT_NE(w.stateHash(), hash) << name;
    Bytes now;
    w.save(now);
    ASSERT_TRUE(now != saved) << name;
    scene::Reader reader{{{nullptr, &w.model()}, true, true}, whole};
    visit(reader, scene::rule(s));
    ASSERT_TRUE(bytesOf(w, true) == whole) << name;
  }
}

/// Three tubes; the second one explodes when told so.
struct Theatre {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;

  static scene::Description scene() {
    specimen::TubeOptions o;
    o.rings = 24, o.length = 0.07, o.radius = 0.0025, o.mass = 0.0012;
    scene::Description d = specimen::tubeScene(o);
    d.objects[0].tube.vessel_segment = "vessel";
    d.objects[0].tear_strain = 1.0;
    o.name = "other", o.centre.y() = 0.05;
    d.objects.push_back(specimen::tube(o));
    o.name = "hung", o.centre.y() = -0.05;
    d.objects.push_back(specimen::tube(o));
    scene::Connection c;
    c.object0 = "hung", c.object1 = "tube";
    c.knot0 = 96, c.triangle1 = d.objects[0].contact_triangles[100], c.weights1 = {1, 0, 0};
    c.offset = Eigen::Vector3d(0, -0.02, 0), c.stiffness = 5.0, c.break_force = 0.2;
    d.connections.push_back(c);
    d.gravity.setZero();
    return d;
  }
  Theatre() : world(scene()) {}
  scene::Status step() {
    input.step = world.steps();
    return world.step(input, report);
  }
  /// Steps, time, and what is at rest after a fault, left out.
  Bytes compared() {
    const scene::WorldState kept = world.state();
    scene::WorldState& s = stateOf(world);
    s.step = 0, s.time = 0.0;
    net::Block& b = s.objects[1].block;
    for (const auto r : {net::Block::VX, net::Block::VY, net::Block::VZ})
      std::fill_n(b.row(r), b.knots(), 0.0f);
    for (auto& p : s.proxies) p.velocity.setZero(), interaction::clearForces(p);
    const Bytes bytes = bytesOf(world, true);
    s = kept;
    return bytes;
  }
  /// One step that explodes gives back the State before it, and all that it read of it.
  void expectGivenBack(const char* what) {
    const Bytes before = compared();
    const std::uint32_t revision = world.revision();
    // One drop makes no knot faster than fluid gets; a hail of them does.
    for (int i = 0; i < 1000; ++i)
      input.impacts.push_back({1, 20, {0.3, 0.3, 0.4}, Eigen::Vector3d(1e3, 0, 0)});
    ASSERT_EQ(step(), scene::Status::Fault) << what;
    input.impacts.clear();
    EXPECT_TRUE(compared() == before) << what;
    std::vector<scene::TopologyDelta> deltas;
    EXPECT_EQ(world.revision(), revision) << what;
    EXPECT_TRUE(world.deltasSince(revision, deltas)) << what;
    EXPECT_TRUE(deltas.empty()) << what;
  }
};

TEST(State, AFaultGivesBackTheWholeStateBeforeTheStep) {
  const auto with = [](const char* what, auto change) {
    Theatre t;
    for (int i = 0; i < 20; ++i) ASSERT_NE(t.step(), scene::Status::Fault);
    change(t);
    t.expectGivenBack(what);
    // And the tables that the kernel reads: it goes on as one that was restored from those bytes.
    Bytes bytes;
    t.world.save(bytes);
    Theatre other;
    other.world.restore(bytes);
    t.input = other.input = scene::StepInput{};
    for (int i = 0; i < 50; ++i) t.step(), other.step();
    EXPECT_EQ(t.world.stateHash(), other.world.stateHash()) << what;
  };
  with("nothing but motion", [](Theatre&) {});
  with("parameters", [](Theatre& t) {
    t.input.edits = {{"tube", "youngs_modulus", 30e3}, {"", "gravity_z", -5.0}, {"", "monopolar_power", 7.0}};
  });
  with("a knot is split and a link removed", [](Theatre& t) {
    t.input.requests = {{scene::TopologyRequest::Kind::SplitKnot, 0, 44, Eigen::Vector3d::UnitX()},
                        {scene::TopologyRequest::Kind::RemoveLink, 0, 12, Eigen::Vector3d::UnitX()}};
  });
  with("a pool's weight and the pulse", [](Theatre& t) {
    t.input.load_over = 0.1;
    t.input.loads = {{0, 40, {0.01f, 0.0f, 0.02f}, 0.001f}};
    t.input.dilatations.resize(1);
    t.input.dilatations[0].vessel_segment = scene::VesselName("vessel");
    t.input.dilatations[0].dilatation.fill(1.3f);
  });
  with("a link and a connection tear", [](Theatre& t) {
    net::Block& b = stateOf(t.world).objects[0].block;
    b.row(net::Block::Z)[100] += 0.02f;
    stateOf(t.world).objects[2].block.row(net::Block::Y)[96] -= 0.06f;
    Theatre calm;  // it does tear both
    stateOf(calm.world).objects[0].block.row(net::Block::Z)[100] += 0.02f;
    stateOf(calm.world).objects[2].block.row(net::Block::Y)[96] -= 0.06f;
    calm.step();
    EXPECT_FALSE(calm.world.state().connections[0].alive);
    EXPECT_GE(std::count_if(calm.report.events.begin(), calm.report.events.end(),
                            [](const auto& e) { return e.kind == scene::EventKind::Torn; }),
              2);
  });
}

TEST(State, AClipThatAFaultTakesBackIsSetAgain) {
  Theatre t;
  const auto closing = [&](int i) {
    auto& tool = t.input.tools[1];
    tool = specimen::grasper(Eigen::Vector3d(0.0, 0.0, 0.0435),
                             i < 60 ? 0.6 : std::max(0.0, 0.6 - 0.002 * (i - 60)));
    tool.tool = tools::ToolKind::ClipApplier;
    tool.pivot = Eigen::Vector3d(0, 0, 0.2);
  };
  bool set = false;
  for (int i = 0; i < 360 && !set; ++i) {
    closing(i);
    // Tried on a copy: does this step set the clip?
    Bytes bytes;
    t.world.save(bytes);
    const std::size_t clips = t.world.state().fasteners.clips.size();
    ASSERT_NE(t.step(), scene::Status::Fault);
    set = t.world.state().fasteners.clips.size() > clips;
    if (!set) continue;
    t.world.restore(bytes);
    t.expectGivenBack("a clip is set");
    EXPECT_EQ(t.world.state().fasteners.clips.size(), clips);
    ASSERT_NE(t.step(), scene::Status::Fault);
    EXPECT_GT(t.world.state().fasteners.clips.size(), clips) << "in the next step";
  }
  EXPECT_TRUE(set);
}

}  // namespace
