// Adds and removes displays at run time in a real rviz view, feeds them topologies of every kind, and counts
// what is left: OGRE's resources, threads, memory.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <OgreMaterialManager.h>
#include <OgreMeshManager.h>
#include <OgreRenderWindow.h>
#include <OgreTextureManager.h>
#include <malloc.h>
#include <ros/master.h>
#include <ros/package.h>
#include <ros/this_node.h>
#include <ros/xmlrpc_manager.h>
#include <rviz/display.h>
#include <rviz/properties/status_list.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <sensor_msgs/CameraInfo.h>
#include <unistd.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/FluidState.h>
#include <vest_msgs/ImageVolume.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/ParameterEdit.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <visualization_msgs/ImageMarker.h>
#include <QPixmapCache>

#include "instrument_history.h"
#include "rviz_view.h"
#include "scene_messages.h"
#include "sheet.h"

namespace vest::displays {
namespace {

using tools::Place;

// KiB that a round may leave in the heap. Measured: 1.7, which is what OpenCV keeps of the threads of the two
// views (worker.h); one texture, buffer or mesh that stays has 16 and more (docs/decisions/0030-…).
// Materials, which have 1.6, are counted by their names.
constexpr double kLeak = 10;
constexpr double kResidentLeak = 1024;  // KiB of resident memory, in the mean of many rounds

/// Number of OGRE resources per kind that bear our name.
std::map<std::string, int> ownResources() {
  std::map<std::string, int> count;
  const auto add = [&](const char* kind, Ogre::ResourceManager& manager) {
    count[kind] = 0;
    auto all = manager.getResourceIterator();
    while (all.hasMoreElements())
      if (all.getNext()->getName().rfind("vest_viz/", 0) == 0) ++count[kind];
  };
  add("materials", Ogre::MaterialManager::getSingleton());
  add("meshes", Ogre::MeshManager::getSingleton());
  add("textures", Ogre::TextureManager::getSingleton());
  return count;
}

/// KiB of the heap in use, in all arenas; the software renderer's textures and buffers are among it.
double heapKiB() {
  QPixmapCache::clear();  // a timer of Qt's empties it in its own time
#if __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 heap = mallinfo2();
#else
  const struct mallinfo heap = mallinfo();
#endif
  return static_cast<double>(heap.uordblks + heap.hblkhd) / 1024;
}

/// KiB of this process in memory, without what the allocator can give back. From one round to another it
/// moves by MiB, for the allocator does not keep its free pieces together: no measure for a few rounds.
double residentKiB() {
  malloc_trim(0);
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1024;
}

/// What a round leaves: the median of the differences to the round `period` before. What is made once, late
/// (a shader's code, an arena, a table that grows), is in few of the differences.
double leftByARound(const std::vector<double>& after, std::size_t period) {
  std::vector<double> left;
  for (std::size_t k = period; k < after.size(); ++k)
    left.push_back((after[k] - after[k - period]) / static_cast<double>(period));
  std::nth_element(left.begin(), left.begin() + static_cast<std::ptrdiff_t>(left.size() / 2), left.end());
  return left[left.size() / 2];
}

long threads() {
  long count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) count += entry.exists();
  return count;
}

class Lifecycle : public RvizView {
 protected:
  ros::Publisher topology = nh.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  ros::Publisher state = nh.advertise<vest_msgs::TissueState>("tissue/state", 1, true);
  ros::Publisher instruments = nh.advertise<vest_msgs::InstrumentStates>("instruments", 1, true);

  static vest_msgs::TissueTopology gynaecology() {
    return tools::topologyOf(
        scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml"));
  }
  void publishInstruments() {
    vest_msgs::InstrumentStates states;
    states.instruments = {tools::instrumentAt(Place::Left, {-0.03, 0.05, 0.07}, 0, 0.1),
                          tools::instrumentAt(Place::Endoscope, tools::endoscopeTip(0.1), 0, 0)};
    instruments.publish(states);
  }
  static rviz::Display* make(const char* kind) {
    rviz::Display* const display = manager->createDisplay(kind, kind, true);
    EXPECT_NE(display, nullptr) << kind;
    return display;
  }
  /// What a display says of itself in rviz's list.
  static QString status(rviz::Display* display, const char* line) {
    for (int i = 0; i < display->numChildren(); ++i)
      if (auto* const list = qobject_cast<rviz::StatusList*>(display->childAt(i)))
        for (int k = 0; k < list->numChildren(); ++k)
          if (list->childAt(k)->getName() == line) return list->childAt(k)->getValue().toString();
    return {};
  }
};

TEST_F(Lifecycle, AddedAndRemovedAgainAndAgainLeavesNothingBehind) {
  topology.publish(gynaecology());
  publishInstruments();
  // Effects and contacts that are not finite are left out.
  auto fluid = nh.advertise<vest_msgs::FluidState>("effects/fluid", 1, true);
  vest_msgs::FluidState drops;
  drops.particle_radius = 0.001f;
  drops.positions = {0, 0, 0.05f, std::nanf(""), 0, 0, 1};
  drops.pools.resize(1);
  drops.pools[0].columns = 4000000000u;
  fluid.publish(drops);
  auto contacts = nh.advertise<vest_msgs::ContactModels>("tissue/contacts", 1, true);
  vest_msgs::ContactModels forces;
  forces.contacts.resize(2);
  forces.contacts[0].in_contact = forces.contacts[1].in_contact = true;
  forces.contacts[0].proxy.orientation.w = 1;
  forces.contacts[0].wrench.force.z = 2;
  forces.contacts[1].wrench.force.z = std::nan("");
  contacts.publish(forces);
  auto images = nh.advertise<vest_msgs::ImageVolume>("image/volume", 1, true);
  vest_msgs::ImageVolume image;
  image.header.frame_id = "world";
  image.size = {4, 4, 4};
  for (int a = 0; a < 3; ++a) image.axes[4 * a] = 0.01;
  image.slope = 1;
  image.stored.assign(64, 60);
  images.publish(image);

  const bool full = std::getenv("VEST_FULL") != nullptr;
  const int rounds = full ? 100 : 12, settled = full ? 20 : 3;
  std::map<std::string, int> first;
  std::vector<double> heap, resident;
  long running = 0;
  std::printf("count: %d of 100 rounds of all displays\n", rounds);
  for (int round = 0; round < rounds; ++round) {
    // Two of each at once.
    std::vector<rviz::Display*> displays;
    for (const char* kind : {"vest_viz/EndoscopicView", "vest_viz/Tissue", "vest_viz/Contacts",
                             "vest_viz/Effects", "vest_viz/ImageVolume"})
      for (int k = 0; k < 2; ++k) displays.push_back(make(kind));
    displays[2]->subProp("Links")->setValue(true);
    displays[8]->subProp("Slice")->setValue(true);
    displays[3]->subProp("Colour By")->setValue(round % 2 == 0 ? "strain" : "material");
    // Until the topology has arrived: then each object has a mesh and a material in all four.
    ASSERT_TRUE(spin([] { return ownResources()["meshes"] >= 60; }, 60)) << "round " << round;
    spin([] { return false; }, 0.05);
    for (rviz::Display* display : displays) delete display;
    QApplication::processEvents();
    if (round == 0) first = ownResources();
    EXPECT_EQ(ownResources(), first) << "round " << round;
    if (round < settled) continue;
    if (round == settled) running = threads();
    heap.push_back(heapKiB());
    resident.push_back(residentKiB());
    if (!full || round % 5 == 0)
      std::printf("round %d: %.1f KiB in the heap, %.0f KiB resident, %ld threads\n", round, heap.back(),
                  resident.back(), threads());
  }
  EXPECT_EQ(first["meshes"], 0);
  EXPECT_LE(threads(), running);
  // Rounds alternate in what they colour by, and the heap in some KiB.
  const double left = leftByARound(heap, 2);
  const auto mean = [](const std::vector<double>& v) {
    return (v.back() - v.front()) / static_cast<double>(v.size() - 1);
  };
  std::printf("left by a round: %.2f KiB in the heap; resident memory %+.0f KiB in the mean\n", left,
              mean(resident));
  EXPECT_LT(left, kLeak) << "KiB a round";
  // What comes once weighs little over many rounds: the mean finds what does not leak in each of them.
  if (full) {
    EXPECT_LT(mean(heap), kLeak);
    EXPECT_LT(mean(resident), kResidentLeak);
  }
}

TEST_F(Lifecycle, APictureLeavesNothingBehind) {
  // Each was finished by a thread of its own once, of which OpenCV kept 850 bytes: 20 pictures 17 KiB.
  constexpr int kPictures = 20, kWindows = 7, kMostWindows = 60;
  constexpr double kLeft = 8;  // KiB in 20 pictures
  // KiB: so much more or less in a window, and what is baked for the view has not all come.
  constexpr double kBaked = 100;
  topology.publish(gynaecology());
  int pictures = 0;
  const auto counter = nh.subscribe<sensor_msgs::CameraInfo>(
      "endoscope/camera_info", 10, [&](const sensor_msgs::CameraInfo::ConstPtr&) { ++pictures; });
  rviz::Display* const view = make("vest_viz/EndoscopicView");
  view->subProp("Width")->setValue(320);
  view->subProp("Height")->setValue(256);
  // As many as the view keeps, or the heap grows by them.
  for (std::size_t k = 0; k < 2 * InstrumentHistory::kMost; ++k) {
    publishInstruments();
    spin([] { return true; });
  }
  std::vector<double> heap;
  for (int window = 0; heap.size() < kWindows; ++window) {
    ASSERT_LT(window, kMostWindows) << "the heap does not come to rest";
    const int wanted = pictures + kPictures;
    double least = 1e12;  // without the picture that the worker may have in hand
    ASSERT_TRUE(spin(
        [&] {
          publishInstruments();  // something new to draw
          least = std::min(least, heapKiB());
          return pictures >= wanted;
        },
        120))
        << pictures << " pictures";
    if (!heap.empty() && std::abs(least - heap.back()) > kBaked) heap.clear();
    heap.push_back(least);
    std::printf("%d pictures: %.1f KiB in the heap\n", pictures, heap.back());
  }
  EXPECT_LT(leftByARound(heap, 1), kLeft) << "KiB in " << kPictures << " pictures";
  delete view;
}

TEST_F(Lifecycle, AViewBesideAnotherOneOnlyShowsThePicture) {
  const auto published = [] {
    ros::V_string topics;
    ros::this_node::getAdvertisedTopics(topics);
    return std::count(topics.begin(), topics.end(), "/endoscope/camera_info") > 0;
  };
  XmlRpc::XmlRpcValue other, answer, payload;
  other[0] = "/other_view", other[1] = "/endoscope/camera_info", other[2] = "sensor_msgs/CameraInfo";
  other[3] = ros::XMLRPCManager::instance()->getServerURI();  // answers for it
  ASSERT_TRUE(ros::master::execute("registerPublisher", other, answer, payload, false));
  rviz::Display* const view = make("vest_viz/EndoscopicView");
  EXPECT_FALSE(published());
  EXPECT_TRUE(spin([&] { return status(view, "Publishing").startsWith("/other_view publishes"); }));
  XmlRpc::XmlRpcValue gone;
  gone[0] = other[0], gone[1] = other[1], gone[2] = other[3];
  ASSERT_TRUE(ros::master::execute("unregisterPublisher", gone, answer, payload, false));
  view->setEnabled(false);
  view->setEnabled(true);
  EXPECT_TRUE(published());
  EXPECT_TRUE(spin([&] { return status(view, "Publishing").isEmpty(); }));
  delete view;
}

TEST_F(Lifecycle, WhatATeacherDrawsIsOverThePictureAndHelps) {
  topology.publish(gynaecology());
  publishInstruments();
  std::vector<visualization_msgs::ImageMarker> drawn;
  std::vector<vest_msgs::ParameterEdit> edits;
  const ros::Subscriber drawn_sub = nh.subscribe<visualization_msgs::ImageMarker>(
      "session/drawing", 10,
      [&](const visualization_msgs::ImageMarker::ConstPtr& m) { drawn.push_back(*m); });
  const ros::Subscriber edit_sub = nh.subscribe<vest_msgs::ParameterEdit>(
      "parameter_edit", 10, [&](const vest_msgs::ParameterEdit::ConstPtr& m) { edits.push_back(*m); });
  auto others = nh.advertise<visualization_msgs::ImageMarker>("session/drawing", 10);
  rviz::Display* const view = make("vest_viz/EndoscopicView");
  view->subProp("Fill Window")->setValue(true);
  QWidget* pane = nullptr;
  ASSERT_TRUE(spin([&] { return (pane = panel.childAt(300, 300)) != nullptr; }));
  // Pixels of a teacher's yellow, and of tissue.
  const auto count = [&](bool ink) {
    const QImage shown = pane->grab().toImage();
    int pixels = 0;
    for (int y = 0; y < shown.height(); ++y)
      for (int x = 0; x < shown.width(); ++x) {
        const QColor c = shown.pixelColor(x, y);
        pixels += ink ? c.red() > 240 && c.green() > 200 && c.blue() > 60 && c.blue() < 120
                      : c.red() > c.blue() + 20;
      }
    return pixels;
  };
  ASSERT_TRUE(spin([&] { return count(false) > 50000; }, 120)) << "a picture";
  EXPECT_EQ(count(true), 0);
  const auto stroke = [&] {
    const auto mouse = [&](QEvent::Type type, QPoint at, Qt::MouseButton button) {
      QMouseEvent event(type, at, button, Qt::LeftButton, Qt::NoModifier);
      QApplication::sendEvent(pane, &event);
    };
    mouse(QEvent::MouseButtonPress, {250, 200}, Qt::LeftButton);
    mouse(QEvent::MouseMove, {300, 250}, Qt::NoButton);
    mouse(QEvent::MouseButtonRelease, {400, 320}, Qt::LeftButton);
    spin([] { return false; }, 0.3);
  };
  stroke();
  EXPECT_TRUE(drawn.empty()) << "nobody took a pen";
  view->subProp("Draw")->setValue("arrow");
  ASSERT_TRUE(spin([&] { return drawn_sub.getNumPublishers() > 0 && edit_sub.getNumPublishers() > 0; }));
  stroke();
  ASSERT_TRUE(spin([&] { return !drawn.empty() && !edits.empty(); }));
  EXPECT_EQ(edits[0].object + " " + edits[0].parameter, "exercise assisted");
  EXPECT_TRUE(spin([&] { return count(true) > 300; })) << "over the trainee's picture, by the topic";
  if (const char* const keep = std::getenv("VEST_PICTURES")) pane->grab().save(QString(keep) + "/drawn.png");
  const int arrow = count(true);
  visualization_msgs::ImageMarker circle = drawn[0];
  circle.type = visualization_msgs::ImageMarker::CIRCLE;
  circle.position.x = 0.3, circle.position.y = 0.7, circle.scale = 0.2f;
  others.publish(circle);
  EXPECT_TRUE(spin([&] { return count(true) > arrow + 300; })) << "anybody's";
  view->setEnabled(false);
  view->setEnabled(true);
  ASSERT_TRUE(spin([&] { return (pane = panel.childAt(300, 300)) != nullptr; }));
  EXPECT_EQ(count(true), 0);
  delete view;
}

TEST_F(Lifecycle, RepeatedEmptyAndOtherTopologiesLeaveNothingBehind) {
  const vest_msgs::TissueTopology whole = gynaecology();
  publishInstruments();
  rviz::Display* const view = make("vest_viz/EndoscopicView");
  rviz::Display* const tissue = make("vest_viz/Tissue");
  const auto show = [&](const vest_msgs::TissueTopology& t) {
    topology.publish(t);
    const std::string wanted = std::to_string(t.objects.size()) + " objects";
    return spin([&] { return status(tissue, "Tissue").startsWith(QString::fromStdString(wanted)); }, 60);
  };
  ASSERT_TRUE(show(whole)) << status(tissue, "Tissue").toStdString();
  ASSERT_TRUE(
      spin([&] { return ownResources()["meshes"] >= 2 * static_cast<int>(whole.objects.size()) - 2; }));
  spin([] { return false; }, 0.5);
  const auto before = ownResources();
  for (int round = 0; round < 5; ++round) {
    ASSERT_TRUE(show(whole)) << "the same again";
    ASSERT_TRUE(show(sheet("uterus"))) << "another scene";
    topology.publish(vest_msgs::TissueTopology());
    ASSERT_TRUE(spin([&] { return status(tissue, "Tissue") == "no topology yet"; })) << "an empty one";
    ASSERT_TRUE(show(whole));
  }
  EXPECT_TRUE(spin([&] { return ownResources()["meshes"] == before.at("meshes"); }));
  spin([] { return false; }, 0.5);
  EXPECT_EQ(ownResources()["meshes"], before.at("meshes"));
  EXPECT_LE(ownResources()["materials"], before.at("materials"));
  delete view;
  delete tissue;
}

TEST_F(Lifecycle, AMillionVerticesAreShownColouredAndMoved) {
  const vest_msgs::TissueTopology million = sheet("uterus", 1000);
  rviz::Display* const tissue = make("vest_viz/Tissue");
  rviz::Property* const camera = manager->getViewManager()->getCurrent();
  camera->subProp("Distance")->setValue(0.06);
  camera->subProp("Pitch")->setValue(1.5);
  camera->subProp("Near Clip Distance")->setValue(0.005);
  topology.publish(million);
  ASSERT_TRUE(spin([&] { return status(tissue, "Tissue").contains("1002001 vertices"); }, 120))
      << status(tissue, "Tissue").toStdString();
  const auto middle = [&] {
    const std::string file = testing::TempDir() + "vest_million_" + std::to_string(getpid()) + ".png";
    panel.getRenderWindow()->writeContentsToFile(file);
    const QImage image(QString::fromStdString(file));
    std::filesystem::remove(file);
    return image.pixelColor(image.width() / 2, image.height() / 2);
  };
  ASSERT_TRUE(spin([&] { return middle().red() > middle().blue() + 20; }, 60)) << "tissue, not rviz's grey";
  vest_msgs::TissueState s;
  s.header.frame_id = "world";
  s.revision = 1;
  s.positions = million.objects[0].rest_position;
  s.positions[0] = std::nanf("");
  state.publish(s);
  ASSERT_TRUE(spin([&] { return status(tissue, "Tissue").contains("not finite"); }, 240));
  for (std::size_t k = 0; k < s.positions.size(); k += 3)
    s.positions[k] = million.objects[0].rest_position[k] + 1;
  state.publish(s);
  EXPECT_TRUE(spin([&] { return std::abs(middle().red() - middle().blue()) < 20; }, 60)) << "it went aside";
  delete tissue;
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_lifecycle");
  QApplication application(argc, argv);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
