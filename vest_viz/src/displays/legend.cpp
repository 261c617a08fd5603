#include "legend.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <Overlay/OgreOverlay.h>
#include <Overlay/OgreOverlayContainer.h>
#include <Overlay/OgreOverlayManager.h>
#include <QImage>
#include <QPainter>

#include "ogre_assets.h"
#include "ogre_versions.h"
#include "vest_viz/inspect/colour_map.h"

namespace vest::displays {
namespace {

constexpr int kMargin = 12, kLine = 18;  // pixels

QColor toQt(const inspect::Colour& c) {
  return QColor::fromRgbF(static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2]));
}

}  // namespace

Legend::Legend() {
  auto& overlays = Ogre::OverlayManager::getSingleton();
  overlay_ = overlays.create(uniqueName("legend"));
  panel_ = static_cast<Ogre::OverlayContainer*>(overlays.createOverlayElement("Panel", uniqueName("legend")));
  panel_->setMetricsMode(Ogre::GMM_PIXELS);
  material_ = Ogre::MaterialManager::getSingleton().create(uniqueName("legend"), kOgreGroup);
  Ogre::Pass* pass = material_->getTechnique(0)->getPass(0);
  pass->setSceneBlending(Ogre::SBT_TRANSPARENT_ALPHA);
  pass->setLightingEnabled(false);
  pass->setDepthCheckEnabled(false);
  pass->setDepthWriteEnabled(false);
  overlay_->add2D(panel_);
}

Legend::~Legend() {
  auto& overlays = Ogre::OverlayManager::getSingleton();
  overlay_->hide();
  overlay_->remove2D(panel_);
  overlays.destroyOverlayElement(panel_);
  overlays.destroy(overlay_);
  drop(material_);
  drop(texture_);
}

void Legend::hide() {
  overlay_->hide();
}

template <class F>
void Legend::paint(int width, int height, F&& draw) {
  if (!texture_.get() || texture_->getWidth() != static_cast<std::uint32_t>(width) ||
      texture_->getHeight() != static_cast<std::uint32_t>(height)) {
    drop(texture_);
    texture_ = Ogre::TextureManager::getSingleton().createManual(
        uniqueName("legend"), kOgreGroup, Ogre::TEX_TYPE_2D, static_cast<Ogre::uint>(width),
        static_cast<Ogre::uint>(height), 0, Ogre::PF_A8R8G8B8, Ogre::TU_DEFAULT);
    Ogre::Pass* pass = material_->getTechnique(0)->getPass(0);
    pass->removeAllTextureUnitStates();
    pass->createTextureUnitState()->setTexture(texture_);
    useMaterial(panel_, material_);
    panel_->setDimensions(static_cast<float>(width), static_cast<float>(height));
    panel_->setHorizontalAlignment(Ogre::GHA_LEFT);
    panel_->setVerticalAlignment(corner_ == 0 ? Ogre::GVA_TOP : Ogre::GVA_BOTTOM);
    panel_->setPosition(kMargin, static_cast<float>(corner_ == 0 ? kMargin : -height - kMargin));
  }
  QImage image(width, height, QImage::Format_ARGB32);
  image.fill(QColor(20, 22, 26, 170));
  QPainter painter(&image);
  painter.setRenderHint(QPainter::TextAntialiasing);
  QFont font = painter.font();
  font.setPixelSize(13);
  painter.setFont(font);
  painter.setPen(Qt::white);
  draw(&painter);
  painter.end();
  const Ogre::PixelBox box(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), 1,
                           Ogre::PF_A8R8G8B8, image.bits());
  texture_->getBuffer()->blitFromMemory(box);
  overlay_->show();
}

void Legend::showScale(const QString& title, double low, double high) {
  constexpr int kWidth = 190, kHeight = 190, kTop = 34, kBottom = 14;
  paint(kWidth, kHeight, [&](QPainter* p) {
    p->drawText(8, 18, title);
    const int length = kHeight - kTop - kBottom;
    for (int y = 0; y < length; ++y) {
      p->setPen(toQt(inspect::valueColour(1.0f - static_cast<float>(y) / static_cast<float>(length - 1))));
      p->drawLine(10, kTop + y, 30, kTop + y);
    }
    p->setPen(Qt::white);
    for (double value : inspect::ticks(low, high, 6)) {
      const int y = kTop + static_cast<int>((1 - (value - low) / (high - low)) * (length - 1));
      p->drawLine(30, y, 35, y);
      p->drawText(40, y + 5, QString::number(value, 'g', 4));
    }
  });
}

void Legend::showList(const QString& title, const std::vector<std::pair<QString, QColor>>& rows) {
  const int shown = std::min<int>(static_cast<int>(rows.size()), 28);
  paint(210, 30 + kLine * shown, [&](QPainter* p) {
    p->drawText(8, 18, title);
    for (int i = 0; i < shown; ++i) {
      const int y = 26 + kLine * i;
      p->fillRect(10, y + 3, 12, 12, rows[static_cast<std::size_t>(i)].second);
      p->drawText(30, y + 14, rows[static_cast<std::size_t>(i)].first);
    }
  });
}

void Legend::showText(const std::vector<std::string>& lines) {
  paint(260, 12 + kLine * std::max<int>(1, static_cast<int>(lines.size())), [&](QPainter* p) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      p->drawText(8, 18 + kLine * static_cast<int>(i), QString::fromStdString(lines[i]));
  });
}

}  // namespace vest::displays
