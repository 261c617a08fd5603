#pragma once

#include <functional>

#include <ros/ros.h>
#include <QApplication>

namespace vest {

/// Lets ROS and Qt work until `done`, or for some seconds; whether it was done.
inline bool spin(const std::function<bool()>& done, double seconds = 15.0) {
  const ros::SteadyTime end = ros::SteadyTime::now() + ros::WallDuration(seconds);
  while (ros::SteadyTime::now() < end) {
    ros::spinOnce();
    QApplication::processEvents(QEventLoop::AllEvents, 5);
    if (done()) return true;
    ros::WallDuration(0.002).sleep();
  }
  return false;
}

}  // namespace vest
