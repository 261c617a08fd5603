// Protects the teleoperator: keys and mouse in a real rviz view move the chosen instrument and no other, in
// the direction of the picture; pedals go off with their keys; taking over is explicit and is given back; the
// keys stand on the screen.
#include <map>
#include <string>

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/display.h>
#include <rviz/tool.h>
#include <rviz/tool_manager.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/StringStamped.h>
#include <QApplication>
#include <QLabel>
#include <QScreen>
#include <QWheelEvent>

#include "image_pane.h"
#include "rviz_view.h"
#include "vest_instruments/control/teleoperator.h"

namespace {

using vest::spin;

QString g_picture;  ///< file; empty: none is kept

class Teleoperate : public vest::displays::RvizView {
 protected:
  rviz::Tool* tool = nullptr;
  std::map<std::string, geometry_msgs::Point> tip;
  std::map<std::string, int> count;
  std::map<std::string, std::string> command;
  double jaw = -1.0;
  std::vector<int> pedals;
  std::vector<ros::Subscriber> subscribers;
  ros::Publisher states = nh.advertise<vest_msgs::InstrumentStates>("instruments", 1, true);

  void SetUp() override {
    tf2_ros::StaticTransformBroadcaster tf;
    std::vector<geometry_msgs::TransformStamped> frames(2);
    frames[0].header.frame_id = frames[1].header.frame_id = "world";
    frames[0].child_frame_id = "phantom_box";
    frames[0].transform.rotation.w = 1.0;
    // An endoscope that looks along y: right is x, up is z.
    frames[1].child_frame_id = "endoscope_optical_frame";
    frames[1].transform.rotation.x = -std::sqrt(0.5);
    frames[1].transform.rotation.w = std::sqrt(0.5);
    tf.sendTransform(frames);
    for (const std::string name : {"left", "right", "third", "endoscope"}) {
      subscribers.push_back(nh.subscribe<geometry_msgs::PoseStamped>(
          "teleop/" + name + "/servo_cp", 50, [this, name](const geometry_msgs::PoseStampedConstPtr& m) {
            tip[name] = m->pose.position;
            ++count[name];
          }));
      subscribers.push_back(nh.subscribe<vest_msgs::StringStamped>(
          name + "/state_command", 5,
          [this, name](const vest_msgs::StringStampedConstPtr& m) { command[name] = m->string; }));
    }
    subscribers.push_back(nh.subscribe<sensor_msgs::JointState>(
        "teleop/right/jaw/servo_jp", 50,
        [this](const sensor_msgs::JointStateConstPtr& m) { jaw = m->position.at(0); }));
    subscribers.push_back(nh.subscribe<sensor_msgs::Joy>(
        "teleop/footswitches", 50, [this](const sensor_msgs::JoyConstPtr& m) { pedals = m->buttons; }));
    say(vest_msgs::InstrumentState::SOURCE_TELEOP);

    tool = manager->getToolManager()->addTool("vest_viz/Teleoperate");
    ASSERT_NE(tool, nullptr);
    manager->getToolManager()->setCurrentTool(tool);
    ASSERT_TRUE(spin([&] { return count["right"] > 0; }));
  }
  void TearDown() override { manager->getToolManager()->removeAll(); }

  void say(std::uint8_t source) {
    vest_msgs::InstrumentStates msg;
    for (const char* name : {"left", "right"}) {
      vest_msgs::InstrumentState s;
      s.name = name;
      s.source = source;
      s.joint_position = {0.1, -0.1, 0.12, 0.0, 0.3};
      msg.instruments.push_back(s);
    }
    states.publish(msg);
  }
  using RvizView::mouse;
  void mouse(QWidget& over, QEvent::Type type, QPoint at, Qt::MouseButton button, Qt::MouseButtons down) {
    QMouseEvent event(type, at, button, down, Qt::NoModifier);
    QApplication::sendEvent(&over, &event);
  }
  /// A drag of 50 pixels to the right and 20 up, then a click of the wheel, over a widget.
  void dragsAndTurns(QWidget& over) {
    const geometry_msgs::Point before = tip["right"];
    mouse(over, QEvent::MouseButtonPress, {300, 300}, Qt::LeftButton, Qt::LeftButton);
    mouse(over, QEvent::MouseMove, {350, 280}, Qt::NoButton, Qt::LeftButton);
    mouse(over, QEvent::MouseButtonRelease, {350, 280}, Qt::LeftButton, Qt::NoButton);
    EXPECT_TRUE(spin([&] { return std::abs(tip["right"].x - before.x - 0.010) < 1e-6; }))
        << tip["right"].x - before.x;
    EXPECT_NEAR(tip["right"].z - before.z, 0.004, 1e-6);
    const geometry_msgs::Point dragged = tip["right"];
    QWheelEvent wheel(QPointF(300, 300), QPointF(300, 300), QPoint(), QPoint(0, 120), Qt::NoButton,
                      Qt::NoModifier, Qt::NoScrollPhase, false);
    QApplication::sendEvent(&over, &wheel);
    EXPECT_TRUE(spin([&] {
      const auto& p = tip["right"];
      return std::abs(std::hypot(std::hypot(p.x - dragged.x, p.y - dragged.y), p.z - dragged.z) - 0.002) <
             1e-6;
    }));
  }
  QString legend() const {
    const auto labels = panel.findChildren<QLabel*>();
    return labels.isEmpty() ? QString() : labels[0]->text();
  }
};

TEST_F(Teleoperate, HeldKeysMoveTheTipAlongThePictureUntilTheyAreReleased) {
  const geometry_msgs::Point before = tip["right"];
  press(Qt::Key_D);
  ASSERT_TRUE(spin([&] { return tip["right"].x > before.x + 0.004; }));
  key(Qt::Key_D, QEvent::KeyRelease, true);
  EXPECT_TRUE(spin([&] { return tip["right"].x > before.x + 0.006; })) << "a repeated key is still down";
  release(Qt::Key_D);
  spin([] { return false; }, 0.3);
  const geometry_msgs::Point rest = tip["right"];
  EXPECT_NEAR(rest.y, before.y, 1e-6);
  EXPECT_NEAR(rest.z, before.z, 1e-6);
  spin([] { return false; }, 0.2);
  EXPECT_EQ(tip["right"].x, rest.x) << "at rest without keys";
  press(Qt::Key_W);
  EXPECT_TRUE(spin([&] { return tip["right"].z > rest.z + 0.004; })) << "up in the picture is up";
  release(Qt::Key_W);
  EXPECT_EQ(count["left"], 0) << "only the chosen instrument is spoken to";
}

TEST_F(Teleoperate, TheMouseDragsTheTipAndItsWheelGoesIn) {
  dragsAndTurns(panel);
}

TEST_F(Teleoperate, ThroughThePictureThatCoversTheViewTheMouseActsAsWithoutIt) {
  vest::displays::ImagePane pane;
  pane.cover(&panel);
  spin([] { return false; }, 0.1);
  ASSERT_EQ(panel.childAt(300, 300), &pane) << "it is what lies under the mouse";
  dragsAndTurns(pane);
  press(Qt::Key_F1);
  EXPECT_TRUE(spin([&] {
    return pedals == std::vector<int>({1, 0, 0, 0, 0, 0});
  })) << "and keys reach the tool";
  release(Qt::Key_F1);
  pane.cover(nullptr);
  pane.setParent(nullptr);
  const geometry_msgs::Point before = tip["right"];
  mouse(pane, QEvent::MouseButtonPress, {300, 300}, Qt::LeftButton, Qt::LeftButton);
  mouse(pane, QEvent::MouseMove, {350, 280}, Qt::NoButton, Qt::LeftButton);
  mouse(pane, QEvent::MouseButtonRelease, {350, 280}, Qt::LeftButton, Qt::NoButton);
  spin([] { return false; }, 0.3);
  EXPECT_EQ(tip["right"].x, before.x) << "a picture beside the view moves nothing";
}

TEST_F(Teleoperate, PedalsAreDownWithTheirKeysAndGoOffWhenTheWindowIsLeft) {
  press(Qt::Key_F1);
  press(Qt::Key_F4);
  EXPECT_TRUE(spin([&] { return pedals == std::vector<int>({1, 0, 0, 1, 0, 0}); }));
  EXPECT_TRUE(legend().contains("coag"));
  release(Qt::Key_F4);
  EXPECT_TRUE(spin([&] { return pedals == std::vector<int>({1, 0, 0, 0, 0, 0}); }));
  QFocusEvent left(QEvent::FocusOut);
  QApplication::sendEvent(&panel, &left);
  EXPECT_TRUE(spin([&] { return pedals == std::vector<int>(6, 0); })) << "nobody will tell of the release";
}

TEST_F(Teleoperate, JawsOpenAndCloseAndTheKeysStandOnTheScreen) {
  press(Qt::Key_V);
  EXPECT_TRUE(spin([&] { return jaw > 0.3; }));
  release(Qt::Key_V);
  const double open = jaw;
  press(Qt::Key_C);
  EXPECT_TRUE(spin([&] { return jaw < open - 0.1; }));
  for (const char* words : {"Teleoperate right", "W A S D, drag", "E Q, wheel", "R F, right drag",
                            "close, open the jaws", "F6", "clutch", "left, right, third, endoscope"}) {
    EXPECT_TRUE(legend().contains(words)) << words << " in " << legend().toStdString();
  }
  if (!g_picture.isEmpty()) {
    press(Qt::Key_F2);
    manager->createDisplay("rviz/Grid", "grid", true)->subProp("Cell Size")->setValue(0.5);
    spin([] { return false; }, 1.0);
    EXPECT_TRUE(QGuiApplication::primaryScreen()->grabWindow(window->winId()).save(g_picture));
  }
}

TEST_F(Teleoperate, TakingOverIsExplicitStartsWhereTheInstrumentIsAndIsGivenBack) {
  say(vest_msgs::InstrumentState::SOURCE_BOX);
  ASSERT_TRUE(spin([&] { return legend().contains("moved by box") && legend().contains("take it over"); }));
  EXPECT_TRUE(command.empty()) << "nothing is taken that nobody asked for";
  spin([] { return false; }, 0.1);
  const int refused = count["right"];
  spin([] { return false; }, 0.2);
  EXPECT_EQ(count["right"], refused) << "nothing that would be refused is sent";
  press(Qt::Key_T);
  release(Qt::Key_T);
  ASSERT_TRUE(spin([&] { return command["right"] == "source:teleop"; }));
  say(vest_msgs::InstrumentState::SOURCE_TELEOP);
  ASSERT_TRUE(spin([&] { return legend().contains("give it back"); }));
  ASSERT_TRUE(spin([&] { return count["right"] > refused; }));
  vest::control::Teleoperator there(
      vest::kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml")
          .arm(vest::tools::Instrument::Right));
  there.place((vest::control::Joints() << 0.1, -0.1, 0.12, 0.0, 0.3).finished());
  EXPECT_NEAR(tip["right"].x, there.tip().translation().x(), 1e-9);
  EXPECT_NEAR(tip["right"].z, there.tip().translation().z(), 1e-9);
  press(Qt::Key_1);
  release(Qt::Key_1);
  EXPECT_TRUE(spin([&] { return command["right"] == "source:box"; })) << "choosing another gives it back";
  say(vest_msgs::InstrumentState::SOURCE_TELEOP);
  EXPECT_TRUE(spin([&] { return count["left"] > 0; }));
  EXPECT_TRUE(legend().contains("Teleoperate left"));
  const int sent = count["right"];
  spin([] { return false; }, 0.2);
  EXPECT_LE(count["right"], sent + 1);
}

TEST_F(Teleoperate, LeavingTheToolEndsEverything) {
  press(Qt::Key_F1);
  ASSERT_TRUE(spin([&] { return pedals == std::vector<int>({1, 0, 0, 0, 0, 0}); }));
  manager->getToolManager()->setCurrentTool(manager->getToolManager()->addTool("rviz/Interact"));
  spin([] { return false; }, 0.1);
  const int sent = count["right"];
  spin([] { return false; }, 0.3);
  EXPECT_EQ(count["right"], sent) << "silence: the instrument holds, pedals count as released";
  EXPECT_TRUE(legend().isEmpty());
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_teleoperate");
  QApplication application(argc, argv);
  // The gallery's picture: --picture=FILE
  for (int i = 1; i < argc; ++i)
    if (QString(argv[i]).startsWith("--picture=")) g_picture = QString(argv[i]).mid(10);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
