#pragma once

#include <string>

#include <QImage>
#include <QPixmap>
#include <QString>

#include "vest_viz/texture/organ_texture.h"

namespace vest::panels {

inline QString qt(const std::string& text) {
  return QString::fromStdString(text);
}

constexpr int kLookSize = 96;  ///< pixels

/// A piece of the organ's surface as the view textures it, unlit.
inline QPixmap lookOf(const std::string& organ) {
  constexpr int kSize = 256;
  const texture::Baked baked = texture::bake(texture::styleOf(organ), kSize, 1);
  const QImage image(baked.albedo.data(), kSize, kSize, QImage::Format_RGBA8888);
  return QPixmap::fromImage(
      image.convertToFormat(QImage::Format_RGB888).scaledToWidth(kLookSize, Qt::SmoothTransformation));
}

}  // namespace vest::panels
