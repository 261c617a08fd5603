#pragma once

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/render_panel.h>
#include <rviz/visualization_manager.h>
#include <QKeyEvent>
#include <QMainWindow>
#include <QMouseEvent>
#include <QTest>
#include <QWindow>

#include "../spin.h"

namespace vest::displays {

/// A real rviz view on the screen, that keys and mouse are given to. rviz bears one manager in a process.
class RvizView : public testing::Test {
 protected:
  ros::NodeHandle nh;
  static inline QMainWindow* window = nullptr;  ///< as in rviz: the view draws through a window inside it
  static inline rviz::RenderPanel* view = nullptr;
  static inline rviz::VisualizationManager* manager = nullptr;
  rviz::RenderPanel& panel = *view;

  static void SetUpTestSuite() {
    window = new QMainWindow;
    view = new rviz::RenderPanel;
    window->setCentralWidget(view);
    window->resize(720, 576);
    manager = new rviz::VisualizationManager(view);
    view->initialize(manager->getSceneManager(), manager);
    manager->initialize();
    manager->setFixedFrame("world");
    manager->startUpdate();
    window->show();
  }
  static void TearDownTestSuite() {
    manager->stopUpdate();
    delete manager;
    delete window;
  }

  void key(int k, QEvent::Type type, bool again = false) {
    QKeyEvent event(type, k, Qt::NoModifier, QString(), again);
    QApplication::sendEvent(&panel, &event);
  }
  void press(int k) { key(k, QEvent::KeyPress); }
  void release(int k) { key(k, QEvent::KeyRelease); }
  void mouse(QEvent::Type type, QPoint at, Qt::MouseButton button, Qt::MouseButtons down) {
    QMouseEvent event(type, at, button, down, Qt::NoModifier);
    QApplication::sendEvent(&panel, &event);
  }
  /// As from the window system: Qt finds the widget under the mouse by itself.
  void click(QPoint at) {
    QTest::mouseMove(window->windowHandle(), view->mapTo(window, at));
    QTest::mouseClick(window->windowHandle(), Qt::LeftButton, Qt::NoModifier, view->mapTo(window, at));
  }
  void drag(QPoint from, QPoint to, Qt::MouseButton button) {
    QWindow* const w = window->windowHandle();
    QTest::mouseMove(w, view->mapTo(window, from));
    QTest::mousePress(w, button, Qt::NoModifier, view->mapTo(window, from));
    for (int k = 1; k <= 4; ++k)
      QTest::mouseMove(w, view->mapTo(window, QPoint(from.x() + (to.x() - from.x()) * k / 4,
                                                     from.y() + (to.y() - from.y()) * k / 4)));
    QTest::mouseRelease(w, button, Qt::NoModifier, view->mapTo(window, to));
  }
};

}  // namespace vest::displays
