#include "base_panel.h"

#include <algorithm>

#include <ros/package.h>
#include <QCoreApplication>
#include <QDir>
#include <QLabel>
#include <QMetaObject>

namespace vest::panels {

QStringList shipped(const std::string& package, const std::string& folder) {
  const QDir place(QString::fromStdString(ros::package::getPath(package) + "/" + folder));
  return place.entryList(QDir::Dirs | QDir::NoDotAndDotDot, QDir::Name);
}

QString sessionNamespace(const std::string& own) {
  return own.empty() || own == "/" ? "/vest" : QString::fromStdString(own);
}

BasePanel::~BasePanel() {
  // A box that loses the focus with the panel says that it was edited.
  for (QObject* const child : findChildren<QObject*>()) child->disconnect(this);
  // A call that waits for a node that died would hold rviz: services of one machine answer or fail at once.
  for (auto& one : calls_)
    if (one->thread.joinable()) one->thread.join();
}

void BasePanel::load(const rviz::Config& config) {
  rviz::Panel::load(config);
  QString name;
  if (config.mapGetString("Namespace", &name) && !name.isEmpty() && name != namespace_) {
    namespace_ = name;
    connectTopics();
  }
}

void BasePanel::save(rviz::Config config) const {
  rviz::Panel::save(config);
  if (namespace_ != sessionNamespace(ros::this_node::getNamespace()))
    config.mapSetValue("Namespace", namespace_);
}

void BasePanel::inView(std::function<void()> action) {
  // Posted to the panel: dropped with it when it is removed before.
  QMetaObject::invokeMethod(this, std::move(action), Qt::QueuedConnection);
}

void BasePanel::collect() {
  calls_.erase(std::remove_if(calls_.begin(), calls_.end(),
                              [](std::unique_ptr<Call>& one) {
                                if (!*one->finished) return false;
                                one->thread.join();
                                return true;
                              }),
               calls_.end());
}

void BasePanel::tell(QLabel* line, const std::string& problem) {
  line->setText(QString::fromStdString(problem));
  line->setVisible(!problem.empty());
}

}  // namespace vest::panels
