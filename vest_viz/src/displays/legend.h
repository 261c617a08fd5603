#pragma once

#include <string>
#include <vector>

#include <OgreMaterial.h>
#include <OgreTexture.h>
#include <QColor>
#include <QString>

namespace Ogre {
class Overlay;
class OverlayContainer;
}  // namespace Ogre

namespace vest::displays {

/// A scale or a list of colours in the corner of rviz's 3-D view.
class Legend {
 public:
  Legend();
  ~Legend();
  Legend(const Legend&) = delete;
  Legend& operator=(const Legend&) = delete;

  /// A scale of inspect::valueColour from low to high.
  void showScale(const QString& title, double low, double high);
  void showList(const QString& title, const std::vector<std::pair<QString, QColor>>& rows);
  /// Lines of text alone.
  void showText(const std::vector<std::string>& lines);
  void hide();
  /// @param corner 0: upper left, 1: lower left
  void setCorner(int corner) { corner_ = corner; }

 private:
  template <class F>
  void paint(int width, int height, F&& draw);

  Ogre::Overlay* overlay_ = nullptr;
  Ogre::OverlayContainer* panel_ = nullptr;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
  int corner_ = 0;
};

}  // namespace vest::displays
