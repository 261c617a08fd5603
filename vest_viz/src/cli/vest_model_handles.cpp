// Handles of the organ that is drawn: interactive markers at its points and radii. Letting go of one is one
// edit by the service model/edit (docs/modelling.md).
#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <interactive_markers/interactive_marker_server.h>
#include <ros/ros.h>
#include <visualization_msgs/Marker.h>
#include <Eigen/Geometry>

#include <vest_msgs/EditModel.h>
#include <vest_msgs/StringStamped.h>

#include "vest_instruments/ros/node_help.h"
#include "vest_instruments/ros/service_call.h"
#include "vest_tissue/modelling/document.h"
#include "vest_tissue/modelling/handles.h"

namespace {

using Eigen::Vector3d;
using vest::modelling::Document;
using vest::modelling::Handle;
using visualization_msgs::InteractiveMarkerControl;
using visualization_msgs::InteractiveMarkerFeedback;
using visualization_msgs::Marker;
using Kind = Handle::Kind;

constexpr double kMoved = 1e-6;   // m: less is a click
constexpr double kBall = 0.0035;  // m, diameter of the largest ball
enum Menu : std::uint32_t { kInsert = 1, kRemove = 2 };

geometry_msgs::Point pointOf(const Vector3d& v) {
  geometry_msgs::Point p;
  p.x = v.x(), p.y = v.y(), p.z = v.z();
  return p;
}

std_msgs::ColorRGBA colourOf(Kind kind) {
  static const std::map<Kind, std::array<float, 3>> colours = {{Kind::Point, {1.0f, 0.85f, 0.1f}},
                                                               {Kind::Whole, {1.0f, 1.0f, 1.0f}},
                                                               {Kind::Direction, {0.4f, 0.9f, 0.4f}},
                                                               {Kind::Length, {0.2f, 0.75f, 1.0f}},
                                                               {Kind::Profile, {0.2f, 0.75f, 1.0f}}};
  std_msgs::ColorRGBA colour;
  const auto& c = colours.at(kind);
  colour.r = c[0], colour.g = c[1], colour.b = c[2], colour.a = 1.0f;
  return colour;
}

/// A ball that is dragged where its kind allows, with a menu.
visualization_msgs::InteractiveMarker markerOf(const Handle& handle) {
  visualization_msgs::InteractiveMarker marker;
  marker.header.frame_id = "world";
  marker.name = handle.path;
  marker.description.clear();
  marker.pose.position = pointOf(handle.place);
  marker.pose.orientation.w = 1;
  marker.scale = 0.01f;
  InteractiveMarkerControl control;
  control.name = "drag";
  control.always_visible = true;
  control.orientation_mode = InteractiveMarkerControl::FIXED;
  control.orientation.w = 1;
  control.interaction_mode = InteractiveMarkerControl::MOVE_3D;
  // An axis is the control's x; of a plane that is the normal.
  const auto along = [&](const Vector3d& x) {
    const auto q = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), x);
    control.orientation.x = q.x(), control.orientation.y = q.y(), control.orientation.z = q.z();
    control.orientation.w = q.w();
  };
  if (handle.kind == Kind::Length) {
    control.interaction_mode = InteractiveMarkerControl::MOVE_AXIS;
    along(handle.axis);
  } else if (handle.kind == Kind::Profile) {
    control.interaction_mode = InteractiveMarkerControl::MOVE_PLANE;
    along(handle.axis.cross(handle.across));
  }
  Marker ball;
  ball.type = handle.kind == Kind::Whole ? Marker::CUBE : Marker::SPHERE;
  ball.pose.orientation.w = 1;
  const double size = handle.kind == Kind::Whole ? 0.005 : handle.kind == Kind::Length ? 0.0025 : kBall;
  ball.scale.x = ball.scale.y = ball.scale.z = size;
  ball.color = colourOf(handle.kind);
  control.markers.push_back(ball);
  marker.controls.push_back(control);
  const auto add = [&](std::uint32_t id, const char* title) {
    visualization_msgs::MenuEntry entry;
    entry.id = id, entry.title = title;
    entry.command_type = visualization_msgs::MenuEntry::FEEDBACK;
    marker.menu_entries.push_back(entry);
  };
  if (!handle.insert_path.empty()) add(kInsert, "Insert one behind");
  if (!handle.remove_path.empty()) add(kRemove, "Remove");
  return marker;
}

class Handles {
 public:
  Handles() : server_("model/handles") {
    lines_ = handle_.advertise<Marker>("model/lines", 2, true);
    source_ = handle_.subscribe<vest_msgs::StringStamped>(
        "model/source", 2, [this](const vest_msgs::StringStamped::ConstPtr& msg) {
          text_ = msg->string;
          if (dragged_.empty()) show();  // handles that are made anew would be torn from the hand
        });
    selected_ = handle_.subscribe<vest_msgs::StringStamped>(
        "model/selected", 2, [this](const vest_msgs::StringStamped::ConstPtr& msg) {
          object_ = msg->string;
          dragged_.clear();
          show();
        });
  }

 private:
  /// The chosen object as the source has it now; empty text: none, or one without a shape of its own.
  void read() {
    own_.reset();
    alone_ = {};
    try {
      const Document source(text_);
      const std::string path = "/objects/" + object_;
      if (object_.empty() || !source.has(path) || source.has(path + "/mirror_of")) return;
      Document own(source.bytes(path));
      alone_ = vest::modelling::readAlone(own.text());
      own_.emplace(std::move(own));
    } catch (const std::exception& error) {
      ROS_WARN("handles of %s: %s", object_.c_str(), error.what());
    }
  }

  void show() {
    read();
    std::map<std::string, Handle> handles;
    if (own_)
      for (Handle& handle : vest::modelling::handlesOf(alone_)) handles.emplace(handle.path, handle);
    for (const auto& [path, handle] : handles_)
      if (handles.count(path) == 0) server_.erase(path);
    handles_ = std::move(handles);
    for (const auto& [path, handle] : handles_)
      server_.insert(
          markerOf(handle),
          [this](const visualization_msgs::InteractiveMarkerFeedbackConstPtr& said) { on(*said); });
    server_.applyChanges();
    draw(alone_, false);
  }

  /// rviz's mouse takes hold of what is in front: no line there may be.
  bool atHandle(const Vector3d& place) const {
    return std::any_of(handles_.begin(), handles_.end(),
                       [&](const auto& entry) { return (entry.second.place - place).norm() < 0.7 * kBall; });
  }

  /// @param dragging cross-sections too, which at rest are seen by the organ itself and would hide handles
  void draw(const vest::modelling::SceneSource& alone, bool dragging) {
    Marker marker;
    marker.header.frame_id = "world";
    marker.ns = "lines";
    marker.type = Marker::LINE_LIST;
    marker.pose.orientation.w = 1;
    marker.scale.x = 0.0005;
    marker.color.r = 1.0f, marker.color.g = 0.95f, marker.color.b = 0.5f, marker.color.a = 1.0f;
    if (!alone.objects.empty())
      for (const auto& line : vest::modelling::linesOf(alone)) {
        if (!dragging && (line.front() - line.back()).norm() < kMoved) continue;
        for (std::size_t i = 1; i < line.size(); ++i) {
          if (atHandle(0.5 * (line[i - 1] + line[i]))) continue;
          marker.points.push_back(pointOf(line[i - 1]));
          marker.points.push_back(pointOf(line[i]));
        }
      }
    marker.action = marker.points.empty() ? Marker::DELETE : Marker::ADD;
    lines_.publish(marker);
  }

  void on(const InteractiveMarkerFeedback& said) {
    const auto found = handles_.find(said.marker_name);
    if (found == handles_.end()) return;
    const Handle handle = found->second;
    const Vector3d place(said.pose.position.x, said.pose.position.y, said.pose.position.z);
    if (!place.allFinite()) return;
    switch (said.event_type) {
      case InteractiveMarkerFeedback::MOUSE_DOWN:
        dragged_ = handle.path;
        break;
      case InteractiveMarkerFeedback::POSE_UPDATE:
        preview(handle, place);
        break;
      case InteractiveMarkerFeedback::MOUSE_UP:
        dragged_.clear();
        if ((place - handle.place).norm() > kMoved)
          edit("set", handle.path, vest::modelling::valueAt(handle, place));
        break;
      case InteractiveMarkerFeedback::MENU_SELECT:
        if (said.menu_entry_id == kInsert && !handle.insert_path.empty())
          edit("insert", handle.insert_path, handle.insert_value);
        if (said.menu_entry_id == kRemove && !handle.remove_path.empty())
          edit("remove", handle.remove_path, "");
        break;
      default:
        break;
    }
  }

  /// Lines alone, as they would be: the organ follows when the handle is let go.
  void preview(const Handle& handle, const Vector3d& place) {
    if (!own_) return;
    try {
      const auto patch = own_->set(handle.path, vest::modelling::valueAt(handle, place));
      std::string text = own_->text();
      text.replace(patch.offset, patch.before.size(), patch.after);
      draw(vest::modelling::readAlone(text), true);
    } catch (const std::exception&) {
      // Not a shape: the lines stay where they were, and the edit will be refused.
    }
  }

  void edit(const std::string& op, const std::string& path, const std::string& value) {
    vest_msgs::EditModel call;
    call.request.op = op;
    call.request.path = "/objects/" + object_ + path;
    call.request.value = value;
    const bool answered = vest::ros_shell::callService(handle_.resolveName("model/edit"), call);
    if (!answered) ROS_WARN("model/edit does not answer");
    // What was taken comes by model/source. What was refused goes back: model/refused says why.
    if (!answered || !call.response.success) show();
  }

  ros::NodeHandle handle_;
  interactive_markers::InteractiveMarkerServer server_;
  ros::Publisher lines_;
  ros::Subscriber source_, selected_;
  std::string text_, object_, dragged_;
  std::optional<Document> own_;
  vest::modelling::SceneSource alone_;
  std::map<std::string, Handle> handles_;
};

}  // namespace

int main(int argc, char** argv) {
  return vest::ros_shell::runNode(
      argc, argv, "model_handles",
      "usage: rosrun vest_viz vest_model_handles\n"
      "Interactive markers of the object that model/selected names, under model/handles; letting go of\n"
      "one is an edit by the service model/edit of model_node (docs/modelling.md).",
      [] { return std::make_unique<Handles>(); });
}
