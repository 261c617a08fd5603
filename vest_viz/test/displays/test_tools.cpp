// Protects the tools of inspection: a mouse click in a real rviz view picks the knot or the link under it,
// and says what it has; drags move and turn the slice.
#include <cmath>
#include <string>

#include <OgreCamera.h>
#include <geometry_msgs/TwistStamped.h>
#include <rviz/display.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/vector_property.h>
#include <rviz/tool.h>
#include <rviz/tool_manager.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <vest_msgs/TissueField.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>

#include "rviz_view.h"

namespace vest::displays {
namespace {

constexpr float kEdge = 0.04f;  // m

/// A triangle of three knots, two of its edges links.
vest_msgs::TissueTopology triangle() {
  vest_msgs::TissueTopology t;
  t.header.frame_id = "world";
  t.revision = 1;
  t.scene = "triangle";
  t.objects.resize(1);
  vest_msgs::TissueObject& o = t.objects[0];
  o.name = "flap", o.organ = "ligament", o.material = "peritoneum";
  o.knot_count = 3;
  o.rest_position = {-kEdge, -kEdge, 0, kEdge, -kEdge, 0, -kEdge, kEdge, 0};
  o.triangles = {0, 1, 2};
  o.binding_start = {0, 1, 2, 3};
  o.binding_knots = {0, 1, 2};
  o.binding_weights = {1, 1, 1};
  o.link_knots = {0, 1, 0, 2};
  o.link_kind = {0, 0};
  o.link_alive = {1, 1};
  return t;
}

class Tools : public RvizView {
 protected:
  ros::Publisher topology = nh.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  ros::Publisher state = nh.advertise<vest_msgs::TissueState>("tissue/state", 1, true);
  rviz::Display* tissue = nullptr;
  QString said;  ///< the last word in rviz's status line
  QMetaObject::Connection connection;

  void SetUp() override {
    vest_msgs::TissueTopology t = triangle();
    topology.publish(t);
    vest_msgs::TissueState s;
    s.header.frame_id = "world";
    s.revision = 1;
    s.step = 7;
    s.positions = t.objects[0].rest_position;
    s.positions[3] += 0.002f;  // knot 1 was pulled
    s.fields.resize(1);
    s.fields[0].kind = vest_msgs::TissueField::TEMPERATURE;
    s.fields[0].minimum = 300, s.fields[0].maximum = 400;
    s.fields[0].data = {0, 255, 0};
    state.publish(s);
    tissue = manager->createDisplay("vest_viz/Tissue", "tissue", true);
    ASSERT_NE(tissue, nullptr);
    rviz::Property* const camera = manager->getViewManager()->getCurrent();
    camera->subProp("Distance")->setValue(0.2);
    camera->subProp("Pitch")->setValue(1.5);
    camera->subProp("Near Clip Distance")->setValue(0.005);
    connection = QObject::connect(manager, &rviz::VisualizationManager::statusUpdate,
                                  [this](const QString& text) { said = text; });
  }
  void TearDown() override {
    QObject::disconnect(connection);
    delete tissue;
    manager->getToolManager()->removeAll();
  }
  rviz::Tool* use(const char* kind) {
    rviz::Tool* const tool = manager->getToolManager()->addTool(kind);
    if (tool != nullptr) manager->getToolManager()->setCurrentTool(tool);
    spin([] { return false; }, 0.6);  // the view follows its properties, topics arrive
    return tool;
  }
  /// Pixel of the panel at which a world point is drawn.
  QPoint pixel(float x, float y) const {
    Ogre::Camera* const camera = manager->getViewManager()->getCurrent()->getCamera();
    const Ogre::Vector4 p =
        camera->getProjectionMatrix() * (camera->getViewMatrix() * Ogre::Vector4(x, y, 0, 1));
    return {static_cast<int>((0.5f + 0.5f * p.x / p.w) * static_cast<float>(view->width())),
            static_cast<int>((0.5f - 0.5f * p.y / p.w) * static_cast<float>(view->height()))};
  }
};

TEST_F(Tools, AClickPicksTheKnotUnderTheMouseAndSaysAllItHas) {
  ASSERT_NE(use("vest_viz/Pick"), nullptr);
  const QPoint there = pixel(kEdge + 0.002f, -kEdge);
  ASSERT_TRUE(panel.rect().contains(there)) << there.x() << " " << there.y();
  ASSERT_TRUE(spin([&] {
    click(there);
    return said.contains("knot: 1");
  })) << said.toStdString();
  for (const char* word : {"object: flap", "organ: ligament", "material: peritoneum", "displacement: 2.00 mm",
                           "links: 1", "temperature: 400"})
    EXPECT_TRUE(said.contains(word)) << word << " in " << said.toStdString();
}

TEST_F(Tools, AClickBetweenKnotsPicksTheLink) {
  ASSERT_NE(use("vest_viz/Pick"), nullptr);
  const QPoint there = pixel(0, -kEdge);
  ASSERT_TRUE(spin([&] {
    click(there);
    return said.contains("link: 0");
  })) << said.toStdString();
  for (const char* word :
       {"knots: 0, 1", "kind: elastic", "alive: yes", "length: 82.000 mm", "elongation: 2.5 %"})
    EXPECT_TRUE(said.contains(word)) << word << " in " << said.toStdString();
}

TEST_F(Tools, AClickBesideTheTissuePicksNothing) {
  ASSERT_NE(use("vest_viz/Pick"), nullptr);
  ASSERT_TRUE(spin([&] {
    click({5, 5});
    return said.contains("No knot and no link");
  })) << said.toStdString();
}

TEST_F(Tools, TheLeftButtonMovesTheSliceAndTheRightTurnsIt) {
  ASSERT_NE(use("vest_viz/Slice"), nullptr);
  rviz::Property* const slice = tissue->subProp("Slice");
  EXPECT_TRUE(slice->getValue().toBool()) << "the tool switches it on";
  auto* const offset = static_cast<rviz::FloatProperty*>(slice->subProp("Offset"));
  auto* const normal = static_cast<rviz::VectorProperty*>(slice->subProp("Normal"));
  normal->setVector(Ogre::Vector3(1, 0, 0));
  const float before = offset->getFloat();
  drag({300, 300}, {340, 260}, Qt::LeftButton);
  EXPECT_TRUE(spin([&] { return std::fabs(offset->getFloat() - before) > 0.002f; }, 5));
  EXPECT_EQ(normal->getVector(), Ogre::Vector3(1, 0, 0)) << "moved, not turned";
  const float moved = offset->getFloat();
  drag({300, 300}, {360, 330}, Qt::RightButton);
  EXPECT_TRUE(spin([&] { return normal->getVector().dotProduct(Ogre::Vector3(1, 0, 0)) < 0.99f; }, 5));
  EXPECT_EQ(offset->getFloat(), moved) << "turned, not moved";
}

TEST_F(Tools, TheCameraHandSendsWhereTheMouseGoes) {
  geometry_msgs::TwistStamped last;
  int count = 0;
  const ros::Subscriber hand = nh.subscribe<geometry_msgs::TwistStamped>(
      "camera_hand/servo_cv", 10,
      [&](const geometry_msgs::TwistStamped::ConstPtr& m) { last = *m, ++count; });
  ASSERT_NE(use("vest_viz/CameraHand"), nullptr);
  ASSERT_TRUE(spin([&] { return hand.getNumPublishers() > 0; }));
  const auto hold = [&](Qt::MouseButton button, QPoint to) {
    mouse(QEvent::MouseButtonPress, {300, 300}, button, button);
    mouse(QEvent::MouseMove, to, Qt::NoButton, button);
    count = 0;
    EXPECT_TRUE(spin([&] { return count > 2; }));
    mouse(QEvent::MouseButtonRelease, to, button, Qt::NoButton);
  };
  hold(Qt::LeftButton, {340, 280});
  EXPECT_EQ(last.header.frame_id, "endoscope_optical_frame");
  EXPECT_GT(last.twist.angular.y, 0.01) << "to the right";
  EXPECT_GT(last.twist.angular.x, 0.01) << "and up";
  EXPECT_EQ(last.twist.linear.z, 0);
  hold(Qt::RightButton, {300, 260});
  EXPECT_GT(last.twist.linear.z, 0.001) << "in";
  spin([] { return false; }, 0.2);
  count = 0;
  spin([] { return false; }, 0.3);
  EXPECT_EQ(count, 0) << "a button that is released stops the hand";
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_tools");
  QApplication application(argc, argv);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
