// Draws the endoscopic view of a scene file in this process, without topics, prints milliseconds per stage,
// and writes the table of docs/benchmarks_view.md.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <sched.h>

#include <OgreRenderQueue.h>
#include <OgreRenderSystem.h>
#include <OgreRenderSystemCapabilities.h>
#include <OgreRoot.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <ros/package.h>
#include <ros/time.h>
#include <rviz/ogre_helpers/render_system.h>
#include <CLI/CLI.hpp>
#include <boost/make_shared.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "conversion.h"
#include "dynamic_mesh.h"
#include "effect_messages.h"
#include "endoscope_pipeline.h"
#include "ogre_assets.h"
#include "scene_messages.h"
#include "steady_seconds.h"
#include "tissue_input.h"
#include "vest_instruments/files/option.h"
#include "vest_viz/picture/finish.h"

namespace {
using Eigen::Vector3d;
using vest::displays::processorSeconds;
using vest::tools::Place;

double milliseconds() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// Median, and what nine of ten stay below.
struct Times {
  double median = 0, most = 0;
};

Times print(const char* stage, std::vector<double>* values, const char* unit = "ms") {
  std::sort(values->begin(), values->end());
  const Times t{(*values)[values->size() / 2], (*values)[values->size() * 9 / 10]};
  std::printf("%-8s median %7.2f   90 %% %7.2f %s\n", stage, t.median, t.most, unit);
  return t;
}

std::string text(const char* format, double a, double b = 0, double c = 0) {
  char line[256];
  std::snprintf(line, sizeof line, format, a, b, c);
  return line;
}

/// The first line of a file of /proc that begins with a word, after its colon.
std::string systemLine(const char* file, const std::string& word) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);)
    if (line.rfind(word, 0) == 0) return line.substr(word.empty() ? 0 : line.find(':') + 2);
  return "unknown";
}

/// Rows of docs/benchmarks_view.md.
class Table {
 public:
  void row(const std::string& what, const std::string& measured, double value, const std::string& bound,
           double most) {
    rows_ << "| " << what << " | " << measured << " | " << bound << " | " << text("%.2f", value / most)
          << " | " << (value <= most ? "held" : "**exceeded**") << " |\n";
    holds_ = holds_ && value <= most;
  }
  void write(const std::string& path, const std::string& load) const {
    std::ofstream page(path);
    page << "# What the endoscopic view costs\n\nMade by `LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s '-screen 0 "
            "800x720x24 +extension GLX' rosrun vest_viz vest_viz_benchmark --output "
            "docs/benchmarks_view.md`; do not edit.\nThe gynaecology scene with two instruments, tissue "
            "moving "
            "in each picture, 720×576 pixels, from a state that has arrived to the finished picture. Wall "
            "time: "
            "medians, and in brackets what nine of ten pictures stay below; bounds: issue 6. Load: processes "
            "that were ready to run during the last minute, before and after; this program's own threads are "
            "among them.\n\n"
         << "Processor: " << systemLine("/proc/cpuinfo", "model name") << ", "
         << std::thread::hardware_concurrency() << " cores. Renderer: "
         << rviz::RenderSystem::get()->root()->getRenderSystem()->getCapabilities()->getDeviceName()
         << ". Load: " << load << ".\n\n"
         << "| | measured | bound | share of the bound | |\n| --- | --- | --- | --- | --- |\n"
         << rows_.str();
    if (!page) throw std::runtime_error(path + ": cannot be written");
  }
  bool holds() const { return holds_; }

 private:
  std::ostringstream rows_;
  bool holds_ = true;
};

struct Options {
  std::string scene, picture, effects, output;
  bool strict = false;
  double focus = 0, noise = 0, fog = 0.35, insertion = 0.10;
  int smoke = 1, frames = 60, width = 720, height = 576;
  std::vector<double> view;
};

/// Positions, normals and tangents of a mesh of 15,000 vertices into its buffer: what each state costs.
Times uploadMesh(int frames) {
  Times times;
  using vest::displays::DynamicMesh;
  constexpr std::uint32_t kColumns = 125, kRows = 120;
  Ogre::SceneManager* const manager = rviz::RenderSystem::get()->root()->createSceneManager();
  {
    std::vector<float> positions, normals, tangents;
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t r = 0; r < kRows; ++r)
      for (std::uint32_t c = 0; c < kColumns; ++c) {
        positions.insert(positions.end(),
                         {0.001f * static_cast<float>(c), 0.001f * static_cast<float>(r), 0.0f});
        normals.insert(normals.end(), {0, 0, 1});
        tangents.insert(tangents.end(), {1, 0, 0});
        const std::uint32_t k = r * kColumns + c;
        if (r + 1 < kRows && c + 1 < kColumns)
          triangles.insert(triangles.end(), {k, k + 1, k + kColumns + 1, k, k + kColumns + 1, k + kColumns});
      }
    DynamicMesh mesh(manager, manager->getRootSceneNode(), vest::displays::makeTissueMaterial("uterus", 0),
                     Ogre::RENDER_QUEUE_MAIN);
    mesh.setShape(triangles, {}, {}, positions.size() / 3);
    std::vector<double> all;
    for (int frame = 0; frame < frames; ++frame) {
      positions[2] = 0.001f * static_cast<float>(frame);
      const double begin = milliseconds();
      mesh.setVertices(positions, normals, tangents);
      all.push_back(milliseconds() - begin);
    }
    times = print("15k mesh", &all);
  }
  rviz::RenderSystem::get()->root()->destroySceneManager(manager);
  return times;
}

/// What the callbacks of a view do with whole topologies and states: they put them aside. µs of the longest.
double callbacks(const std::string& scene) {
  const auto topology =
      boost::make_shared<vest_msgs::TissueTopology>(vest::tools::topologyOf(vest::scene::loadScene(scene)));
  vest::displays::TissueInput input;
  std::vector<double> all;
  for (std::uint64_t step = 0; step < 1000; ++step) {
    auto state = boost::make_shared<vest_msgs::TissueState>();
    state->revision = topology->revision, state->step = step;
    for (const auto& object : topology->objects)
      state->positions.insert(state->positions.end(), object.rest_position.begin(),
                              object.rest_position.end());
    const double begin = milliseconds();
    if (step % 100 == 0) input.add(vest_msgs::TissueTopology::ConstPtr(topology));
    input.add(vest_msgs::TissueState::ConstPtr(state));
    all.push_back(1000 * (milliseconds() - begin));
    input.process();
  }
  print("callback", &all, "µs");
  return all.back();
}

struct Frame {
  Times all, tissue, draw, read, finish;
  double processor = 0;  ///< ms a picture, all threads
};

/// Milliseconds per stage at one level of quality.
Frame measure(const Options& o, int quality) {
  std::printf("%s level, %d x %d\n", quality == 1 ? "standard" : "simple", o.width, o.height);
  const std::set<std::string> words = vest::tools::effectWords(o.effects);
  const double begin = milliseconds();
  vest::mesh::Store store;
  const vest::scene::Description description = vest::scene::loadScene(o.scene);
  vest_msgs::TissueTopology topology = vest::tools::topologyOf(description);
  if (words.count("cut") != 0) vest::tools::addCut(&topology);
  store.setTopology(vest::displays::toTopology(topology));
  store.rebuildSkins();
  const double loaded = milliseconds();
  vest::displays::EndoscopePipeline endoscope(quality);
  vest::displays::EndoscopeScene& scene = endoscope.scene();
  const auto camera =
      vest::camera::fromFieldOfView(static_cast<std::uint32_t>(o.width), static_cast<std::uint32_t>(o.height),
                                    70 * 3.14159265 / 180, {-0.18, 0.03, 0, 0, 0});
  endoscope.setCamera(camera, 1.0, quality == 1 ? 1.0 : 0.7);
  vest::picture::CameraLook look;
  look.focus = o.focus, look.noise = o.noise;
  endoscope.setLook(look);
  endoscope.setSmokeMethod(static_cast<vest::displays::EndoscopePipeline::Smoke>(o.smoke));
  if (words.count("fields") != 0) {
    vest_msgs::TissueState state;
    vest::tools::addFields(description, 4.0, &state);
    for (const vest_msgs::TissueField& m : state.fields) {
      vest::mesh::Field field;
      field.kind = m.kind, field.minimum = m.minimum, field.maximum = m.maximum, field.data = m.data;
      store.setField(store.topology().revision, field);
    }
  }
  if (words.count("clips") != 0)
    endoscope.setAttachments(
        boost::make_shared<vest_msgs::TissueAttachments>(vest::tools::attachmentsAt(description)));
  if (words.count("sutures") != 0)
    endoscope.setSutures(boost::make_shared<vest_msgs::SutureStates>(vest::tools::suturesAt(description, 0)));
  if (words.count("smoke") != 0)
    endoscope.setSmoke(boost::make_shared<vest_msgs::SmokeState>(vest::tools::smokeAt(description, 2)));
  if (words.count("lens") != 0)
    endoscope.setLens(boost::make_shared<vest_msgs::LensState>(vest::tools::lensAt(o.fog)));
  scene.updateTissue(store);
  std::printf("load %.0f ms, build %.0f ms\n", loaded - begin, milliseconds() - loaded);
  endoscope.settle(store);
  std::printf("textures baked %.0f ms after the start\n", milliseconds() - begin);

  vest_msgs::InstrumentStates instruments;
  const Vector3d tip =
      o.view.size() == 3 ? Vector3d(o.view[0], o.view[1], o.view[2]) : vest::tools::endoscopeTip(o.insertion);
  instruments.instruments = {vest::tools::instrumentAt(Place::Left, {-0.036, 0.050, 0.072}, 0.4, 0.12),
                             vest::tools::instrumentAt(Place::Right, {0.030, 0.045, 0.075}, -0.3, 0.5),
                             vest::tools::instrumentAt(Place::Endoscope, tip, 0, 0)};
  Eigen::Isometry3d X_WO;
  vest::displays::toOpticalFrame(instruments.instruments[2], &X_WO);
  scene.updateInstruments(instruments);

  std::vector<float> positions;
  for (std::size_t i = 0; i < store.topology().objects.size(); ++i)
    positions.insert(positions.end(), store.topology().objects[i].rest_position.begin(),
                     store.topology().objects[i].rest_position.end());
  std::vector<double> tissue, prepare, draw, read, finish, all;
  cv::Mat out;
  double processor = 0;
  // The first pictures settle the exposure and compile the shaders.
  for (int frame = -15; frame < o.frames; ++frame) {
    if (frame == 0) processor = processorSeconds();
    const double t0 = milliseconds();
    std::vector<float> moved = positions;
    std::size_t k = 0;
    for (const auto& object : store.topology().objects)
      for (std::size_t i = 0; i < object.rest_position.size(); ++i, ++k)
        if (!object.rigid && i % 3 == 2) moved[k] += 0.0005f * std::sin(0.2f * static_cast<float>(frame));
    store.setState(store.topology().revision, moved.data(), moved.size());
    store.rebuildSkins();
    scene.updateTissue(store);
    if (words.count("fluid") != 0)
      endoscope.setFluid(
          boost::make_shared<vest_msgs::FluidState>(vest::tools::fluidAt(description, 2 + 0.05 * frame)));
    const double t1 = milliseconds();
    const auto timing = endoscope.draw(X_WO, 0.05 * frame, 0.05, &out);
    const double t3 = milliseconds();
    if (frame < 0) continue;
    tissue.push_back(t1 - t0);
    draw.push_back(1000 * timing.draw);
    read.push_back(1000 * timing.read);
    finish.push_back(1000 * timing.finish);
    prepare.push_back(1000 * timing.prepare);
    all.push_back(t3 - t0);
  }
  Frame result;
  result.processor = 1000 * (processorSeconds() - processor) / o.frames;
  result.tissue = print("tissue", &tissue);
  print("prepare", &prepare);
  result.draw = print("draw", &draw);
  result.read = print("read", &read);
  result.finish = print("finish", &finish);
  result.all = print("all", &all);
  std::printf("processor time %.1f ms a picture\n", result.processor);
  if (!scene.warning().empty()) std::printf("warning: %s\n", scene.warning().c_str());
  if (!o.picture.empty()) {
    cv::Mat bgr;
    cv::cvtColor(out, bgr, cv::COLOR_RGB2BGR);
    if (!cv::imwrite(o.picture, bgr)) throw std::runtime_error(o.picture + ": cannot be written");
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Milliseconds per stage of the endoscopic view at both levels, drawn without topics, and of a mesh's "
      "update. Run it under xvfb-run."};
  Options o;
  int quality = -1;
  app.add_option("scene", o.scene, "scene file; default: the gynaecology scene of vest_tissue");
  app.add_option("--frames", o.frames, "pictures to draw")->check(CLI::Range(1, 100000));
  app.add_option("--width", o.width, "pixels")->check(CLI::Range(64, 4096));
  app.add_option("--height", o.height, "pixels")->check(CLI::Range(64, 4096));
  app.add_option("--quality", quality, "0 simple, 1 standard; default: both")->check(CLI::Range(0, 1));
  app.add_option("--insertion", o.insertion, "of the endoscope, m")->check(vest::files::number(0, 0.28));
  app.add_option("--view", o.view, "endoscope tip x y z, m, in world")
      ->expected(3)
      ->check(vest::files::number(-10, 10));
  app.add_option("--picture", o.picture, "file that the last picture of the standard level is written to");
  app.add_option("--effects", o.effects,
                 "made-up effects: all, or some of fields,cut,clips,sutures,fluid,smoke,lens");
  app.add_option("--smoke", o.smoke, "1: field, 2: billboards, 3: both")->check(CLI::Range(0, 3));
  app.add_option("--fog", o.fog, "of the lens, 0 … 1, with the effect lens")
      ->check(vest::files::number(0, 1));
  app.add_option("--focus", o.focus, "m; 0: all sharp")->check(vest::files::number(0, 1));
  app.add_option("--noise", o.noise, "levels of 255")->check(vest::files::number(0, 30));
  app.add_option("--output", o.output, "markdown page to write: the table with the bounds");
  app.add_flag("--strict", o.strict, "exit 1 where a bound is not held");
  CLI11_PARSE(app, argc, argv);
  if (!o.output.empty() && (quality >= 0 || !o.scene.empty() || o.width != 720 || o.height != 576)) {
    std::fprintf(stderr, "vest_viz_benchmark: the table is of the demo scene, both levels, at 720 x 576\n");
    return 2;
  }
  try {
    ros::Time::init();
    if (o.scene.empty())
      o.scene = ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml";
    rviz::RenderSystem::get();
    const std::string before = systemLine("/proc/loadavg", "");
    Table table;
    for (const int level : {1, 0}) {
      if (quality >= 0 && quality != level) continue;
      const Frame f = measure(o, level);
      o.picture.clear();
      table.row(
          std::string("a frame of the demo scene, ") + (level == 1 ? "standard" : "simplest") + " level",
          text("**%.1f ms** (%.1f; ", f.all.median, f.all.most) +
              text("tissue %.1f, draw and read back %.1f, finish %.1f; ", f.tissue.median,
                   f.draw.median + f.read.median, f.finish.median) +
              text("processor time %.1f)", f.processor),
          f.all.median, level == 1 ? "60 ms" : "35 ms", level == 1 ? 60 : 35);
    }
    const Times mesh = uploadMesh(200);
    table.row("update of a mesh of 15,000 vertices", text("**%.3f ms** (%.3f)", mesh.median, mesh.most),
              mesh.median, "0.3 ms", 0.3);
    const double longest = callbacks(o.scene);
    table.row("longest of 1000 ROS callbacks with a state or topology of the demo scene",
              text("**%.0f µs**", longest), longest, "1000 µs (assumed: no stall)", 1000);
    if (!o.output.empty())
      table.write(o.output,
                  before.substr(0, before.find(' ')) + " before, " +
                      systemLine("/proc/loadavg", "").substr(0, 4) + " after" +
                      (sched_getscheduler(0) == SCHED_OTHER ? "" : "; run with real-time priority"));
    if (o.strict && !table.holds()) return 1;
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_viz_benchmark: %s\n", e.what());
    return 1;
  }
}
