#include "endoscopic_view_display.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <OgreRenderWindow.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/panel_dock_widget.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/int_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/properties/tf_frame_property.h>
#include <rviz/render_panel.h>
#include <rviz/view_manager.h>
#include <rviz/window_manager_interface.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <tf2_ros/buffer.h>
#include <vest_msgs/SessionScore.h>
#include <vest_msgs/SessionState.h>
#include <vest_msgs/StringStamped.h>
#include <xmlrpcpp/XmlRpcClient.h>
#include <QMainWindow>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <pluginlib/class_list_macros.hpp>

#include "conversion.h"
#include "image_pane.h"
#include "steady_seconds.h"
#include "vest_instruments/ros/frames.h"
#include "vest_viz/picture/quality.h"

namespace vest::displays {
namespace {

constexpr double kLongestTick = 0.05;  // s: of rviz

constexpr double kLongestWait = 0.1;  // s that a picture waits for instruments
constexpr double kLooks = 0.5;        // s between looks whether the simulation is still there
constexpr double kLongestHold = 20;   // s without tissue or textures before pictures are sent all the same
constexpr double kDegree = 3.14159265358979323846 / 180;

/// Another node that publishes the topic and still answers; empty: none. Two views would publish twice.
std::string otherPublisher(const std::string& topic) {
  XmlRpc::XmlRpcValue args, answer, state;
  args[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", args, answer, state, false)) return {};
  for (int i = 0; i < state[0].size(); ++i) {
    if (static_cast<std::string>(state[0][i][0]) != topic) continue;
    for (int k = 0; k < state[0][i][1].size(); ++k) {
      const std::string node = state[0][i][1][k];
      XmlRpc::XmlRpcValue uri;
      args[1] = node;
      std::string host;
      std::uint32_t port = 0;
      if (node == ros::this_node::getName() ||
          !ros::master::execute("lookupNode", args, answer, uri, false) ||
          !ros::network::splitURI(uri, host, port))
        continue;
      XmlRpc::XmlRpcClient client(host.c_str(),
                                  static_cast<int>(port));  // one that was killed is still listed
      XmlRpc::XmlRpcValue who;
      who[0] = ros::this_node::getName();
      const bool alive = client.execute("getPid", who, answer);
      client.close();
      if (alive) return node;
    }
  }
  return {};
}

template <class P>
P* limited(P* property, double low, double high) {
  property->setMin(low);
  property->setMax(high);
  return property;
}

}  // namespace

EndoscopicViewDisplay::EndoscopicViewDisplay() {
  using rviz::FloatProperty;
  using rviz::IntProperty;
  using rviz::StringProperty;
  tissue_topic_ = new StringProperty(
      "Tissue Topic", "tissue", "Prefix of topology, topology_delta and state.", this, SLOT(updateTopics()));
  instruments_topic_ =
      new rviz::RosTopicProperty("Instruments Topic", "instruments", "vest_msgs/InstrumentStates",
                                 "vest_msgs/InstrumentStates.", this, SLOT(updateTopics()));
  image_topic_ = new StringProperty("Image Topic", "endoscope",
                                    "Prefix of image_raw, camera_info and image_raw/compressed.", this,
                                    SLOT(updateTopics()));
  optical_frame_ =
      new rviz::TfFrameProperty("Optical Frame", ros_shell::frameId("endoscope_optical_frame").c_str(),
                                "tf frame of the camera, for a session without the instruments topic.", this);
  width_ = new IntProperty("Width", 720, "Pixels.", this, SLOT(updateCamera()));
  width_->setMin(64);
  width_->setMax(4096);
  height_ = new IntProperty("Height", 576, "Pixels.", this, SLOT(updateCamera()));
  height_->setMin(64);
  height_->setMax(4096);
  field_of_view_ = limited(
      new FloatProperty("Field of View", 70, "Degrees, horizontal.", this, SLOT(updateCamera())), 10, 140);
  k1_ = limited(
      new FloatProperty("k1", -0.18f, "plumb_bob distortion; negative: barrel.", this, SLOT(updateCamera())),
      -0.3, 0.3);
  k2_ =
      limited(new FloatProperty("k2", 0.03f, "plumb_bob distortion.", this, SLOT(updateCamera())), -0.1, 0.1);
  calibration_ = new StringProperty("Calibration File", "",
                                    "YAML of camera_calibration; replaces size, field of view, k1 and k2.",
                                    this, SLOT(updateCamera()));
  circle_ = limited(new FloatProperty("Circle", 1.0f, "Radius of the round picture over half its height.",
                                      this, SLOT(updateCamera())),
                    0.3, 1.5);
  rate_ = limited(new FloatProperty("Frame Rate", 20, "Most pictures per second.", this), 0.2, 200);
  compressed_rate_ =
      limited(new FloatProperty("Compressed Rate", 10, "Most JPEG pictures per second.", this), 0.1, 200);
  quality_ = new rviz::EnumProperty(
      "Quality", "automatic",
      "automatic: as fine as the frame time allows. standard: all pixels. simple: half of the "
      "pixels and smaller textures. fine: more pixels than shown, for a graphics card.",
      this, SLOT(updateScene()));
  quality_->addOption("simple", 0);
  quality_->addOption("standard", 1);
  quality_->addOption("automatic", 2);
  quality_->addOption("fine", 3);
  fill_ = new rviz::BoolProperty(
      "Fill Window", false,
      "Lie over rviz's 3-D view, which is not drawn meanwhile: saves a second rendering.", this,
      SLOT(updatePlace()));
  pen_ = new rviz::EnumProperty("Draw", "off",
                                "What the left button of the mouse draws for the trainee, on every view.",
                                this, SLOT(updatePen()));
  for (const auto& [word, pen] : {std::pair("off", Stroke::None), std::pair("line", Stroke::Line),
                                  std::pair("arrow", Stroke::Arrow), std::pair("circle", Stroke::Circle)})
    pen_->addOption(word, static_cast<int>(pen));
  effects_topic_ = new StringProperty("Effects Topic", "effects", "Prefix of fluid, smoke and lens.", this,
                                      SLOT(updateTopics()));
  session_topic_ = new StringProperty("Session Topic", "session",
                                      "Prefix of recording, instruction, score, notes, drawing and targets: "
                                      "a recorder that ends without a word "
                                      "is told in red, an exercise tells what to do.",
                                      this, SLOT(updateTopics()));
  smoke_ = new rviz::EnumProperty("Smoke", "field",
                                  "field: density in space. billboards: puffs that face the camera.", this,
                                  SLOT(updateLook()));
  smoke_->addOption("off", 0);
  smoke_->addOption("field", 1);
  smoke_->addOption("billboards", 2);
  smoke_->addOption("both", 3);
  lamp_ = limited(
      new FloatProperty("Lamp", 5600, "Colour temperature of the light source, K.", this, SLOT(updateLook())),
      1500, 20000);
  white_ = limited(
      new FloatProperty("White Balance", 5600, "Colour temperature that the camera takes for white, K.", this,
                        SLOT(updateLook())),
      1500, 20000);
  noise_ = limited(
      new FloatProperty("Noise", 0, "Standard deviation in levels of 255.", this, SLOT(updateLook())), 0, 30);
  focus_ = limited(new FloatProperty("Focus", 0, "Distance in focus, m; 0: everything is sharp.", this,
                                     SLOT(updateLook())),
                   0, 1);
  print_timing_ =
      new rviz::BoolProperty("Print Timing", false, "Log milliseconds per stage every 2 s.", this);
}

EndoscopicViewDisplay::~EndoscopicViewDisplay() {
  input_.unsubscribe();
  waitForWorker();
  if (covered_ != nullptr && covered_->getRenderWindow() != nullptr)
    covered_->getRenderWindow()->setActive(true);
  if (pane_ != nullptr) pane_->cover(nullptr);
  delete dock_;
  delete pane_;
}

void EndoscopicViewDisplay::onInitialize() {
  optical_frame_->setFrameManager(context_->getFrameManager());
  pane_ = new ImagePane();
  updateScene();
  updatePlace();
}

void EndoscopicViewDisplay::updateScene() {
  if (!initialized() && pane_ == nullptr) return;
  waitForWorker();
  try {
    view_ = std::make_unique<EndoscopePipeline>(quality_->getOptionInt() == 0   ? 0
                                                : quality_->getOptionInt() == 3 ? 2
                                                                                : 1);
    updateCamera();
    updateLook();
    if (!input_.store().empty()) view_->setTissue(input_.store());
    if (instruments_) view_->setInstruments(*instruments_);
    effects_.again();
  } catch (const std::exception& e) {
    view_.reset();
    setStatusStd(rviz::StatusProperty::Error, "Media", e.what());
  }
}

void EndoscopicViewDisplay::updateLook() {
  if (!view_) return;
  picture::CameraLook look;
  look.lamp = lamp_->getFloat();
  look.white_balance = white_->getFloat();
  look.noise = noise_->getFloat();
  look.focus = focus_->getFloat();
  view_->setLook(look);
  view_->setSmokeMethod(static_cast<EndoscopePipeline::Smoke>(smoke_->getOptionInt()));
}

void EndoscopicViewDisplay::updatePen() {
  drawing_.setPen(static_cast<Stroke>(pen_->getOptionInt()));
}

void EndoscopicViewDisplay::updateCamera() {
  if (!view_) return;
  waitForWorker();
  camera_ = camera::fromFieldOfView(
      static_cast<std::uint32_t>(width_->getInt()), static_cast<std::uint32_t>(height_->getInt()),
      field_of_view_->getFloat() * kDegree, {k1_->getFloat(), k2_->getFloat(), 0, 0, 0});
  const std::string file = calibration_->getStdString();
  deleteStatus("Calibration");
  if (!file.empty()) {
    try {
      camera_ = camera::readCalibration(file);
    } catch (const std::exception& e) {
      setStatusStd(rviz::StatusProperty::Error, "Calibration", e.what());
    }
  }
  // Fewer pixels are drawn and the camera's resampling fills in.
  const int quality = quality_->getOptionInt();
  const double resolution = quality == 3   ? 1.8
                            : quality == 2 ? picture::kResolutions[level_]
                            : quality == 1 ? 1.0
                                           : 0.7;
  view_->setCamera(camera_, circle_->getFloat(), resolution);
}

void EndoscopicViewDisplay::updatePlace() {
  if (pane_ == nullptr || context_ == nullptr) return;
  rviz::ViewManager* views = context_->getViewManager();
  rviz::RenderPanel* panel = views != nullptr ? views->getRenderPanel() : nullptr;
  rviz::WindowManagerInterface* windows = context_->getWindowManager();
  const bool over = isEnabled() && fill_->getBool() && panel != nullptr;
  if (panel != nullptr && panel->getRenderWindow() != nullptr) panel->getRenderWindow()->setActive(!over);
  covered_ = over ? panel : nullptr;
  if (over) {
    if (dock_ != nullptr) {
      dock_->setContentWidget(nullptr);
      pane_->setParent(nullptr);
      delete dock_;
    }
    pane_->cover(panel);
    return;
  }
  pane_->cover(nullptr);
  if (dock_ == nullptr && windows != nullptr) {
    pane_->setParent(nullptr);
    dock_ = windows->addPane(getName().isEmpty() ? "Endoscopic View" : getName(), pane_);
    if (auto* const frame = qobject_cast<QMainWindow*>(windows->getParentWindow())) pane_->fillDockOf(frame);
  }
  if (dock_ != nullptr) dock_->setVisible(isEnabled());
}

void EndoscopicViewDisplay::onEnable() {
  updateTopics();
  updatePlace();
}

void EndoscopicViewDisplay::onDisable() {
  waitForWorker();
  input_.unsubscribe();
  instruments_sub_.shutdown();
  state_instruments_sub_.shutdown();
  effects_.unsubscribe();
  recorder_sub_.shutdown();
  for (ros::Subscriber* const sub : {&instruction_sub_, &score_sub_, &notes_sub_}) sub->shutdown();
  drawing_.shutdown();
  tellExercise([](ExerciseRim& rim) {
    rim.clear();
    return true;
  });
  image_pub_.shutdown();
  info_pub_.shutdown();
  compressed_pub_.shutdown();
  truth_.shutdown();
  updatePlace();
}

void EndoscopicViewDisplay::tellExercise(const std::function<bool(ExerciseRim&)>& change) {
  if (pane_ != nullptr) pane_->rim(change);
}

void EndoscopicViewDisplay::reset() {
  rviz::Display::reset();
  input_.clear();
  effects_.clear();
  if (view_) view_->clear();
  history_.clear();
  instruments_.reset();
  if (isEnabled()) updateTopics();
}

void EndoscopicViewDisplay::updateTopics() {
  if (!isEnabled()) return;
  input_.subscribe(update_nh_, tissue_topic_->getStdString(), effects_topic_->getStdString());
  effects_.subscribe(update_nh_, tissue_topic_->getStdString(), effects_topic_->getStdString(),
                     session_topic_->getStdString());
  subscribeInstruments();
  state_instruments_sub_.shutdown();
  if (!tissue_topic_->getStdString().empty())
    state_instruments_sub_ = update_nh_.subscribe<vest_msgs::InstrumentStates>(
        tissue_topic_->getStdString() + "/instruments", InstrumentHistory::kMost,
        [this](const vest_msgs::InstrumentStates::ConstPtr& m) {
          instruments_sub_.shutdown();
          history_.add(m);
        },
        nullptr, ros::TransportHints().tcpNoDelay());
  recorder_ = {};
  recorder_sub_ = update_nh_.subscribe<vest_msgs::SessionState>(
      session_topic_->getStdString() + "/recording", 5,
      [this](const vest_msgs::SessionState::ConstPtr& m) { recorder_.heard(m->recording, seconds()); });
  const std::string session = session_topic_->getStdString();
  instruction_sub_ = update_nh_.subscribe<vest_msgs::StringStamped>(
      session + "/instruction", 1, [this](const vest_msgs::StringStamped::ConstPtr& m) {
        tellExercise([&](ExerciseRim& rim) { return rim.instruct(QString::fromStdString(m->string)); });
      });
  score_sub_ = update_nh_.subscribe<vest_msgs::SessionScore>(
      session + "/score", 5, [this](const vest_msgs::SessionScore::ConstPtr& m) {
        tellExercise([&](ExerciseRim& rim) { return rim.score(*m, seconds()); });
      });
  notes_sub_ = update_nh_.subscribe<vest_msgs::StringStamped>(
      session + "/notes", 5, [this](const vest_msgs::StringStamped::ConstPtr& m) {
        tellExercise(
            [&](ExerciseRim& rim) { return rim.teacherSays(QString::fromStdString(m->string), seconds()); });
      });
  drawing_.connect(update_nh_, session, pane_);
  updatePen();
  std::string prefix = image_topic_->getStdString();
  deleteStatus("Publishing");
  if (const std::string other = otherPublisher(update_nh_.resolveName(prefix + "/camera_info"));
      !prefix.empty() && !other.empty()) {
    setStatusStd(rviz::StatusProperty::Warn, "Publishing",
                 other + " publishes " + prefix + " already: this view only shows it. Once " + other +
                     " has ended, switch this display off and on.");
    prefix.clear();
  }
  image_pub_.shutdown();
  info_pub_.shutdown();
  compressed_pub_.shutdown();
  truth_.advertise(update_nh_, prefix);
  if (prefix.empty()) return;
  image_pub_ = update_nh_.advertise<sensor_msgs::Image>(prefix + "/image_raw", 2);
  info_pub_ = update_nh_.advertise<sensor_msgs::CameraInfo>(prefix + "/camera_info", 2);
  compressed_pub_ = update_nh_.advertise<sensor_msgs::CompressedImage>(prefix + "/image_raw/compressed", 2);
}

void EndoscopicViewDisplay::subscribeInstruments() {
  instruments_sub_ = update_nh_.subscribe<vest_msgs::InstrumentStates>(
      instruments_topic_->getStdString(), InstrumentHistory::kMost,
      [this](const vest_msgs::InstrumentStates::ConstPtr& m) { history_.add(m); }, nullptr,
      ros::TransportHints().tcpNoDelay());
}

bool EndoscopicViewDisplay::endoscopePose(Eigen::Isometry3d* X_WO, std::string* how) {
  if (instruments_) {
    for (const vest_msgs::InstrumentState& state : instruments_->instruments) {
      if (state.name != "endoscope" || !toOpticalFrame(state, X_WO)) continue;
      *how = "instruments topic";
      return true;
    }
  }
  const auto buffer = context_->getFrameManager()->getTF2BufferPtr();
  const std::string optical = optical_frame_->getStdString(), world = ros_shell::frameId("world");
  // At the step that is shown; where tf does not reach it: as it is now.
  ros::Time when = input_.header().stamp;
  if (!buffer->canTransform(world, optical, when)) when = ros::Time();
  if (!buffer->canTransform(world, optical, when)) return false;
  const auto t = buffer->lookupTransform(world, optical, when).transform;
  geometry_msgs::Pose pose;
  pose.position.x = t.translation.x, pose.position.y = t.translation.y, pose.position.z = t.translation.z;
  pose.orientation = t.rotation;
  *how = "tf";
  return toPose(pose, X_WO);
}

void EndoscopicViewDisplay::update(float tick, float) {
  tellExercise([](ExerciseRim& rim) { return rim.tick(seconds()); });
  drawing_.tick(seconds());
  if (!view_ || !view_->ready()) return;
  const double start = seconds();
  if (pane_ != nullptr)
    pane_->warn(recorder_.lost(start) ? "NOT RECORDED: the recorder ended without a word" : "");
  if (finishing_.valid() && finishing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    waitForWorker();
  // rviz asks at its own pace: the nearest of its ticks is taken, so that the mean rate is the wished one.
  if (start < next_picture_ - 0.5 * std::min(static_cast<double>(tick), kLongestTick)) return;
  if (start - looked_ > kLooks) {
    looked_ = start;
    if (!instruments_sub_ && state_instruments_sub_.getNumPublishers() == 0) subscribeInstruments();
  }
  try {
    const std::uint64_t states = input_.states();
    tissue_changed_ = input_.process() || tissue_changed_;
    if (input_.states() != states) last_state_ = start;
    // Instruments come by a connection of their own: a picture waits for those of its state, but not long.
    if (history_.awaits(input_.header().stamp)) {
      if (waiting_since_ == 0) waiting_since_ = start;
      if (start - waiting_since_ < kLongestWait) return;
    }
    waiting_since_ = 0;
    const bool tissue_changed = tissue_changed_;
    tissue_changed_ = false;
    const auto instruments = history_.at(input_.header().stamp, start - last_state_);
    const bool instruments_changed = instruments != instruments_;
    instruments_ = instruments;
    Eigen::Isometry3d X_WO;
    std::string how;
    if (!endoscopePose(&X_WO, &how)) {
      setStatus(rviz::StatusProperty::Warn, "Camera",
                "no endoscope in the instruments topic and no optical frame in tf");
      account(start);
      return;
    }
    // Nothing moved: twice a second is enough.
    const bool effects_changed = effects_.changed();
    if (!tissue_changed && !instruments_changed && !effects_changed && start - last_picture_ < 0.5) return;
    setStatusStd(rviz::StatusProperty::Ok, "Camera", how);
    next_picture_ = std::max(next_picture_ + 1.0 / rate_->getFloat(), start);
    if (instruments_) view_->setInstruments(*instruments_);
    effects_.handTo(view_.get());
    if (tissue_changed || !view_->scene().settled()) view_->setTissue(input_.store());
    const double prepared = seconds();
    const EndoscopePipeline::Timing timing = view_->render(X_WO, input_.time(), start - last_picture_);
    // The state's stamp; while no state has come, the time of drawing.
    const ros::Time stamp = input_.header().stamp.isZero() ? ros::Time::now() : input_.header().stamp;
    // A session starts with the first picture: nothing is sent before there is tissue with its textures, but
    // a view that gets none (no simulation, only instruments) is not held back for ever.
    if (first_picture_ == 0) first_picture_ = start;
    begun_ = begun_ || (view_->scene().complete() && !input_.store().empty()) ||
             start - first_picture_ > kLongestHold;
    collect();  // the picture before this one
    view_->handOver();
    const Outgoing to = begun_ ? outgoing(stamp) : Outgoing();
    // The next picture is drawn while a worker finishes this one; ground truth belongs to one picture.
    const bool truth = begun_ && truth_.wanted();
    const auto task = [this, to] { return finish(to); };
    finishing_ = truth ? std::async(std::launch::deferred, task) : worker_.start(task);
    if (truth) {
      collect();
      std_msgs::Header header;
      header.stamp = stamp;
      header.frame_id = optical_frame_->getStdString();
      truth_.publish(*view_, input_.store(), instruments_.get(), X_WO, header, input_.step());
    }
    sums_.tissue += prepared - start + timing.prepare;
    sums_.draw += timing.draw;
    sums_.read += timing.read;
    ++sums_.pictures;
    last_picture_ = start;
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Picture", e.what());
    last_picture_ = start;
  }
  account(start);
}

EndoscopicViewDisplay::Outgoing EndoscopicViewDisplay::outgoing(const ros::Time& stamp) {
  Outgoing to;
  to.header.stamp = stamp;
  to.header.frame_id = optical_frame_->getStdString();
  if (info_pub_.getNumSubscribers() > 0) {
    sensor_msgs::CameraInfo info = toCameraInfo(camera_);
    info.header = to.header;
    info_pub_.publish(info);
  }
  if (image_pub_.getNumSubscribers() > 0) to.image = image_pub_;
  const double now = seconds();
  if (compressed_pub_.getNumSubscribers() > 0 &&
      now - last_compressed_ >= 0.97 / compressed_rate_->getFloat()) {
    last_compressed_ = now;
    to.compressed = compressed_pub_;
  }
  return to;
}

void EndoscopicViewDisplay::send(const Outgoing& to, const cv::Mat& picture) {
  if (to.image) {
    auto image = boost::make_shared<sensor_msgs::Image>();
    image->header = to.header;
    image->width = static_cast<std::uint32_t>(picture.cols);
    image->height = static_cast<std::uint32_t>(picture.rows);
    image->encoding = "rgb8";
    image->step = 3 * image->width;
    image->data.assign(picture.data, picture.data + picture.total() * 3);
    to.image.publish(image);
  }
  if (to.compressed) {
    sensor_msgs::CompressedImage message;
    message.header = to.header;
    message.format = "rgb8; jpeg compressed bgr8";
    cv::Mat bgr;
    cv::cvtColor(picture, bgr, cv::COLOR_RGB2BGR);
    cv::imencode(".jpg", bgr, message.data, {cv::IMWRITE_JPEG_QUALITY, 85});
    to.compressed.publish(message);
  }
}

EndoscopicViewDisplay::Finished EndoscopicViewDisplay::finish(const Outgoing& to) {
  Finished done;
  done.finish = view_->finish(&picture_);
  const double finished = seconds();
  send(to, picture_);
  const double sent = seconds();
  done.image = ImagePane::convert(picture_.data, picture_.cols, picture_.rows);
  done.send = sent - finished;
  done.show = seconds() - sent;
  return done;
}

void EndoscopicViewDisplay::collect() {
  if (!finishing_.valid()) return;
  const Finished done = finishing_.get();
  sums_.finish += done.finish;
  sums_.send += done.send;
  sums_.show += done.show;
  if (pane_ != nullptr) pane_->show(done.image);
}

void EndoscopicViewDisplay::waitForWorker() {
  try {
    collect();
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Picture", e.what());
  }
}

void EndoscopicViewDisplay::account(double now) {
  if (now - last_account_ < 2.0) return;
  const double elapsed = now - last_account_;
  last_account_ = now;
  const int n = sums_.pictures;
  if (!input_.problem().empty())
    setStatusStd(rviz::StatusProperty::Warn, "Tissue", input_.problem());
  else if (input_.store().empty())
    setStatus(rviz::StatusProperty::Warn, "Tissue", "no topology yet");
  else
    setStatus(rviz::StatusProperty::Ok, "Tissue",
              QString("%1 objects").arg(input_.store().topology().objects.size()));
  const std::string warning = view_->scene().warning();
  if (!warning.empty()) setStatusStd(rviz::StatusProperty::Warn, "Drawing", warning);
  if (n > 0 && elapsed < 60) {
    const double ms = 1000.0 / n;
    const QString text =
        QString("%1 pictures/s; ms: tissue %2, draw %3, read %4, finish %5, send %6, show %7, all %8")
            .arg(n / elapsed, 0, 'f', 1)
            .arg(ms * sums_.tissue, 0, 'f', 1)
            .arg(ms * sums_.draw, 0, 'f', 1)
            .arg(ms * sums_.read, 0, 'f', 1)
            .arg(ms * sums_.finish, 0, 'f', 1)
            .arg(ms * sums_.send, 0, 'f', 1)
            .arg(ms * sums_.show, 0, 'f', 1)
            .arg(ms * (sums_.tissue + sums_.draw + sums_.read + sums_.finish + sums_.send + sums_.show), 0,
                 'f', 1);
    setStatus(rviz::StatusProperty::Ok, "Timing", text);
    if (print_timing_->getBool()) ROS_INFO("endoscopic view: %s", qPrintable(text));
  }
  const double drawing = n > 0 ? 1000.0 * (sums_.draw + sums_.read) / n : 0;
  sums_ = {};
  // Not judged by the first pictures, which bake textures.
  if (quality_->getOptionInt() != 2 || n < 10 || elapsed > 60) return;
  const std::size_t wanted = picture::nextLevel(level_, drawing);
  if (wanted == level_) return;
  level_ = wanted;
  updateCamera();
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::EndoscopicViewDisplay, rviz::Display)
