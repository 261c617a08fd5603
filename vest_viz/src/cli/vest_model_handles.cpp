// Handles of the organ that is drawn: interactive markers at its points and radii. Letting go of one is one
// edit by the service model/edit (docs/modelling.md).
#include <algorithm>
#include <array>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <interactive_markers/interactive_marker_server.h>
#include <ros/ros.h>
#include <visualization_msgs/Marker.h>
#include <Eigen/Geometry>

#include <vest_msgs/EditModel.h>
#include <vest_msgs/StringStamped.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>

#include "vest_instruments/ros/frames.h"
#include "vest_instruments/ros/node_help.h"
#include "vest_instruments/ros/service_call.h"
#include "vest_tissue/modelling/document.h"
#include "vest_tissue/modelling/handles.h"
#include "vest_tissue/modelling/ties.h"

namespace {

using Eigen::Vector3d;
using vest::modelling::Document;
using vest::modelling::Handle;
using vest::modelling::Laid;
using vest::modelling::Tie;
using visualization_msgs::InteractiveMarkerControl;
using visualization_msgs::InteractiveMarkerFeedback;
using visualization_msgs::Marker;
using Kind = Handle::Kind;

constexpr double kMoved = 1e-6;   // m: less is a click
constexpr double kBall = 0.0035;  // m, diameter of the largest ball
enum Menu : std::uint32_t { kInsert = 1, kRemove = 2, kTie = 3 };

std_msgs::ColorRGBA colour(float red, float green, float blue) {
  std_msgs::ColorRGBA c;
  c.r = red, c.g = green, c.b = blue, c.a = 1.0f;
  return c;
}
const std_msgs::ColorRGBA kTieColour = colour(1.0f, 0.45f, 0.05f), kLineColour = colour(1.0f, 0.95f, 0.5f);

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
  const auto& c = colours.at(kind);
  return colour(c[0], c[1], c[2]);
}

/// @param width m
Marker lines(const char* name, double width, const std_msgs::ColorRGBA& colour) {
  Marker marker;
  marker.header.frame_id = vest::ros_shell::frameId("world");
  marker.ns = name;
  marker.type = Marker::LINE_LIST;
  marker.pose.orientation.w = 1;
  marker.scale.x = width;
  marker.color = colour;
  return marker;
}

/// What moves freely: its control has no mark yet.
visualization_msgs::InteractiveMarker freeMarker(const std::string& name, const Vector3d& place) {
  visualization_msgs::InteractiveMarker marker;
  marker.header.frame_id = vest::ros_shell::frameId("world");
  marker.name = name;
  marker.pose.position = pointOf(place);
  marker.pose.orientation.w = 1;
  marker.scale = 0.01f;
  InteractiveMarkerControl control;
  control.name = "drag";
  control.always_visible = true;
  control.orientation_mode = InteractiveMarkerControl::FIXED;
  control.orientation.w = 1;
  control.interaction_mode = InteractiveMarkerControl::MOVE_3D;
  marker.controls.push_back(control);
  return marker;
}

void addEntry(visualization_msgs::InteractiveMarker& marker, std::uint32_t id, const char* title) {
  visualization_msgs::MenuEntry entry;
  entry.id = id, entry.title = title;
  entry.command_type = visualization_msgs::MenuEntry::FEEDBACK;
  marker.menu_entries.push_back(entry);
}

/// A ball that is dragged where its kind allows, with a menu.
visualization_msgs::InteractiveMarker markerOf(const Handle& handle, bool tied) {
  visualization_msgs::InteractiveMarker marker = freeMarker(handle.path, handle.place);
  InteractiveMarkerControl& control = marker.controls.front();
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
  if (!handle.insert_path.empty()) addEntry(marker, kInsert, "Insert one behind");
  if (!handle.remove_path.empty()) addEntry(marker, kRemove, "Remove");
  if (tied) addEntry(marker, kTie, "Tie to the nearest organ");
  return marker;
}

/// An end of a tie.
visualization_msgs::InteractiveMarker markerOf(const std::string& path, const Vector3d& place) {
  visualization_msgs::InteractiveMarker marker = freeMarker(path, place);
  Marker ball;
  ball.type = Marker::SPHERE;
  ball.pose.orientation.w = 1;
  ball.scale.x = ball.scale.y = ball.scale.z = 0.003;
  ball.color = kTieColour;
  marker.controls.front().markers.push_back(ball);
  addEntry(marker, kRemove, "Remove");
  return marker;
}

/// The objects of the scene that is built, where its state has them. Empty: the two do not belong together.
std::vector<Laid> laidOf(const vest_msgs::TissueTopology& topology, const vest_msgs::TissueState& state) {
  std::vector<Laid> scene;
  std::size_t knot = 0;
  for (const vest_msgs::TissueObject& object : topology.objects) {
    Laid laid{object.name, object.model == vest_msgs::TissueObject::MODEL_RIGID, {}, {}, {}};
    if (state.revision != topology.revision || state.positions.size() < 3 * (knot + object.knot_count))
      return {};
    for (std::uint32_t k = 0; k < object.knot_count; ++k, ++knot)
      laid.knots.emplace_back(state.positions[3 * knot], state.positions[3 * knot + 1],
                              state.positions[3 * knot + 2]);
    const auto known = [&](std::uint32_t k) { return k < object.knot_count; };
    if (!std::is_sorted(object.ring_start.begin(), object.ring_start.end()) ||
        (!object.ring_start.empty() && object.ring_start.back() > object.ring_knots.size()) ||
        !std::all_of(object.ring_knots.begin(), object.ring_knots.end(), known))
      return {};
    for (std::size_t r = 0; r + 1 < object.ring_start.size(); ++r)
      laid.rings.emplace_back(object.ring_knots.begin() + object.ring_start[r],
                              object.ring_knots.begin() + object.ring_start[r + 1]);
    if (object.knot_fixed.size() == object.knot_count) laid.fixed = object.knot_fixed;
    scene.push_back(std::move(laid));
  }
  return scene;
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
    topology_sub_ = handle_.subscribe<vest_msgs::TissueTopology>(
        "model/topology", 2, [this](const vest_msgs::TissueTopology::ConstPtr& msg) {
          topology_ = msg;
          lay();
        });
    state_sub_ = handle_.subscribe<vest_msgs::TissueState>(
        "model/state", 2, [this](const vest_msgs::TissueState::ConstPtr& msg) {
          state_ = msg;
          lay();
        });
  }

 private:
  void lay() {
    if (!topology_ || !state_) return;
    std::vector<Laid> scene = laidOf(*topology_, *state_);
    if (scene.empty()) return;  // the other of the two comes yet; until then ties stay where they are
    scene_ = std::move(scene);
    if (dragged_.empty()) show();
  }

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
    ties_.clear();
    // Branches of a tree are tied as one; that is written by hand.
    const bool tied = own_ && self() != nullptr && alone_.trees.empty() &&
                      vest::modelling::tieFrom(Vector3d::Zero(), *self(), scene_).has_value();
    if (own_)
      for (Handle& handle : vest::modelling::handlesOf(alone_)) handles.emplace(handle.path, handle);
    if (tied)
      for (const Tie& tie : vest::modelling::tiesOf(alone_.objects.front().connections, *self(), scene_)) {
        ties_.emplace(tie.path + "/rings", tie);
        ties_.emplace(tie.path + "/to", tie);
      }
    for (const std::string& path : shown_)
      if (handles.count(path) + ties_.count(path) == 0) server_.erase(path);
    shown_.clear();
    handles_ = std::move(handles);
    const auto said = [this](const visualization_msgs::InteractiveMarkerFeedbackConstPtr& feedback) {
      on(*feedback);
    };
    for (const auto& [path, handle] : handles_) {
      server_.insert(markerOf(handle, tied && handle.kind == Kind::Point), said);
      shown_.insert(path);
    }
    for (const auto& [path, tie] : ties_) {
      server_.insert(markerOf(path, isOwnEnd(path) ? tie.own : tie.other), said);
      shown_.insert(path);
    }
    server_.applyChanges();
    draw(alone_, false);
    drawTies();
  }

  static bool isOwnEnd(const std::string& path) { return path.back() == 's'; }  // …/rings, not …/to

  /// A line from end to end. Nothing is published where there was and is none.
  void drawTies() {
    if (ties_.empty() && !ties_drawn_) return;
    Marker marker = lines("ties", 0.0008, kTieColour);
    for (const auto& [path, tie] : ties_) {
      if (!isOwnEnd(path)) continue;
      marker.points.push_back(pointOf(tie.own));
      marker.points.push_back(pointOf(tie.other));
    }
    ties_drawn_ = !ties_.empty();
    publish(marker);
  }

  void publish(Marker& marker) {
    marker.action = marker.points.empty() ? Marker::DELETE : Marker::ADD;
    lines_.publish(marker);
  }

  /// rviz's mouse takes hold of what is in front: no line there may be.
  bool atHandle(const Vector3d& place) const {
    return std::any_of(handles_.begin(), handles_.end(),
                       [&](const auto& entry) { return (entry.second.place - place).norm() < 0.7 * kBall; });
  }

  /// @param dragging cross-sections too, which at rest are seen by the organ itself and would hide handles
  void draw(const vest::modelling::SceneSource& alone, bool dragging) {
    Marker marker = lines("lines", 0.0005, kLineColour);
    if (!alone.objects.empty())
      for (const auto& line : vest::modelling::linesOf(alone)) {
        if (!dragging && (line.front() - line.back()).norm() < kMoved) continue;
        for (std::size_t i = 1; i < line.size(); ++i) {
          if (atHandle(0.5 * (line[i - 1] + line[i]))) continue;
          marker.points.push_back(pointOf(line[i - 1]));
          marker.points.push_back(pointOf(line[i]));
        }
      }
    publish(marker);
  }

  /// The chosen object as it is built; none: it is not in the scene yet.
  const Laid* self() const {
    const auto found =
        std::find_if(scene_.begin(), scene_.end(), [this](const Laid& o) { return o.name == object_; });
    return found == scene_.end() ? nullptr : &*found;
  }

  /// An end of a tie: on its own side it goes to other rings, on the other side to another organ.
  void onTie(const std::string& path, const Tie& tie, const InteractiveMarkerFeedback& said,
             const Vector3d& place) {
    if (said.event_type == InteractiveMarkerFeedback::MOUSE_DOWN) dragged_ = path;
    if (said.event_type == InteractiveMarkerFeedback::MENU_SELECT && said.menu_entry_id == kRemove)
      return edit("remove", tie.path, "");
    if (said.event_type != InteractiveMarkerFeedback::MOUSE_UP) return;
    dragged_.clear();
    const bool own = isOwnEnd(path);
    if (self() == nullptr) return;
    if ((place - (own ? tie.own : tie.other)).norm() <= kMoved) return;
    edit("set", tie.path,
         vest::modelling::textOf(own ? vest::modelling::ownEndAt(tie, place, *self(), scene_)
                                     : vest::modelling::otherEndAt(tie, place, *self(), scene_)));
  }

  void tieAt(const Vector3d& place) {
    const auto rule = vest::modelling::tieFrom(place, *self(), scene_);
    if (!rule) return;
    const std::string value = vest::modelling::textOf(*rule);
    if (own_->has("/connect"))
      edit("insert", "/connect/-", value);
    else
      edit("set", "/connect", "[" + value + "]");
  }

  void on(const InteractiveMarkerFeedback& said) {
    const Vector3d place(said.pose.position.x, said.pose.position.y, said.pose.position.z);
    if (!place.allFinite()) return;
    if (const auto tie = ties_.find(said.marker_name); tie != ties_.end())
      return onTie(std::string(tie->first), Tie(tie->second), said, place);
    const auto found = handles_.find(said.marker_name);
    if (found == handles_.end()) return;
    const Handle handle = found->second;
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
        if (said.menu_entry_id == kTie && self() != nullptr && own_) tieAt(handle.place);
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
  ros::Subscriber source_, selected_, topology_sub_, state_sub_;
  vest_msgs::TissueTopology::ConstPtr topology_;
  vest_msgs::TissueState::ConstPtr state_;
  std::vector<Laid> scene_;  // empty: not heard yet
  std::string text_, object_, dragged_;
  std::optional<Document> own_;
  vest::modelling::SceneSource alone_;
  std::map<std::string, Handle> handles_;
  std::map<std::string, Tie> ties_;  // by the path of an end
  std::set<std::string> shown_;
  bool ties_drawn_ = false;
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
