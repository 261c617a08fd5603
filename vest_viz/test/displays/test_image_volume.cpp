// Protects the display of a patient's image in a real rviz view: the volume lies over what is behind it and
// under what is before it, slices have the grey of their values, tables are chosen and edited live, and
// damaged messages and tables are refused with a word.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>

#include <OgreRenderWindow.h>
#include <rviz/display.h>
#include <rviz/properties/status_list.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <unistd.h>
#include <vest_msgs/ImageVolume.h>
#include <vest_msgs/TissueTopology.h>
#include <QColor>
#include <QImage>

#include "rviz_view.h"
#include "sheet.h"

namespace vest::displays {
namespace {

/// 20 mm of one value round (0, 0, height).
vest_msgs::ImageVolume block(double height, std::int16_t value = 50) {
  vest_msgs::ImageVolume m;
  m.header.frame_id = "world";
  m.name = "block";
  m.size = {10, 10, 10};
  for (int a = 0; a < 3; ++a) m.axes[4 * a] = 0.002;
  m.origin = {-0.009, -0.009, height - 0.009};
  m.slope = 1;
  m.nothing = -32768;
  m.stored.assign(1000, value);
  return m;
}

class ImageVolume : public RvizView {
 protected:
  ros::Publisher images = nh.advertise<vest_msgs::ImageVolume>("image/volume", 1, true);
  ros::Publisher topology = nh.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  rviz::Display* display = nullptr;
  std::string file =
      (std::filesystem::temp_directory_path() / ("vest_image_" + std::to_string(getpid()))).string();

  void SetUp() override {
    std::ofstream(file + ".csv") << "value,red,green,blue,alpha\n0,0,1,0,0.5\n100,0,1,0,0.5\n";
    rviz::Property* const camera = manager->getViewManager()->getCurrent();
    camera->subProp("Distance")->setValue(0.2);
    camera->subProp("Pitch")->setValue(1.5);
    camera->subProp("Near Clip Distance")->setValue(0.005);
    display = manager->createDisplay("vest_viz/ImageVolume", "image", true);
    ASSERT_NE(display, nullptr);
    table()->setValue(QString::fromStdString(file + ".csv"));
  }
  void TearDown() override {
    delete display;
    std::filesystem::remove(file + ".csv");
  }
  rviz::Property* table() const { return display->subProp("Volume")->subProp("Table"); }
  QString status(const char* line) const {
    for (int i = 0; i < display->numChildren(); ++i)
      if (auto* const list = qobject_cast<rviz::StatusList*>(display->childAt(i)))
        for (int k = 0; k < list->numChildren(); ++k)
          if (list->childAt(k)->getName() == line) return list->childAt(k)->getValue().toString();
    return {};
  }
  QImage picture() const {
    panel.getRenderWindow()->writeContentsToFile(file + ".png");
    const QImage image(QString::fromStdString(file + ".png"));
    std::filesystem::remove(file + ".png");
    return image;
  }
  QColor middle() const {
    const QImage image = picture();
    return image.pixelColor(image.width() / 2, image.height() / 2);
  }
  static bool green(const QColor& c) { return c.green() > c.red() + 60 && c.green() > c.blue() + 60; }
};

TEST_F(ImageVolume, LiesBeforeAndBehindSurfacesAsItIs) {
  topology.publish(sheet("uterus"));
  rviz::Display* const tissue = manager->createDisplay("vest_viz/Tissue", "tissue", true);
  images.publish(block(0.03));
  ASSERT_TRUE(spin([&] { return green(middle()); }, 30)) << "before the sheet";
  images.publish(block(-0.03));
  EXPECT_TRUE(spin([&] { return !green(middle()); }, 30)) << "behind it";
  EXPECT_GT(middle().red(), middle().blue() + 10) << "the sheet is seen";
  tissue->setEnabled(false);
  EXPECT_TRUE(spin([&] { return green(middle()); }, 30)) << "the sheet is gone";
  delete tissue;
}

TEST_F(ImageVolume, IsSharpAtRest) {
  images.publish(block(0));
  ASSERT_TRUE(spin([&] { return green(middle()); }, 30));
  // Pixels of the middle row between 10 and 90 % of the green: the coarse picture has more than one at an
  // edge.
  const auto blurred = [&] {
    const QImage image = picture();
    int low = 255, high = 0, count = 0;
    for (int pass = 0; pass < 2; ++pass)
      for (int x = 0; x < image.width(); ++x) {
        const QColor c = image.pixelColor(x, image.height() / 2);
        const int value = c.green() - c.red();
        if (pass == 0) low = std::min(low, value), high = std::max(high, value);
        count += pass == 1 && value > low + 0.1 * (high - low) && value < low + 0.9 * (high - low);
      }
    return high > low + 60 ? count : 1000;
  };
  EXPECT_TRUE(spin([&] { return blurred() <= 2; }, 30)) << blurred();
}

TEST_F(ImageVolume, TheGraphicsCardShowsWhatTheProcessorShows) {
  // Values that change, a hole in which nothing was measured, a surface through the middle, a cut.
  vest_msgs::ImageVolume m = block(0);
  for (std::size_t v = 0; v < 1000; ++v) {
    const double x = static_cast<double>(v % 10) - 4.5, y = static_cast<double>(v / 10 % 10) - 4.5,
                 z = static_cast<double>(v / 100) - 4.5;
    m.stored[v] = static_cast<std::int16_t>(100 - 12 * std::sqrt(x * x + y * y + z * z));
    if (x > 0 && y > 0 && z > 2) m.stored[v] = m.nothing;
  }
  std::ofstream(file + ".csv") << "value,red,green,blue,alpha\n20,1,0,0,0\n60,0,1,0,0.2\n100,0,0,1,0.5\n";
  table()->setValue("soft");
  table()->setValue(QString::fromStdString(file + ".csv"));
  topology.publish(sheet("uterus"));
  rviz::Display* const tissue = manager->createDisplay("vest_viz/Tissue", "tissue", true);
  manager->getViewManager()->getCurrent()->subProp("Pitch")->setValue(0.7);
  display->subProp("Slice")->setValue(true);
  display->subProp("Slice")->subProp("Offset")->setValue(0.006);
  images.publish(m);
  // A picture that stays for longer than a coarse one does.
  const auto atRest = [&] {
    QImage last;
    int same = 0;
    EXPECT_TRUE(spin(
        [&] {
          const QImage now = picture();
          same = now == last ? same + 1 : 0;
          last = now;
          return same > 30;
        },
        60));
    return last;
  };
  ASSERT_TRUE(spin([&] { return status("Image").contains("10 x 10 x 10"); }, 30));
  ASSERT_TRUE(spin([&] { return middle().blue() > middle().red() + 20; }, 30))
      << middle().name().toStdString();
  const QImage processor = atRest();
  display->subProp("Volume")->setValue(false);
  const QImage without = atRest();
  display->subProp("Volume")->setValue(true);
  display->subProp("Volume")->subProp("Graphics Card")->setValue(true);
  const QImage card = atRest();
  EXPECT_TRUE(status("Graphics Card").isEmpty()) << status("Graphics Card").toStdString();
  ASSERT_EQ(card.size(), processor.size());
  const auto differs = [](QRgb a, QRgb b) {
    return std::max(
        {std::abs(qRed(a) - qRed(b)), std::abs(qGreen(a) - qGreen(b)), std::abs(qBlue(a) - qBlue(b))});
  };
  int shown = 0, aside = 0, most = 0;
  for (int y = 0; y < card.height(); ++y)
    for (int x = 0; x < card.width(); ++x) {
      const int off = differs(card.pixel(x, y), processor.pixel(x, y));
      shown += differs(processor.pixel(x, y), without.pixel(x, y)) > 2;
      aside += off > 2;
      most = std::max(most, off);
    }
  EXPECT_GT(shown, 1000);
  EXPECT_EQ(aside, 0) << "of " << shown << " pixels with the volume; the worst by " << most << " levels";
  delete tissue;
}

TEST_F(ImageVolume, ATableIsChosenAndEditedLive) {
  images.publish(block(0));
  ASSERT_TRUE(spin([&] { return green(middle()); }, 30));
  rviz::Property* const rows = display->subProp("Volume")->subProp("Rows");
  ASSERT_EQ(rows->numChildren(), 2);
  for (int r = 0; r < 2; ++r) rows->childAt(r)->subProp("Color")->setValue(QColor(255, 0, 0));
  EXPECT_TRUE(spin([&] { return middle().red() > middle().green() + 60; }, 30));
  rows->childAt(0)->subProp("Value")->setValue(100);
  EXPECT_TRUE(spin([&] { return status("Table").contains("above that of the row before"); }, 10));
  table()->setValue("bone");
  EXPECT_EQ(rows->numChildren(), 5);
  EXPECT_TRUE(spin([&] { return std::abs(middle().red() - middle().green()) < 20; }, 30)) << "50 is no bone";
  table()->setValue("/nowhere/a.csv");
  EXPECT_TRUE(spin([&] { return status("Table").contains("/nowhere/a.csv"); }, 10));
  EXPECT_EQ(rows->numChildren(), 5) << "the one before goes on";
}

TEST_F(ImageVolume, SlicesHaveTheGreyOfTheirValues) {
  display->subProp("Volume")->setValue(false);
  display->subProp("Level")->setValue(100);
  display->subProp("Window")->setValue(201);
  images.publish(block(0));
  const auto grey = [&](int wanted) {
    return spin(
        [&] {
          const QColor c = middle();
          return std::abs(c.red() - wanted) < 4 && std::abs(c.green() - wanted) < 4 &&
                 std::abs(c.blue() - wanted) < 4;
        },
        30);
  };
  display->subProp("Coronal")->setValue(true);
  EXPECT_TRUE(grey(64)) << middle().name().toStdString();
  display->subProp("Level")->setValue(0);
  EXPECT_TRUE(grey(192)) << middle().name().toStdString();
  display->subProp("Coronal")->setValue(false);
  display->subProp("Slice")->setValue(true);
  display->subProp("Slice")->subProp("Normal")->subProp("X")->setValue(0.3);
  display->subProp("Slice")->subProp("Normal")->subProp("Z")->setValue(0.9);
  EXPECT_TRUE(grey(192)) << "oblique: " << middle().name().toStdString();
  display->subProp("Slice")->setValue(false);
  display->subProp("Volume")->setValue(true);
  EXPECT_TRUE(spin([&] { return green(middle()); }, 30));
}

TEST_F(ImageVolume, DamagedMessagesAreRefused) {
  images.publish(block(0));
  ASSERT_TRUE(spin([&] { return status("Image").contains("10 x 10 x 10"); }, 30))
      << status("Image").toStdString();
  const auto refused = [&](const char* word, const std::function<void(vest_msgs::ImageVolume*)>& damage) {
    vest_msgs::ImageVolume m = block(0);
    damage(&m);
    images.publish(m);
    EXPECT_TRUE(spin([&] { return status("Image").contains(word); }, 30)) << word;
    images.publish(block(0));
    EXPECT_TRUE(spin([&] { return status("Image").contains("10 x 10 x 10"); }, 30)) << word;
  };
  refused("number of values", [](auto* m) { m->stored.pop_back(); });
  refused("number of values", [](auto* m) { m->size = {0, 10, 10}; });
  refused("number of values", [](auto* m) { m->size = {4000000000u, 4000000000u, 4000000000u}; });
  refused("origin", [](auto* m) { m->origin[1] = std::numeric_limits<double>::quiet_NaN(); });
  refused("axes", [](auto* m) { m->axes[8] = 0; });
  refused("axes", [](auto* m) { m->axes = {1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3}; });
  refused("slope", [](auto* m) { m->slope = 0; });
  EXPECT_TRUE(spin([&] { return green(middle()); }, 30));
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_image_volume");
  QApplication application(argc, argv);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
