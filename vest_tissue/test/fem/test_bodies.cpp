#include <gtest/gtest.h>

#include "beam.h"
#include "vest_tissue/fem/bodies.h"

namespace vest::fem::test {
namespace {

net::Anchor anchorOn(Index a, Index b, Index c) {
  net::Anchor anchor;
  anchor.knots = {a, b, c, 0};
  anchor.weights = {0.5, 0.3, 0.2, 0.0};
  return anchor;
}

Description beam(Strain strain) {
  Description d = makeBox({5, 2, 2, 1.0, 0.4, 0.4});
  d.strain = strain;
  d.material = {1000.0, 0.3, 1.0, 0.1, 0.01};
  return d;
}

/// What every body must do: the impulse's effect is the compliance, which is symmetric and positive.
void conforms(solver::Body& body, const net::Anchor& anchor, double dt, double tolerance) {
  const Eigen::Matrix3d C = body.compliance(anchor);
  EXPECT_LT((C - C.transpose()).norm(), 1e-12 * C.norm());
  EXPECT_GT(Eigen::Vector3d(1, -2, 0.5).dot(C * Eigen::Vector3d(1, -2, 0.5)), 0.0);
  const Eigen::Vector3d before = body.velocity(anchor), J(0.01, -0.03, 0.02);
  body.applyImpulse(anchor, J);
  const Eigen::Vector3d change = body.velocity(anchor) - before;
  EXPECT_LT((change * dt - C * J / dt).norm(), tolerance * change.norm() * dt);
}

TEST(CondensedBody, AnswersImpulsesByItsCompliance) {
  const CondensedModel model(beam(Strain::Small), {});
  CondensedState state(model);
  CondensedBody body(model, state);
  const net::Anchor anchor = anchorOn(45, 46, 48);
  body.beginStep(0.01);
  conforms(body, anchor, 0.01, 1e-10);
  const Eigen::Vector3d start = body.position(anchor), v = body.velocity(anchor);
  body.endStep();
  EXPECT_LT((body.position(anchor) - start - 0.01 * v).norm(), 1e-14);
  // Nobody pushes any more: it goes back.
  body.beginStep(0.01);
  body.endStep();
  EXPECT_LT((body.position(anchor) - start).norm(), 1e-15);
  // After a cut it is softer, and the law holds as before.
  const double stiff = body.compliance(anchor).trace();
  ASSERT_TRUE(cut(model, state, {0, 1, 2}).done);
  body.beginStep(0.01);
  EXPECT_GT(body.compliance(anchor).trace(), stiff);
  conforms(body, anchor, 0.01, 1e-9);
}

TEST(CondensedBody, HeldNodesDoNotMove) {
  const CondensedModel model(beam(Strain::Small), {});
  CondensedState state(model);
  CondensedBody body(model, state);
  const net::Anchor anchor = anchorOn(0, 1, 2);
  body.beginStep(0.01);
  body.applyImpulse(anchor, {1, 1, 1});
  body.endStep();
  EXPECT_EQ(body.compliance(anchor).norm(), 0.0);
  EXPECT_EQ(body.velocity(anchor).norm(), 0.0);
}

TEST(DynamicBody, AnswersImpulsesByItsComplianceInBothStrains) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    const auto model = buildModel(beam(strain), Use::Dynamic);
    State state = restState(*model);
    Scratch scratch(*model, 1);
    DynamicBody body(*model, state, scratch);
    StepOptions o;
    o.dt = 0.01;
    o.gravity = {0, 0, -9.81};
    const net::Anchor anchor = anchorOn(45, 46, 48);
    for (int i = 0; i < 5; ++i) {
      ASSERT_EQ(body.beginStep(o), StepStatus::Ok);
      conforms(body, anchor, o.dt, 1e-9);
      const Eigen::Vector3d start = body.position(anchor), v = body.velocity(anchor);
      body.endStep();
      EXPECT_LT((body.position(anchor) - start - o.dt * v).norm(), 1e-14);
      EXPECT_LT((body.velocity(anchor) - v).norm(), 1e-14);
    }
  }
}

TEST(DynamicBody, WithoutImpulsesIsTheStepItself) {
  const auto model = buildModel(beam(Strain::Corotational), Use::Dynamic);
  State one = restState(*model), two = one;
  Scratch scratch1(*model, 1), scratch2(*model, 1);
  DynamicBody body(*model, one, scratch1);
  StepOptions o;
  o.dt = 0.02;
  o.gravity = {0, 0, -9.81};
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(body.beginStep(o), StepStatus::Ok);
    body.endStep();
    ASSERT_EQ(step(*model, o, two, scratch2), StepStatus::Ok);
  }
  for (std::size_t n = 0; n < one.x.size(); ++n) ASSERT_EQ(one.x[n], two.x[n]);
}

}  // namespace
}  // namespace vest::fem::test
