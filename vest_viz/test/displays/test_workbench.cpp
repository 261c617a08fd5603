// Protects the workbench: on a small and on a large screen the endoscope's picture is large, the 3-D view has
// room, and every panel is seen or has a tab that is seen.
#include <gtest/gtest.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/panel.h>
#include <rviz/render_panel.h>
#include <rviz/visualization_frame.h>
#include <rviz/visualization_manager.h>
#include <QApplication>
#include <QDockWidget>
#include <QLabel>
#include <QTabBar>
#include <QToolButton>

#include "../spin.h"

namespace vest::displays {
namespace {

/// Titles of tabs that are seen without scrolling.
QStringList tabsInSight(const QMainWindow& frame) {
  QStringList titles;
  for (const QTabBar* const bar : frame.findChildren<QTabBar*>()) {
    if (!bar->isVisible()) continue;
    for (const QToolButton* const scroll : bar->findChildren<QToolButton*>())
      EXPECT_FALSE(scroll->isVisible());
    for (int i = 0; i < bar->count(); ++i)
      if (bar->rect().contains(bar->tabRect(i))) titles << bar->tabText(i);
  }
  return titles;
}

/// Whether it lies in the frame; behind a tab it does not.
bool seen(const QDockWidget& dock, const QMainWindow& frame) {
  return dock.isVisible() && frame.rect().contains(dock.geometry());
}

struct Screen {
  QSize window;         ///< of the screen, less a task bar and a title
  QSize least_picture;  ///< that the endoscope's picture has to have
};

TEST(Workbench, FitsASmallAndALargeScreen) {
  rviz::VisualizationFrame frame;
  frame.setSplashPath("");
  frame.initialize(QString::fromStdString(ros::package::getPath("vest_viz")) + "/rviz/workbench.rviz");
  frame.show();
  // A number that grows takes nothing from the picture.
  for (rviz::Panel* const panel : frame.findChildren<rviz::Panel*>())
    for (QLabel* const label : panel->findChildren<QLabel*>())
      label->setText(label->text() + " 1000000 ml/min");
  // Up and down again: a window is maximised and restored.
  for (const Screen& screen : {Screen{{1366, 740}, {720, 576}}, Screen{{1920, 1040}, {1080, 864}},
                               Screen{{1366, 740}, {720, 576}}}) {
    SCOPED_TRACE(screen.window.width());
    frame.resize(screen.window);
    const auto picture = [&] {
      const auto* const dock = frame.findChild<QDockWidget*>("Endoscopic View");
      if (dock == nullptr || !seen(*dock, frame)) return QSize();
      return QSize(720, 576).scaled(dock->widget()->size(), Qt::KeepAspectRatio);
    };
    const QWidget& view = *frame.getManager()->getRenderPanel();
    spin([&] { return picture().width() >= screen.least_picture.width() && view.height() >= 160; }, 5);
    EXPECT_EQ(frame.size(), screen.window) << "something needs more room";
    EXPECT_GE(picture().width(), screen.least_picture.width());
    EXPECT_GE(picture().height(), screen.least_picture.height());
    EXPECT_GE(view.width(), 500);
    EXPECT_GE(view.height(), 160);
    const QStringList tabs = tabsInSight(frame);
    int panels = 0;
    for (const QDockWidget* const dock : frame.findChildren<QDockWidget*>()) {
      ++panels;
      EXPECT_TRUE(seen(*dock, frame) || tabs.contains(dock->windowTitle()))
          << dock->windowTitle().toStdString();
    }
    EXPECT_EQ(panels, 11);
    EXPECT_TRUE(seen(*frame.findChild<QDockWidget*>("Plots"), frame)) << "forces are in sight";
  }
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_workbench");
  QApplication application(argc, argv);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
