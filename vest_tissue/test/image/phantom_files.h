#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "temporary_scene.h"
#include "vest_tissue/image/phantom.h"

namespace vest::test {

inline image::Volume headOf(std::uint32_t columns, std::uint32_t slices) {
  image::PhantomImage options;
  options.size = {columns, columns - 4, slices};
  options.noise = 8;
  return image::picture(image::makePhantom("head"), options);
}

/// A folder with a series; goes away at the end.
struct SeriesFolder : TemporaryScene {
  SeriesFolder(const image::Volume& volume, const std::string& fault) {
    image::writeDicom(volume, folder(), fault);
  }
};

inline std::string bytesOf(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What reading says; empty: it was taken.
inline std::string refusal(const std::function<void()>& read) {
  try {
    read();
    return {};
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

}  // namespace vest::test
