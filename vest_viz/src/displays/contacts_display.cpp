#include "contacts_display.h"

#include <algorithm>
#include <cmath>

#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/ogre_helpers/arrow.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/properties/string_property.h>
#include <Eigen/Geometry>
#include <pluginlib/class_list_macros.hpp>

#include "conversion.h"
#include "ogre_assets.h"
#include "ogre_versions.h"
#include "vest_instruments/tools/tool_geometry.h"

namespace vest::displays {
namespace {

using Eigen::Vector3d;

struct Tone {
  float r, g, b;
};
constexpr Tone kShape{0.35f, 0.75f, 0.95f}, kPoint{1.0f, 0.85f, 0.2f}, kPlane{0.4f, 0.9f, 0.5f},
    kProxy{1.0f, 0.5f, 0.9f}, kAnchor{1.0f, 1.0f, 1.0f};

class Pen {
 public:
  explicit Pen(Ogre::ManualObject* lines) : lines_(lines) {}
  void line(const Vector3d& a, const Vector3d& b, const Tone& tone) {
    if (!a.allFinite() || !b.allFinite()) return;
    for (const Vector3d* p : {&a, &b}) {
      lines_->position(static_cast<float>(p->x()), static_cast<float>(p->y()), static_cast<float>(p->z()));
      lines_->colour(tone.r, tone.g, tone.b);
    }
    ++count_;
  }
  void cross(const Vector3d& p, double size, const Tone& tone) {
    for (int k = 0; k < 3; ++k) line(p - size * Vector3d::Unit(k), p + size * Vector3d::Unit(k), tone);
  }
  void circle(const Vector3d& centre, const Vector3d& normal, double radius, const Tone& tone) {
    const Vector3d u =
        (std::fabs(normal.x()) < 0.8 ? normal.cross(Vector3d::UnitX()) : normal.cross(Vector3d::UnitY()))
            .normalized();
    const Vector3d v = normal.cross(u);
    constexpr int kParts = 16;
    for (int i = 0; i < kParts; ++i) {
      const double a = 2 * M_PI * i / kParts, b = 2 * M_PI * (i + 1) / kParts;
      line(centre + radius * (std::cos(a) * u + std::sin(a) * v),
           centre + radius * (std::cos(b) * u + std::sin(b) * v), tone);
    }
  }
  void capsule(const Eigen::Isometry3d& X, const tools::Capsule& c, const Tone& tone) {
    const Vector3d a = X * c.a, b = X * c.b;
    Vector3d axis = b - a;
    if (axis.norm() < 1e-9) axis = X.linear().col(2);
    axis.normalize();
    circle(a, axis, c.radius, tone);
    circle(b, axis, c.radius, tone);
    const Vector3d u =
        (std::fabs(axis.x()) < 0.8 ? axis.cross(Vector3d::UnitX()) : axis.cross(Vector3d::UnitY()))
            .normalized();
    for (int i = 0; i < 4; ++i) {
      const Vector3d d = Eigen::AngleAxisd(i * M_PI / 2, axis) * u * c.radius;
      line(a + d, b + d, tone);
    }
  }
  std::size_t count() const { return count_; }

 private:
  Ogre::ManualObject* lines_;
  std::size_t count_ = 0;
};

}  // namespace

ContactsDisplay::ContactsDisplay() {
  tissue_topic_ =
      new rviz::StringProperty("Tissue Topic", "tissue", "Prefix of contacts and attachments.", this);
  instruments_topic_ = new rviz::RosTopicProperty(
      "Instruments Topic", "instruments", "vest_msgs/InstrumentStates", "vest_msgs/InstrumentStates.", this);
  scale_ = new rviz::FloatProperty("Scale", 0.01f, "Length of an arrow, m per N.", this);
  scale_->setMin(0.0001f);
  forces_ = new rviz::BoolProperty("Forces", true, "Force of the tissue on each instrument.", this);
  planes_ = new rviz::BoolProperty(
      "Planes and Proxies", true,
      "Unilateral planes of the contact models, and the tip that the tissue feels.", this);
  points_ = new rviz::BoolProperty("Interaction Points", true, "INT_P1 … INT_P4 of each tool.", this);
  shapes_ = new rviz::BoolProperty("Collision Shapes", false, "Capsules of shaft, jaws and tips.", this);
  attachments_ = new rviz::BoolProperty("Attachments", true, "Grasps, clips, slings, stitches, holes.", this);
  for (rviz::StringProperty* p : {tissue_topic_, instruments_topic_})
    QObject::connect(p, &rviz::Property::changed, this, [this] { subscribe(); });
  for (rviz::Property* p :
       std::initializer_list<rviz::Property*>{scale_, forces_, planes_, points_, shapes_, attachments_})
    QObject::connect(p, &rviz::Property::changed, this, [this] { changed_ = true; });
}

ContactsDisplay::~ContactsDisplay() {
  contacts_sub_.shutdown();
  instruments_sub_.shutdown();
  attachments_sub_.shutdown();
  if (lines_ != nullptr) scene_manager_->destroyManualObject(lines_);
  if (material_.empty()) return;
  Ogre::MaterialPtr material = Ogre::MaterialManager::getSingleton().getByName(material_, kOgreGroup);
  drop(material);
}

void ContactsDisplay::onInitialize() {
  try {
    loadOgreMedia();
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Media", e.what());
    return;
  }
  material_ = uniqueName("contacts");
  const Ogre::MaterialPtr material = Ogre::MaterialManager::getSingleton().create(material_, kOgreGroup);
  material->setLightingEnabled(false);
  material->getTechnique(0)->getPass(0)->setDepthCheckEnabled(false);  // seen through tissue
  lines_ = scene_manager_->createManualObject(uniqueName("contacts"));
  lines_->setDynamic(true);
  lines_->setCastShadows(false);
  lines_->setRenderQueueGroup(Ogre::RENDER_QUEUE_MAIN + 30);
  scene_node_->attachObject(lines_);
}

void ContactsDisplay::onEnable() {
  subscribe();
}

void ContactsDisplay::onDisable() {
  contacts_sub_.shutdown();
  instruments_sub_.shutdown();
  attachments_sub_.shutdown();
}

void ContactsDisplay::reset() {
  rviz::Display::reset();
  contacts_message_.reset();
  instruments_message_.reset();
  attachments_message_.reset();
  changed_ = true;
  if (isEnabled()) subscribe();
}

void ContactsDisplay::subscribe() {
  if (!isEnabled()) return;
  const std::string tissue = tissue_topic_->getStdString();
  contacts_sub_ = update_nh_.subscribe<vest_msgs::ContactModels>(
      tissue + "/contacts", 1, [this](const vest_msgs::ContactModels::ConstPtr& m) {
        contacts_message_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
  attachments_sub_ = update_nh_.subscribe<vest_msgs::TissueAttachments>(
      tissue + "/attachments", 1, [this](const vest_msgs::TissueAttachments::ConstPtr& m) {
        attachments_message_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
  instruments_sub_ = update_nh_.subscribe<vest_msgs::InstrumentStates>(
      instruments_topic_->getStdString(), 1, [this](const vest_msgs::InstrumentStates::ConstPtr& m) {
        instruments_message_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
}

void ContactsDisplay::update(float, float) {
  if (lines_ == nullptr || !changed_) return;
  changed_ = false;
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  if (context_->getFrameManager()->getTransform(frame_, ros::Time(), position, orientation)) {
    scene_node_->setPosition(position);
    scene_node_->setOrientation(orientation);
    setStatusStd(rviz::StatusProperty::Ok, "Frame", frame_);
  } else {
    setStatusStd(rviz::StatusProperty::Warn, "Frame", "no transform from " + frame_);
  }
  left_out_ = 0;
  draw();
  std::size_t touching = 0;
  if (contacts_message_)
    for (const auto& c : contacts_message_->contacts) touching += c.in_contact;
  if (!contacts_message_)
    setStatus(rviz::StatusProperty::Warn, "Contacts", "no message yet");
  else
    setStatus(left_out_ > 0 ? rviz::StatusProperty::Warn : rviz::StatusProperty::Ok, "Contacts",
              QString("step %1, %2 instruments touch%3")
                  .arg(contacts_message_->step)
                  .arg(touching)
                  .arg(left_out_ > 0 ? QString(", %1 left out: not finite").arg(left_out_) : QString()));
  context_->queueRender();
}

void ContactsDisplay::drawForces() {
  std::size_t used = 0;
  if (contacts_message_ && forces_->getBool())
    for (const vest_msgs::ContactModel& c : contacts_message_->contacts) {
      Eigen::Isometry3d X;
      const Vector3d F(c.wrench.force.x, c.wrench.force.y, c.wrench.force.z);
      if (!c.in_contact) continue;
      if (!toPose(c.proxy, &X) || !F.allFinite()) {
        ++left_out_;
        continue;
      }
      if (F.norm() < 1e-3) continue;
      if (used == arrows_.size()) {
        arrows_.push_back(std::make_unique<rviz::Arrow>(scene_manager_, scene_node_));
        arrows_.back()->setColor(0.95f, 0.25f, 0.15f, 1.0f);
      }
      rviz::Arrow& arrow = *arrows_[used++];
      const auto length = static_cast<float>(std::clamp(F.norm() * scale_->getFloat(), 0.002, 0.3));
      arrow.set(0.75f * length, 0.0012f, 0.25f * length, 0.0032f);
      arrow.setPosition(Ogre::Vector3(static_cast<float>(X.translation().x()),
                                      static_cast<float>(X.translation().y()),
                                      static_cast<float>(X.translation().z())));
      const Vector3d d = F.normalized();
      arrow.setDirection(
          Ogre::Vector3(static_cast<float>(d.x()), static_cast<float>(d.y()), static_cast<float>(d.z())));
      arrow.getSceneNode()->setVisible(true);
    }
  for (std::size_t i = used; i < arrows_.size(); ++i) arrows_[i]->getSceneNode()->setVisible(false);
}

void ContactsDisplay::draw() {
  drawForces();
  lines_->clear();
  lines_->begin(material_, Ogre::RenderOperation::OT_LINE_LIST, kOgreGroup);
  line_count_ = 0;
  drawShapes();
  drawAttachments();
  if (line_count_ == 0) {  // an empty section is an error for OGRE
    lines_->position(0, 0, 0);
    lines_->position(0, 0, 0);
  }
  lines_->end();
}

void ContactsDisplay::drawShapes() {
  Pen pen(lines_);
  if (contacts_message_ && planes_->getBool())
    for (const vest_msgs::ContactModel& c : contacts_message_->contacts) {
      Eigen::Isometry3d X;
      if (!c.in_contact || !toPose(c.proxy, &X)) continue;
      pen.cross(X.translation(), 0.003, kProxy);
      for (const vest_msgs::ContactPlane& plane : c.planes) {
        const Vector3d n(plane.normal.x, plane.normal.y, plane.normal.z);
        if (!n.allFinite() || std::fabs(n.norm() - 1) > 0.01 || !std::isfinite(plane.offset)) continue;
        const Vector3d foot = X.translation() + (plane.offset - n.dot(X.translation())) * n;
        pen.circle(foot, n, 0.006, kPlane);
        pen.line(foot, foot + 0.006 * n, kPlane);
      }
    }
  if (instruments_message_)
    for (const vest_msgs::InstrumentState& s : instruments_message_->instruments) {
      Eigen::Isometry3d X;
      if (s.tool >= tools::kToolKindCount || !toPose(s.tip, &X)) continue;
      const tools::ToolGeometry& g = tools::toolGeometry(static_cast<tools::ToolKind>(s.tool));
      if (points_->getBool())
        for (const Vector3d& p : g.interaction_points) pen.cross(X * p, 0.0015, kPoint);
      if (!shapes_->getBool()) continue;
      const Vector3d pivot(s.shaft.position.x, s.shaft.position.y, s.shaft.position.z);
      if (pivot.allFinite())
        pen.capsule(Eigen::Isometry3d::Identity(), {pivot, X * Vector3d(0, 0, -g.jaw_length), g.shaft_radius},
                    kShape);
      for (const tools::Capsule& c : g.fixed) pen.capsule(X, c, kShape);
      const double jaw = std::isfinite(s.joint_position[4]) ? s.joint_position[4] : 0.0;
      for (int side = 0; side < 2; ++side) {
        Eigen::Isometry3d X_Jaw = X * Eigen::Translation3d(0, 0, -g.jaw_length);
        X_Jaw.rotate(Eigen::AngleAxisd((side == 0 ? 0.5 : -0.5) * jaw, Vector3d::UnitY()));
        for (const tools::Capsule& c : g.jaw[static_cast<std::size_t>(side)]) pen.capsule(X_Jaw, c, kShape);
      }
    }
  line_count_ += pen.count();
}

void ContactsDisplay::drawAttachments() {
  if (!attachments_message_ || !attachments_->getBool()) return;
  Pen pen(lines_);
  for (const vest_msgs::TissueAttachment& a : attachments_message_->attachments) {
    Eigen::Isometry3d X;
    if (!toPose(a.pose, &X)) {
      ++left_out_;
      continue;
    }
    pen.cross(X.translation(), 0.001, kAnchor);
    pen.circle(X.translation(), X.linear().col(2),
               a.kind == vest_msgs::TissueAttachment::GRASP ? 0.003 : 0.002,
               a.kind == vest_msgs::TissueAttachment::GRASP ? kProxy : kAnchor);
  }
  line_count_ += pen.count();
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::ContactsDisplay, rviz::Display)
