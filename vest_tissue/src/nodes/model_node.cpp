// The modeller: a source that is edited by a service, and the organs that it bakes to.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include <ros/ros.h>

#include <vest_msgs/EditModel.h>
#include <vest_msgs/LoadScene.h>
#include <vest_msgs/ModelEdit.h>
#include <vest_msgs/StringStamped.h>

#include "vest_instruments/files/read.h"
#include "vest_instruments/ros/node_help.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/session.h"
#include "vest_tissue/ros/drawn_scene.h"
#include "vest_tissue/ros/parameters.h"
#include "vest_tissue/scene/world.h"

namespace {

namespace fs = std::filesystem;
using vest::modelling::Edit;
using vest::modelling::Session;

/// A folder for scenes that run and are not saved; it goes with the node.
class Trials {
 public:
  Trials() {
    std::string pattern = fs::temp_directory_path() / "vest_model_XXXXXX";
    if (mkdtemp(pattern.data()) == nullptr)
      throw std::runtime_error(pattern + ": no folder can be made there");
    path_ = pattern;
  }
  ~Trials() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Trials(const Trials&) = delete;
  Trials& operator=(const Trials&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// The file that a drawing begins with: its own, else another one; empty: neither is there.
std::string beginOf(const std::string& source, const std::string& start) {
  if (source.empty()) throw std::invalid_argument("~source: must be the file of a source");
  if (fs::exists(source)) return source;
  if (start.empty()) return {};
  if (!fs::exists(start)) throw std::invalid_argument("~start: " + start + ": there is no such file");
  return start;
}

/// What is there, or a hollow without organs.
std::string startOf(const std::string& begin, const std::string& source) {
  if (!begin.empty()) return vest::scene::yaml::readFile(begin, vest::scene::yaml::kMaxBytes);
  const std::string folder = fs::absolute(source).parent_path().filename().string();
  return "vest_source: 1\nname: " + (folder.empty() ? "drawn" : folder) +
         "\nobjects: []\ninclude:\n  - {part: hollow}\n";
}

class ModelNode {
 public:
  ModelNode()
      : source_(vest::ros_shell::stringParameter(ros::NodeHandle("~"), "source", "")),
        begin_(beginOf(source_, vest::ros_shell::stringParameter(ros::NodeHandle("~"), "start", ""))),
        // Parts lie beside the file that it begins with; the name is that of the file that is saved.
        session_(begin_.empty() || begin_ == source_
                     ? source_
                     : (fs::absolute(begin_).parent_path() / fs::path(source_).filename()).string(),
                 startOf(begin_, source_), vest::modelling::readMaterials(vest::material::databasePath())) {
    edits_ = handle_.advertise<vest_msgs::ModelEdit>(
        "model/edits", 1000, [this](const ros::SingleSubscriberPublisher& to) { tellAll(to); });
    topology_ = handle_.advertise<vest_msgs::TissueTopology>("model/topology", 2, true);
    state_ = handle_.advertise<vest_msgs::TissueState>("model/state", 2, true);
    text_ = handle_.advertise<vest_msgs::StringStamped>("model/source", 2, true);
    refused_ = handle_.advertise<vest_msgs::StringStamped>("model/refused", 20);
    service_ = handle_.advertiseService("model/edit", &ModelNode::onEdit, this);
    publish();
  }

 private:
  static vest_msgs::ModelEdit toMsg(const Edit& edit) {
    vest_msgs::ModelEdit msg;
    msg.header.stamp = ros::Time::now();
    msg.seq = static_cast<std::uint32_t>(edit.seq);
    msg.op = edit.op, msg.path = edit.path, msg.before = edit.before, msg.after = edit.after;
    msg.hash = edit.hash;
    return msg;
  }

  /// Whoever comes late, a recorder too, is told how it began and what has been done since.
  void tellAll(const ros::SingleSubscriberPublisher& to) {
    for (const Edit& edit : session_.log()) to.publish(toMsg(edit));
  }

  void publish() {
    vest_msgs::TissueTopology topology = vest::ros_shell::topologyOf(session_.scene());
    topology.header.stamp = ros::Time::now();
    topology.revision = ++revision_;
    topology_.publish(topology);
    state_.publish(vest::ros_shell::stateOf(session_.scene(), topology));
    text_.publish(stamped(session_.text()));
  }

  static vest_msgs::StringStamped stamped(const std::string& text) {
    vest_msgs::StringStamped msg;
    msg.header.stamp = ros::Time::now();
    msg.string = text;
    return msg;
  }

  bool onEdit(vest_msgs::EditModel::Request& req, vest_msgs::EditModel::Response& res) {
    try {
      if (req.op == "save" || req.op == "run") {
        const bool run = req.op == "run";
        const std::string own = fs::absolute(source_).parent_path().string();
        const std::string file = vest::modelling::save(session_, run                ? trials_.path()
                                                                 : req.path.empty() ? own
                                                                                    : req.path);
        res.scene_hash = vest::scene::loadScene(file).hash;
        res.message = file;
        if (run) res.message = "runs in the session; " + load(file);
      } else if (req.op == "propose") {
        double within = 0;
        if (!vest::files::parseNumber(req.value, within))
          throw std::invalid_argument("value: " + vest::files::shown(req.value) + ": must be a number, m");
        for (const auto& p : session_.propose(req.path, within))
          res.message += (p.path.back() == '-' ? "insert " : "set ") + p.path + " " + p.value + "\n";
      } else {
        const Edit edit = session_.apply(req.op, req.path, req.value);
        publish();
        edits_.publish(toMsg(edit));
        res.message = "done";
      }
      res.success = true;
    } catch (const std::exception& error) {
      res.success = false;
      res.message = vest::files::shown(error.what(), 4000);
      refused_.publish(stamped(res.message));
    }
    res.seq = static_cast<std::uint32_t>(session_.log().back().seq);
    res.hash = session_.hash();
    return true;
  }

  /// @return how many objects went on
  std::string load(const std::string& file) {
    vest_msgs::LoadScene call;
    call.request.scene = file;
    if (!ros::service::call("tissue/edit_scene", call))
      throw std::runtime_error("tissue/edit_scene does not answer; allowed: a session that runs");
    if (!call.response.success) throw std::runtime_error(call.response.message);
    return call.response.message;
  }

  ros::NodeHandle handle_;
  std::string source_, begin_;
  Trials trials_;
  Session session_;
  std::uint32_t revision_ = 0;
  ros::Publisher edits_, topology_, state_, text_, refused_;
  ros::ServiceServer service_;
};

}  // namespace

int main(int argc, char** argv) {
  return vest::ros_shell::runNode(
      argc, argv, "model",
      "usage: rosrun vest_tissue model_node _source:=FILE [_start:=FILE]\n"
      "Draws organs: edits a source by the service model/edit, publishes what it bakes to under model/.\n"
      "A file that is not there begins as ~start, or as an empty hollow. Operations: docs/modelling.md.",
      [] { return std::make_unique<ModelNode>(); });
}
