// Renders a recorded session (a bag) to pictures and a video of any size, with ground truth if wished.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <unistd.h>

#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <rviz/ogre_helpers/render_system.h>
#include <CLI/CLI.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "conversion.h"
#include "endoscope_inputs.h"
#include "endoscope_pipeline.h"
#include "instrument_history.h"
#include "steady_seconds.h"
#include "tissue_input.h"
#include "truth_output.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"

namespace {

namespace fs = std::filesystem;
using vest::displays::EndoscopePipeline;
using vest::displays::processorSeconds;

struct Options {
  std::string bag, output, video, frame_format = "png";
  int width = 720, height = 576, quality = 1;
  double fps = 25, from = 0, to = 1e9, fov = 70, k1 = -0.18, k2 = 0.03, circle = 1, noise = 0, focus = 0;
  bool no_frames = false, truth = false, each_state = false, timing = false;
};

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// What the bag said last.
struct Inputs {
  vest::displays::TissueInput tissue;
  vest::displays::EndoscopeInputs effects;
  vest::displays::InstrumentHistory history;
  vest_msgs::InstrumentStates::ConstPtr instruments;  ///< at the state that is shown

  void take(const rosbag::MessageInstance& m) {
    const std::string& topic = m.getTopic();
    const auto is = [&](const char* end) { return endsWith(topic, end); };
    if (is("tissue/topology")) give<vest_msgs::TissueTopology>(m, &tissue);
    if (is("tissue/topology_delta")) give<vest_msgs::TissueTopologyDelta>(m, &tissue);
    if (is("tissue/state")) give<vest_msgs::TissueState>(m, &tissue);
    if (is("effects/surface")) give<vest_msgs::SurfaceBleeding>(m, &tissue);
    if (is("tissue/attachments")) give<vest_msgs::TissueAttachments>(m, &effects);
    if (is("tissue/sutures")) give<vest_msgs::SutureStates>(m, &effects);
    if (is("effects/fluid")) give<vest_msgs::FluidState>(m, &effects);
    if (is("effects/smoke")) give<vest_msgs::SmokeState>(m, &effects);
    if (is("effects/lens")) give<vest_msgs::LensState>(m, &effects);
    if (is("effects/gas")) give<vest_msgs::GasState>(m, &effects);
    if (is("session/targets")) give<visualization_msgs::MarkerArray>(m, &effects);
    if (is("/instruments"))
      if (const auto message = m.instantiate<vest_msgs::InstrumentStates>()) history.add(message);
  }

  bool pose(Eigen::Isometry3d* X_WO) const {
    if (!instruments) return false;
    for (const vest_msgs::InstrumentState& state : instruments->instruments)
      if (state.name == "endoscope") return vest::displays::toOpticalFrame(state, X_WO);
    return false;
  }

 private:
  template <class M, class T>
  static void give(const rosbag::MessageInstance& m, T* to) {
    if (const auto message = m.instantiate<M>()) to->add(typename M::ConstPtr(message));
  }
};

/// Optical flow in the .flo format of Baker et al. 2011 (Middlebury): little-endian, rows of u v.
void writeFlow(const std::string& path, const cv::Mat& flow) {
  std::ofstream out(path, std::ios::binary);
  const float magic = 202021.25f;
  const std::int32_t size[] = {flow.cols, flow.rows};
  out.write(reinterpret_cast<const char*>(&magic), 4);
  out.write(reinterpret_cast<const char*>(size), 8);
  out.write(reinterpret_cast<const char*>(flow.data), static_cast<std::streamsize>(flow.total() * 8));
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written");
}

void mustWrite(const std::string& path, const cv::Mat& picture) {
  if (!cv::imwrite(path, picture, {cv::IMWRITE_JPEG_QUALITY, 88}))
    throw std::runtime_error(path + ": cannot be written");
}

class Renderer {
 public:
  explicit Renderer(const Options& options) : o_(options), view_(options.quality) {
    view_.setCamera(vest::camera::fromFieldOfView(static_cast<std::uint32_t>(o_.width),
                                                  static_cast<std::uint32_t>(o_.height), o_.fov * M_PI / 180,
                                                  {o_.k1, o_.k2, 0, 0, 0}),
                    o_.circle,
                    o_.quality == 2   ? 1.8
                    : o_.quality == 1 ? 1.0
                                      : 0.7);
    vest::picture::CameraLook look;
    look.noise = o_.noise, look.focus = o_.focus;
    view_.setLook(look);
    if (!o_.output.empty()) fs::create_directories(o_.output);
    if (!o_.video.empty()) {
      const int code = endsWith(o_.video, ".avi") ? cv::VideoWriter::fourcc('M', 'J', 'P', 'G')
                                                  : cv::VideoWriter::fourcc('m', 'p', '4', 'v');
      if (!video_.open(o_.video, code, o_.fps, {o_.width, o_.height}))
        throw std::runtime_error(o_.video + ": cannot be written (allowed: .avi, .mp4)");
    }
    if (o_.truth) {
      points_.open(o_.output + "/keypoints.csv");
      points_ << "frame,step,instrument,name,u,v,depth_m,visibility\n";
    }
  }

  void frame(Inputs* inputs) {
    Eigen::Isometry3d X_WO;
    const std::uint64_t states = inputs->tissue.states();
    const bool changed = inputs->tissue.process();
    const double age = inputs->tissue.states() != states ? 0 : 1;  // s: the bag tells which stand still
    inputs->instruments = inputs->history.at(inputs->tissue.header().stamp, age);
    if (inputs->tissue.store().empty() || !inputs->pose(&X_WO)) {
      ++empty_;
      return;
    }
    view_.setInstruments(*inputs->instruments);
    inputs->effects.handTo(&view_);
    if (changed || frames_ == 0) view_.settle(inputs->tissue.store());
    // The exposure settles before the first picture, as a camera's does before anybody looks; also behind a
    // gap.
    const double gap = inputs->tissue.time() - shown_;
    shown_ = inputs->tissue.time();
    EndoscopePipeline::Timing cost;
    const double began = processorSeconds();
    int drawn = 0;
    for (int i = frames_ == 0 || (o_.each_state && !(gap >= 0 && gap < kGap)) ? 0 : 14; i < 15; ++i, ++drawn)
      cost = view_.draw(X_WO, inputs->tissue.time(), 1 / o_.fps, &picture_);
    if (drawn == 1) {  // others settle
      ++timed_;
      processor_ += processorSeconds() - began;
      sum_.prepare += cost.prepare, sum_.draw += cost.draw, sum_.read += cost.read,
          sum_.finish += cost.finish;
    }
    cv::cvtColor(picture_, bgr_, cv::COLOR_RGB2BGR);
    char name[32];
    std::snprintf(name, sizeof name, "%06d", frames_);
    if (!o_.output.empty() && !o_.no_frames) mustWrite(path("frame", name, o_.frame_format), bgr_);
    if (video_.isOpened()) video_.write(bgr_);
    if (o_.truth) writeTruth(name, inputs, X_WO);
    ++frames_;
  }

  /// What a picture cost on the mean, without tissue and files.
  void printTiming() const {
    const double ms = 1000.0 / std::max(1, timed_);
    std::printf(
        "a picture: %.1f ms of processor time; prepare %.1f, draw %.1f, read %.1f, finish %.1f ms (mean of "
        "%d)\n",
        ms * processor_, ms * sum_.prepare, ms * sum_.draw, ms * sum_.read, ms * sum_.finish, timed_);
  }

  int frames() const { return frames_; }
  int empty() const { return empty_; }
  std::string warning() const { return view_.scene().warning(); }

 private:
  std::string path(const char* what, const char* name, const std::string& end) const {
    return o_.output + "/" + what + "_" + name + "." + end;
  }

  void writeTruth(const char* name, Inputs* inputs, const Eigen::Isometry3d& X_WO) {
    const auto& raster = truth_.draw(view_, inputs->tissue.store(), inputs->instruments.get(), X_WO);
    raster.depth(&truth_picture_);
    mustWrite(path("depth", name, "tiff"), truth_picture_);
    raster.segmentation(&truth_picture_);
    mustWrite(path("segmentation", name, "png"), truth_picture_);
    raster.flow(truth_.before(), &truth_picture_);
    writeFlow(path("flow", name, "flo"), truth_picture_);
    for (const auto& k : truth_.keypoints(inputs->instruments.get(), view_, X_WO))
      points_ << frames_ << ',' << inputs->tissue.step() << ',' << k.instrument << ',' << k.name << ',' << k.u
              << ',' << k.v << ',' << k.depth << ',' << int(k.visibility) << '\n';
    truth_.remember(X_WO);
  }

  static constexpr double kGap = 0.25;  ///< s of simulated time
  Options o_;
  mutable EndoscopePipeline view_;
  vest::displays::TruthOutput truth_;
  cv::VideoWriter video_;
  std::ofstream points_;
  cv::Mat picture_, bgr_, truth_picture_;
  int frames_ = 0, empty_ = 0, timed_ = 0;
  EndoscopePipeline::Timing sum_;
  double processor_ = 0;
  double shown_ = 0;  ///< s of simulated time, of the last picture
};

int render(const Options& o) {
  ros::Time::init();
  rosbag::Bag bag;
  // A pipe would let it wait.
  if (!fs::is_regular_file(o.bag)) throw std::runtime_error(o.bag + ": no regular file (allowed: a bag)");
  bag.open(o.bag, rosbag::bagmode::Read);
  rosbag::View view(bag,
                    [](const rosbag::ConnectionInfo* c) { return c->datatype.rfind("vest_msgs/", 0) == 0; });
  if (view.size() == 0) throw std::runtime_error(o.bag + ": holds no messages of vest_msgs");
  rviz::RenderSystem::get();
  Renderer renderer(o);
  Inputs inputs;
  const ros::Time begin = view.getBeginTime();
  double next = o.from;
  for (const rosbag::MessageInstance& m : view) {
    const double t = (m.getTime() - begin).toSec();
    for (; !o.each_state && t > next && next <= o.to; next += 1 / o.fps) renderer.frame(&inputs);
    if ((o.each_state ? t : next) > o.to) break;
    inputs.take(m);
    if (o.each_state && t >= o.from && m.isType<vest_msgs::TissueState>()) renderer.frame(&inputs);
  }
  if (!o.each_state && next <= o.to) renderer.frame(&inputs);
  if (!renderer.warning().empty())
    std::fprintf(stderr, "warning: %s\n", vest::files::shown(renderer.warning(), 6000).c_str());
  std::printf("%d pictures of %d x %d", renderer.frames(), o.width, o.height);
  if (renderer.empty() > 0)
    std::printf(", %d moments without tissue or endoscope left out", renderer.empty());
  std::printf("\n");
  if (o.timing) renderer.printTiming();
  return renderer.frames() > 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Renders a recorded session (session.bag) to pictures and a video.\n"
      "Exit status: 0 done, 1 nothing to show, 2 an argument or a file is wrong."};
  Options o;
  app.add_option("bag", o.bag, "bag of a session")->required();
  app.add_option("--output", o.output, "folder for frame_NNNNNN.png; made if it is not there");
  app.add_option("--video", o.video, "video file, .mp4 (MPEG-4) or .avi (Motion JPEG)");
  app.add_option("--width", o.width, "pixels")->check(CLI::Range(64, 4096));
  app.add_option("--height", o.height, "pixels")->check(CLI::Range(64, 4096));
  app.add_option("--fps", o.fps, "pictures per second of the session")->check(vest::files::number(0.01, 240));
  app.add_option("--from", o.from, "s after the bag's begin")->check(vest::files::number(0, 1e9));
  app.add_option("--to", o.to, "s after the bag's begin")->check(vest::files::number(0, 1e9));
  app.add_option("--fov", o.fov, "horizontal field of view, degrees")->check(vest::files::number(10, 140));
  app.add_option("--k1", o.k1, "plumb_bob distortion")->check(vest::files::number(-0.3, 0.3));
  app.add_option("--k2", o.k2, "plumb_bob distortion")->check(vest::files::number(-0.1, 0.1));
  app.add_option("--circle", o.circle, "radius of the round picture over half its height")
      ->check(vest::files::number(0.3, 1.5));
  app.add_option("--quality", o.quality, "0 simple, 1 standard, 2 fine: more pixels are drawn than shown")
      ->check(CLI::Range(0, 2));
  app.add_option("--noise", o.noise, "of the sensor, levels of 255")->check(vest::files::number(0, 30));
  app.add_option("--focus", o.focus, "distance in focus, m; 0: all sharp")->check(vest::files::number(0, 1));
  app.add_option("--format", o.frame_format, "of the pictures")->check(CLI::IsMember({"png", "jpg"}));
  app.add_flag("--each-state", o.each_state,
               "a picture of each state in the bag, however far apart they are");
  app.add_flag("--no-frames", o.no_frames, "no picture files, only the video or the ground truth");
  app.add_flag(
      "--truth", o.truth,
      "depth_*.tiff (32 bit float, m), segmentation_*.png (16 bit labels), flow_*.flo, keypoints.csv");
  app.add_flag("--timing", o.timing, "prints what drawing a picture costs; works without --output, too");
  CLI11_PARSE(app, argc, argv);
  if (o.output.empty() && (o.truth || (o.video.empty() && !o.timing))) {
    std::fprintf(stderr,
                 "vest_render: give --output for pictures or ground truth, or --video, or --timing\n");
    return 2;
  }
  if (std::getenv("DISPLAY") == nullptr && std::getenv("VEST_RENDER_NESTED") == nullptr) {
    // OpenGL needs a screen: a virtual one.
    setenv("VEST_RENDER_NESTED", "1", 1);
    setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
    std::vector<char*> again;
    for (const char* word : {"xvfb-run", "-a", "-s", "-screen 0 800x720x24 +extension GLX"})
      again.push_back(const_cast<char*>(word));
    for (int i = 0; i < argc; ++i) again.push_back(argv[i]);
    again.push_back(nullptr);
    execvp(again[0], again.data());
    std::fprintf(stderr, "vest_render: no DISPLAY, and xvfb-run is missing (package xvfb)\n");
    return 2;
  }
  try {
    return render(o);
  } catch (const std::exception& e) {
    const std::string what = e.what();
    const auto begins = [&](const std::string& name) { return !name.empty() && what.rfind(name, 0) == 0; };
    const bool named =
        begins(o.bag) || begins(o.output) || begins(o.video);  // rosbag's own words name no file
    std::fprintf(stderr, "vest_render: %s%s\n", named ? "" : vest::files::shown(o.bag + ": ", 6000).c_str(),
                 vest::files::shown(what, 6000).c_str());
    return 2;
  }
}
