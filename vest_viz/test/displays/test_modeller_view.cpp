// Protects the picture in which a person draws: rviz as model.launch opens it shows the organ, its handles
// and the panel, and the mouse drags a handle.
#include <algorithm>

#include <OgreCamera.h>
#include <gtest/gtest.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/render_panel.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <rviz/visualization_frame.h>
#include <rviz/visualization_manager.h>
#include <vest_msgs/StringStamped.h>
#include <visualization_msgs/InteractiveMarkerInit.h>
#include <QApplication>
#include <QComboBox>
#include <QMouseEvent>
#include <QPushButton>
#include <QScreen>
#include <QTreeWidget>

#include "../spin.h"

namespace vest::displays {
namespace {

QString g_picture;  ///< file; empty: none is kept

void click(const QWidget& panel, const QString& text) {
  for (QPushButton* const b : panel.findChildren<QPushButton*>())
    if (b->text() == text) return b->click();
  ADD_FAILURE() << text.toStdString();
}

TEST(ModellerView, ShowsTheOrganAndTheMouseDragsAHandle) {
  ros::NodeHandle vest("/vest");
  std::string source;
  std::size_t handles = 0;
  geometry_msgs::Point end;
  const ros::Subscriber source_sub = vest.subscribe<vest_msgs::StringStamped>(
      "model/source", 20, [&](const vest_msgs::StringStampedConstPtr& msg) { source = msg->string; });
  const ros::Subscriber handles_sub = vest.subscribe<visualization_msgs::InteractiveMarkerInit>(
      "model/handles/update_full", 20, [&](const visualization_msgs::InteractiveMarkerInitConstPtr& msg) {
        handles = msg->markers.size();
        for (const auto& marker : msg->markers)
          if (marker.name == "/tube/centre/3") end = marker.pose.position;
      });
  rviz::VisualizationFrame frame;
  frame.setSplashPath("");
  frame.initialize(QString::fromStdString(ros::package::getPath("vest_viz")) + "/rviz/model.rviz");
  frame.resize(1400, 880);
  frame.show();
  auto* const part = frame.findChild<QComboBox*>("part");
  ASSERT_NE(part, nullptr);
  const QWidget& panel = *part->parentWidget();
  ASSERT_TRUE(spin([&] { return !source.empty(); }));
  for (const char* name : {"pouch", "tube"}) {
    const std::string before = source;
    part->setCurrentText(name);
    click(panel, "Add");
    ASSERT_TRUE(spin([&] { return source != before; })) << name;
  }
  ASSERT_TRUE(spin([&] { return handles == 7; })) << "of the tube, which was added last";
  auto* const tree = frame.findChild<QTreeWidget*>("objects");
  ASSERT_NE(tree, nullptr);
  EXPECT_EQ(tree->topLevelItemCount(), 3) << "two objects and the hollow";

  // The last point, where it stands on the screen.
  rviz::RenderPanel& view = *frame.getManager()->getRenderPanel();
  spin([] { return false; }, 1.5);  // markers and textures
  const auto onScreen = [&] {
    const Ogre::Camera& camera = *view.getCamera();
    const Ogre::Vector4 p =
        camera.getProjectionMatrix() * camera.getViewMatrix() *
        Ogre::Vector4(static_cast<float>(end.x), static_cast<float>(end.y), static_cast<float>(end.z), 1.0f);
    return QPoint(static_cast<int>(static_cast<float>(view.width()) * (0.5f + 0.5f * p.x / p.w)),
                  static_cast<int>(static_cast<float>(view.height()) * (0.5f - 0.5f * p.y / p.w)));
  };
  const QPoint from = onScreen(), to = from + QPoint(30, -40);
  const auto mouse = [&](QEvent::Type type, QPoint at, Qt::MouseButton button, Qt::MouseButtons down) {
    QMouseEvent event(type, at, button, down, Qt::NoModifier);
    QApplication::sendEvent(&view, &event);
    // rviz looks what lies under the mouse once a frame.
    const auto frames = frame.getManager()->getFrameCount();
    spin([&] { return frame.getManager()->getFrameCount() >= frames + 2; });
  };
  const std::string before = source;
  mouse(QEvent::MouseMove, from, Qt::NoButton, Qt::NoButton);
  mouse(QEvent::MouseMove, from, Qt::NoButton, Qt::NoButton);
  mouse(QEvent::MouseButtonPress, from, Qt::LeftButton, Qt::LeftButton);
  for (int k = 1; k <= 4; ++k)
    mouse(QEvent::MouseMove, from + (to - from) * k / 4, Qt::NoButton, Qt::LeftButton);
  EXPECT_EQ(source, before) << "while the button is down nothing is edited";
  mouse(QEvent::MouseButtonRelease, to, Qt::LeftButton, Qt::NoButton);
  ASSERT_TRUE(spin([&] { return source != before; }));
  spin([&] { return (onScreen() - to).manhattanLength() <= 6; }, 3);
  EXPECT_LE((onScreen() - to).manhattanLength(), 6) << "it lies where it was dropped";
  if (!g_picture.isEmpty()) {
    spin([] { return false; }, 3.0);
    EXPECT_TRUE(QGuiApplication::primaryScreen()->grabWindow(frame.winId()).save(g_picture));
  }
  click(panel, "Undo");
  ASSERT_TRUE(spin([&] { return source == before; }));
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_modeller_view");
  QApplication application(argc, argv);
  // The tutorial's picture: --picture=FILE
  for (int i = 1; i < argc; ++i)
    if (QString(argv[i]).startsWith("--picture=")) vest::displays::g_picture = QString(argv[i]).mid(10);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
