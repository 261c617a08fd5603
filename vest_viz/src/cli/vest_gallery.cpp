// Makes the pictures of docs/gallery.md: the endoscopic view in several situations, each inspection mode,
// each panel. Everything shown is made up (effect_messages.h): no simulation runs. Needs a ROS master and a
// screen.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <OgreRenderWindow.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/display.h>
#include <rviz/ogre_helpers/render_system.h>
#include <rviz/panel.h>
#include <rviz/properties/property.h>
#include <rviz/render_panel.h>
#include <rviz/view_manager.h>
#include <rviz/visualization_manager.h>
#include <sensor_msgs/Joy.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/HapticState.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/OperatingState.h>
#include <vest_msgs/SessionState.h>
#include <CLI/CLI.hpp>
#include <QApplication>
#include <boost/make_shared.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <pluginlib/class_loader.hpp>

#include "conversion.h"
#include "effect_messages.h"
#include "endoscope_pipeline.h"
#include "scene_messages.h"
#include "vest_instruments/files/read.h"

namespace {

namespace tools = vest::tools;
namespace displays = vest::displays;
using Eigen::Vector3d;
using tools::Place;

std::string folder;
int pictures = 0;
std::vector<std::string> only;  // names of the pictures that are wanted; none: all
constexpr const char* kMoving = "uterus tube ovary ligament artery vein intestine";

vest::scene::Description shippedScene(const std::string& name) {
  return vest::scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/" + name + "/" + name +
                                ".yaml");
}

void save(const std::string& name, const cv::Mat& bgr) {
  const std::string path = folder + "/" + name + ".jpg";
  if (bgr.empty() || !cv::imwrite(path, bgr, {cv::IMWRITE_JPEG_QUALITY, 88}))
    throw std::runtime_error(path + ": cannot be written");
  std::printf("%s\n", vest::files::shown(path, 6000).c_str());
  ++pictures;
}

vest_msgs::InstrumentStates instrumentsFor(const Vector3d& endoscope) {
  vest_msgs::InstrumentStates m;
  m.header.stamp = ros::Time::now();
  m.header.frame_id = "world";
  m.instruments = {tools::instrumentAt(Place::Left, {-0.036, 0.050, 0.072}, 0.4, 0.12),
                   tools::instrumentAt(Place::Right, {0.030, 0.045, 0.075}, -0.3, 0.5),
                   tools::instrumentAt(Place::Endoscope, endoscope, 0, 0)};
  for (auto& i : m.instruments) i.source = vest_msgs::InstrumentState::SOURCE_BOX;
  return m;
}

/// Where the endoscope's tip is when it looks at the middle of what moves from a distance (m).
Vector3d lookAt(const vest::scene::Description& scene, double distance) {
  Vector3d middle = Vector3d::Zero();
  std::size_t knots = 0;
  for (const auto& o : scene.objects)
    if (o.model != vest::scene::ObjectModel::Rigid)
      for (const Vector3d& p : o.rest_position) middle += p, ++knots;
  if (knots > 0) middle /= static_cast<double>(knots);
  const Vector3d pivot = tools::endoscopeTip(0.0);
  return middle - distance * (middle - pivot).normalized();
}

/// The endoscopic view with some effects. @param sunk m: how far the cavity's wall hangs down
void endoscopic(const vest::scene::Description& scene, const std::string& name, const std::string& effects,
                const Vector3d& tip, int smoke = 1, double fog = 0.35, double focus = 0,
                bool with_instruments = true, double sunk = 0) {
  if (!only.empty() && std::find(only.begin(), only.end(), name) == only.end()) return;
  const std::set<std::string> words = tools::effectWords(effects);
  displays::EndoscopePipeline view(1);
  view.setCamera(vest::camera::fromFieldOfView(720, 576, 70 * M_PI / 180, {-0.18, 0.03, 0, 0, 0}), 1.0, 1.0);
  view.setSmokeMethod(static_cast<displays::EndoscopePipeline::Smoke>(smoke));
  vest::picture::CameraLook look;
  look.focus = focus;
  view.setLook(look);
  vest_msgs::TissueTopology topology = tools::topologyOf(scene);
  if (words.count("cut") != 0) tools::addCut(&topology);
  vest::mesh::Store store;
  store.setTopology(displays::toTopology(topology));
  if (words.count("fields") != 0) {
    vest_msgs::TissueState state;
    tools::addFields(scene, 4.0, &state);
    for (const vest_msgs::TissueField& m : state.fields)
      store.setField(1, {m.kind, m.minimum, m.maximum, m.data});
  }
  store.rebuildSkins();
  view.settle(store);
  vest_msgs::InstrumentStates instruments = instrumentsFor(tip);
  if (!with_instruments)  // made for the gynaecology scene
    instruments.instruments.erase(instruments.instruments.begin(), instruments.instruments.begin() + 2);
  view.setInstruments(instruments);
  if (words.count("clips") != 0)
    view.setAttachments(boost::make_shared<vest_msgs::TissueAttachments>(tools::attachmentsAt(scene)));
  if (words.count("sutures") != 0)
    view.setSutures(boost::make_shared<vest_msgs::SutureStates>(tools::suturesAt(scene, 0)));
  if (words.count("fluid") != 0)
    view.setFluid(boost::make_shared<vest_msgs::FluidState>(tools::fluidAt(scene, 2.2)));
  if (words.count("smoke") != 0)
    view.setSmoke(boost::make_shared<vest_msgs::SmokeState>(tools::smokeAt(scene, 2)));
  if (words.count("lens") != 0) view.setLens(boost::make_shared<vest_msgs::LensState>(tools::lensAt(fog)));
  Eigen::Isometry3d X_WO;
  displays::toOpticalFrame(instruments.instruments.back(), &X_WO);
  if (sunk > 0) {
    auto gas = boost::make_shared<vest_msgs::GasState>(tools::gasAt());
    gas->sunk = static_cast<float>(sunk);
    view.setGas(gas);
    cv::Mat first;
    view.draw(X_WO, 1.0, 0.05, &first);  // so that it knows where the lens is
    view.setTissue(store);
  }
  cv::Mat rgb, bgr;
  for (int i = 0; i < 15; ++i) view.draw(X_WO, 1.0, 0.05, &rgb);
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  save(name, bgr);
}

/// Publishers of everything that displays and panels listen to.
class Feed {
 public:
  explicit Feed(const vest::scene::Description& scene) : scene_(scene) { tellTopology(); }
  void tellTopology() {
    vest_msgs::TissueTopology topology = tools::topologyOf(scene_);
    tools::addCut(&topology);
    topology_.publish(topology);
  }
  void publish(double t) {
    vest_msgs::TissueState state;
    state.header.stamp = ros::Time::now();
    state.header.frame_id = "world";
    state.revision = 1;
    for (const auto& o : scene_.objects)
      for (std::size_t i = 0; i < o.rest_position.size(); ++i) {
        const Vector3d& p = i < o.position.size() ? o.position[i] : o.rest_position[i];
        for (int k = 0; k < 3; ++k) state.positions.push_back(static_cast<float>(p[k]));
      }
    tools::addFields(scene_, 4, &state);
    state_.publish(state);
    const vest_msgs::InstrumentStates instruments = instrumentsFor(tools::endoscopeTip(0.1));
    vest_msgs::ContactModels contacts;
    contacts.header = state.header;
    for (const auto& i : instruments.instruments) {
      if (i.name == "endoscope") continue;
      vest_msgs::ContactModel c;
      c.instrument = i.name;
      c.in_contact = true;
      c.proxy = i.tip;
      c.wrench.force.z = 1.6, c.wrench.force.x = i.name == "left" ? 0.7 : -0.7;
      vest_msgs::ContactPlane plane;
      plane.normal.z = 1, plane.offset = i.tip.position.z - 0.002;
      c.planes = {plane};
      contacts.contacts.push_back(c);
    }
    contacts_.publish(contacts);
    attachments_.publish(tools::attachmentsAt(scene_));
    sutures_.publish(tools::suturesAt(scene_, t));
    publishFluid(t);
    smoke_.publish(tools::smokeAt(scene_, t));
    publishSmall(t);
  }
  void publishFluid(double t) { fluid_.publish(tools::fluidAt(scene_, t)); }
  /// What the panels show, but the fluids.
  void publishSmall(double t) {
    vest_msgs::HaemodynamicsState monitor = tools::haemodynamicsAt(t);
    monitor.header.stamp = begin_ + ros::Duration(t);
    monitor_.publish(monitor);
    vest_msgs::GasState gas = tools::gasAt();
    gas.header.stamp = monitor.header.stamp;
    gas_.publish(gas);
    vest_msgs::InstrumentStates instruments = instrumentsFor(tools::endoscopeTip(0.1));
    instruments.instruments[0].functions = vest_msgs::InstrumentState::FUNCTION_COAGULATE;
    for (auto& i : instruments.instruments) i.valid = true;
    instruments_.publish(instruments);
    vest_msgs::OperatingState operating;
    operating.state = "ENABLED";
    operating.is_homed = true;
    operating_.publish(operating);
    vest_msgs::SessionState session;
    session.state = vest_msgs::SessionState::RUNNING;
    session.scene = scene_.name;
    session.step = static_cast<std::uint64_t>(1000 * t), session.simulated_time = t;
    session.real_time_factor = 1.0, session.step_cpu_time = 430e-6;
    session_.publish(session);
    sensor_msgs::Joy pedals;
    pedals.buttons = {1, 0, 0, 0, 0, 0};
    pedals_.publish(pedals);
    vest_msgs::HapticState haptic;
    haptic.device = "phantom", haptic.instrument = "left";
    haptic.force_true.z = 1.4 + 0.3 * std::sin(3 * t), haptic.force_rendered.z = 1.3 + 0.3 * std::sin(3 * t);
    haptic.model_age = 0.003, haptic.tick_rate = 1000, haptic.energy = 0.002;
    haptic_.publish(haptic);
  }

 private:
  const vest::scene::Description& scene_;
  ros::NodeHandle handle_;
  ros::Publisher topology_ = handle_.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  ros::Publisher state_ = handle_.advertise<vest_msgs::TissueState>("tissue/state", 1);
  ros::Publisher instruments_ = handle_.advertise<vest_msgs::InstrumentStates>("instruments", 1);
  ros::Publisher contacts_ = handle_.advertise<vest_msgs::ContactModels>("tissue/contacts", 1);
  ros::Publisher attachments_ = handle_.advertise<vest_msgs::TissueAttachments>("tissue/attachments", 1);
  ros::Publisher sutures_ = handle_.advertise<vest_msgs::SutureStates>("tissue/sutures", 1);
  ros::Publisher fluid_ = handle_.advertise<vest_msgs::FluidState>("effects/fluid", 1);
  ros::Publisher smoke_ = handle_.advertise<vest_msgs::SmokeState>("effects/smoke", 1);
  ros::Publisher gas_ = handle_.advertise<vest_msgs::GasState>("effects/gas", 1);
  ros::Publisher monitor_ = handle_.advertise<vest_msgs::HaemodynamicsState>("effects/haemodynamics", 1);
  ros::Publisher session_ = handle_.advertise<vest_msgs::SessionState>("session/state", 1);
  ros::Publisher pedals_ = handle_.advertise<sensor_msgs::Joy>("phantom_box/footswitches", 1);
  ros::Publisher operating_ = handle_.advertise<vest_msgs::OperatingState>("left/operating_state", 1);
  ros::Time begin_ = ros::Time::now();
  ros::Publisher haptic_ = handle_.advertise<vest_msgs::HapticState>("haptics/phantom/state", 1);
};

void pump(Feed* feed, double seconds) {
  static double t = 0;
  const ros::SteadyTime end = ros::SteadyTime::now() + ros::WallDuration(seconds);
  while (ros::SteadyTime::now() < end) {
    feed->publish(t);
    t += 0.04;
    for (int i = 0; i < 4; ++i) {
      QApplication::processEvents();
      ros::spinOnce();
      ros::WallDuration(0.01).sleep();
    }
  }
}

/// For panels: 50 messages a second of the time that they show, however slow this machine is.
void pumpSmall(Feed* feed, double seconds) {
  static double t = 0;
  for (const double end = t + seconds; t < end; t += 0.02) {
    feed->publishSmall(t);
    if (std::fmod(t, 0.5) < 0.02) feed->publishFluid(t);
    ros::WallDuration(0.004).sleep();
    QApplication::processEvents();
    ros::spinOnce();
  }
}

void inspection(const vest::scene::Description& scene) {
  rviz::RenderPanel panel;
  panel.resize(900, 640);
  rviz::VisualizationManager manager(&panel);
  panel.initialize(manager.getSceneManager(), &manager);
  panel.show();
  manager.initialize();
  manager.setFixedFrame("world");
  manager.startUpdate();
  Feed feed(scene);
  rviz::Property* view = manager.getViewManager()->getCurrent();
  view->subProp("Distance")->setValue(0.26);
  view->subProp("Pitch")->setValue(0.85);
  view->subProp("Yaw")->setValue(-1.571);
  view->subProp("Near Clip Distance")->setValue(0.005);
  view->subProp("Focal Point")->subProp("Y")->setValue(0.045);
  view->subProp("Focal Point")->subProp("Z")->setValue(0.06);
  rviz::Display* tissue = manager.createDisplay("vest_viz/Tissue", "tissue", true);
  tissue->subProp("Objects")->setValue(kMoving);
  tissue->subProp("Light")->setValue(2.5);
  pump(&feed, 3);
  const auto shoot = [&](const std::string& name, double wait) {
    pump(&feed, wait);
    const std::string file = folder + "/inspect.png";
    panel.getRenderWindow()->writeContentsToFile(file);
    const cv::Mat picture = cv::imread(file);
    std::filesystem::remove(file);
    save("inspect_" + name, picture);
  };
  shoot("look", 2);
  for (const char* by : {"strain", "stress", "temperature", "damage", "char", "perfusion", "bleeding",
                         "wetness", "material", "organ", "object", "layer"}) {
    tissue->subProp("Colour By")->setValue(by);
    shoot(by, 1);
  }
  rviz::Property* const slice = tissue->subProp("Slice");
  slice->setValue(true);
  slice->subProp("Normal")->subProp("X")->setValue(0.0);
  slice->subProp("Normal")->subProp("Y")->setValue(-1.0);
  slice->subProp("Offset")->setValue(-0.072);
  for (const char* by : {"look", "strain"}) {
    tissue->subProp("Colour By")->setValue(by);
    shoot(std::string("slice_") + by, 1);
  }
  slice->subProp("Offset")->setValue(-0.06);
  tissue->subProp("Objects")->setValue("");
  const vest::scene::Description volume = shippedScene("volume_phantom");
  Feed phantom(volume);
  view->subProp("Focal Point")->subProp("Y")->setValue(0.06);
  view->subProp("Focal Point")->subProp("Z")->setValue(0.045);
  view->subProp("Distance")->setValue(0.16);
  for (const char* by : {"material", "strain"}) {
    tissue->subProp("Colour By")->setValue(by);
    pump(&phantom, 2);
    shoot(std::string("slice_volume_") + by, 0);
  }
  slice->setValue(false);
  view->subProp("Focal Point")->subProp("Y")->setValue(0.045);
  view->subProp("Focal Point")->subProp("Z")->setValue(0.06);
  view->subProp("Distance")->setValue(0.26);
  tissue->subProp("Objects")->setValue(kMoving);
  feed.tellTopology();
  tissue->subProp("Colour By")->setValue("look");
  tissue->subProp("Surface")->setValue(false);
  tissue->subProp("Links")->setValue(true);
  shoot("links", 1);
  tissue->subProp("Surface")->setValue(true);
  tissue->subProp("Links")->setValue(false);
  tissue->subProp("Alpha")->setValue(0.5);
  rviz::Display* contacts = manager.createDisplay("vest_viz/Contacts", "contacts", true);
  contacts->subProp("Collision Shapes")->setValue(true);
  contacts->subProp("Scale")->setValue(0.02);
  shoot("contacts", 1.5);
  tissue->subProp("Alpha")->setValue(1.0);
  delete contacts;
  manager.createDisplay("vest_viz/Effects", "effects", true);
  shoot("effects", 1.5);

  manager.stopUpdate();  // panels need no drawing
  pluginlib::ClassLoader<rviz::Panel> loader("rviz", "rviz::Panel");
  for (const std::string& name : loader.getDeclaredClasses()) {
    if (name.rfind("vest_viz/", 0) != 0) continue;
    rviz::Panel* widget = loader.createUnmanagedInstance(name);
    widget->initialize(&manager);
    widget->show();
    pumpSmall(&feed, 1);
    // As small as it can be, and the table of the haptic devices as wide as its columns.
    widget->resize(name == "vest_viz/Haptics" ? 660 : std::max(440, widget->sizeHint().width()),
                   std::clamp(widget->minimumSizeHint().height(), 90, 220));
    pumpSmall(&feed, 6);
    if (name == "vest_viz/Haptics") pumpSmall(&feed, 6);  // it looks for devices each second
    const QString file = QString::fromStdString(folder + "/panel.png");
    widget->grab().save(file);
    const cv::Mat picture = cv::imread(file.toStdString());
    std::filesystem::remove(file.toStdString());
    save("panel_" + name.substr(9), picture);
    delete widget;
  }
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "vest_gallery");
  CLI::App app{"Makes the pictures of docs/gallery.md. Run it with a ROS master under xvfb-run."};
  bool no_inspection = false;
  app.add_option("output", folder, "folder of the pictures; made if it is not there")->required();
  app.add_flag("--no-inspection", no_inspection, "only the endoscopic view");
  app.add_option("--only", only, "names of pictures of the endoscopic view: these and no other");
  CLI11_PARSE(app, argc, argv);
  no_inspection = no_inspection || !only.empty();
  try {
    std::filesystem::create_directories(folder);
    QApplication application(argc, argv);
    ros::NodeHandle keep_alive;
    rviz::RenderSystem::get();
    const vest::scene::Description scene = shippedScene("gynaecology");
    const Vector3d over = tools::endoscopeTip(0.10), near(0.0, -0.012, 0.105), side(0.03, -0.012, 0.10);
    constexpr std::pair<const char*, double> kOthers[] = {{"arterial_bleeding", 0.075},
                                                          {"fem_slab", 0.075},
                                                          {"volume_phantom", 0.090},
                                                          {"irrigation_pool", 0.075},
                                                          {"smoke_lens", 0.075}};  // m from the lens
    for (const auto& [name, distance] : kOthers) {
      const vest::scene::Description other = shippedScene(name);
      const bool bleeds = name == std::string("arterial_bleeding");
      endoscopic(other, std::string("scene_") + name, bleeds ? "fields" : "", lookAt(other, distance), 1,
                 0.35, 0, false);
    }
    endoscopic(scene, "view_overview", "", over);
    endoscopic(scene, "view_close", "", near);
    endoscopic(scene, "view_fields", "fields", over);
    endoscopic(scene, "view_cut", "cut", near);
    endoscopic(scene, "view_clips_sutures", "clips,sutures", side);
    endoscopic(scene, "view_fluid", "fluid", over);
    endoscopic(scene, "view_smoke_field", "fields,smoke", over, 1);
    endoscopic(scene, "view_smoke_billboards", "fields,smoke", over, 2);
    endoscopic(scene, "view_lens", "lens", over, 1, 0.2);
    endoscopic(scene, "view_gas_lost", "", over, 1, 0.35, 0, true, 0.075);
    endoscopic(scene, "view_focus", "", near, 1, 0, 0.04);
    if (!no_inspection) inspection(scene);
    std::printf("%d pictures\n", pictures);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_gallery: %s\n", e.what());
    return 1;
  }
}
