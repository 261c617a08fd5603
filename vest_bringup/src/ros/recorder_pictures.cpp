#include "vest_bringup/ros/recorder.h"

#include <algorithm>
#include <cmath>

#include <vest_msgs/ContactModels.h>
#include <opencv2/imgcodecs.hpp>

// What the recorder keeps as pictures.
namespace vest::session {

void Recorder::waitForPicture(const std::function<std::string()>& stop) {
  const double begin = steadySeconds();
  while (ros::ok() && stop().empty()) {
    {
      std::lock_guard<std::mutex> lock(image_mutex_);
      if (pictures_ > 0) return;
    }
    if (steadySeconds() - begin > picture_timeout_) {
      ROS_WARN("no picture on %s after %.0f s: the recording begins without one", image_.getTopic().c_str(),
               picture_timeout_);
      return;
    }
    publishStatus();
    ros::WallDuration(0.05).sleep();
  }
}

void Recorder::observeContacts(const Item& item) {
  // The most telling picture: tissue is held, and pulled hardest.
  if (item.msg->getMD5Sum() != ros::message_traits::md5sum<vest_msgs::ContactModels>()) return;
  const auto contacts = item.msg->instantiate<vest_msgs::ContactModels>();
  double force = -1;
  for (const vest_msgs::ContactModel& c : contacts->contacts) {
    if (!c.grasping) continue;
    const auto& f = c.wrench.force;
    force = std::max(force, std::sqrt(f.x * f.x + f.y * f.y + f.z * f.z));
  }
  grasping_ = force >= 0;
  if (force > 1.05 * best_force_) {
    std::lock_guard<std::mutex> lock(image_mutex_);
    if (!newest_picture_.empty() && newest_stamp_ > item.time.toSec() - PictureMoment::kLate) {
      best_force_ = force;
      best_picture_ = newest_picture_;
    }
  }
}

void Recorder::considerPicture() {
  cv::Mat picture;
  double stamp = 0;
  {
    std::lock_guard<std::mutex> lock(image_mutex_);
    picture = newest_picture_, stamp = newest_stamp_;
  }
  if (picture.empty() || first_step_time_ == 0) return;
  if (best_picture_.empty() && moments_ == 0)
    savePicture(picture, "endoscope.png");  // better than none, if it ends soon
  const double now = ros::Time::now().toSec();
  if (!moment_) moment_.emplace(now + 1.0);
  if (moments_ == 4) return;
  switch (moment_->look(now, stamp)) {
    case PictureMoment::Answer::Wait:
      return;
    case PictureMoment::Answer::Keep:
      ++moments_;
      savePicture(picture, "endoscope_" + std::to_string(moments_) + ".png");
      break;
    case PictureMoment::Answer::Missed:
      if (missed_++ == 0)
        ROS_WARN("%s: no picture shows a moment that was to be kept; such moments are left out",
                 image_.getTopic().c_str());
  }
  moment_.emplace(now + (grasping_ ? 2.0 : 4.0));
}

void Recorder::savePicture(const cv::Mat& picture, const std::string& name) {
  if (disk_full_) return;
  try {
    if (!cv::imwrite(directory_ + "/" + name, picture, {cv::IMWRITE_PNG_COMPRESSION, 1}))
      throw cv::Exception();
  } catch (const cv::Exception&) {
    ROS_ERROR_THROTTLE(5, "%s/%s cannot be written", directory_.c_str(), name.c_str());
    return;
  }
  if (std::find(summary_.pictures.begin(), summary_.pictures.end(), name) == summary_.pictures.end()) {
    summary_.pictures.push_back(name);
  }
}

}  // namespace vest::session
