#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <ros/node_handle.h>
#include <ros/this_node.h>
#include <rviz/config.h>
#include <rviz/panel.h>
#include <QStringList>

class QLabel;

namespace vest::panels {

/// Folders of a package's folder by name, such as the scenes that are shipped.
QStringList shipped(const std::string& package, const std::string& folder);

/// The session that a panel shows by default. @param own rviz's own namespace, e.g. "/left" @return own, but
/// "/vest" for "/" and "", where no session is
QString sessionNamespace(const std::string& own);

/// What all panels of VEST share: a namespace (rviz's own by default; another one is saved with the rviz
/// configuration), and service calls that never hold up the view. Messages arrive in the view's own thread.
class BasePanel : public rviz::Panel {
 public:
  explicit BasePanel(QWidget* parent = nullptr) : rviz::Panel(parent) { setMinimumWidth(kLeastWidth); }
  ~BasePanel() override;
  void onInitialize() override { connectTopics(); }
  void load(const rviz::Config& config) override;
  void save(rviz::Config config) const override;

 protected:
  /// Subscribes and advertises, relative to `nh()`; called again when the namespace changes.
  virtual void connectTopics() = 0;
  ros::NodeHandle nh() const { return ros::NodeHandle(namespace_.toStdString()); }
  /// Calls a service in a thread of its own, then `done` in the view's thread with an empty reason or why it
  /// failed.
  template <class Service>
  void call(const std::string& name, Service service,
            std::function<void(const Service&, const std::string&)> done);
  /// Last line of the panel: what was refused and why, in words of the node that refused.
  void tell(QLabel* line, const std::string& problem);

 private:
  struct Call {
    std::thread thread;
    std::shared_ptr<bool> finished;
  };
  void inView(std::function<void()> action);
  void collect();

  /// Pixels; without it a text that grows would push the docks beside it.
  static constexpr int kLeastWidth = 420;

  QString namespace_ = sessionNamespace(ros::this_node::getNamespace());
  std::vector<std::unique_ptr<Call>> calls_;
};

}  // namespace vest::panels

#include "base_panel_call.h"
