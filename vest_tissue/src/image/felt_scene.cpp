#include "vest_tissue/image/felt_scene.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/image/brick.h"
#include "vest_tissue/material/database.h"
#include "written_scene.h"

namespace vest::image {
namespace {

namespace fs = std::filesystem;

constexpr double kTop = 0.115, kMiddle = 0.05;  // m, world: where tissue begins; the middle of the box, y
constexpr double kAround = 0.03;                // m to each side of it
constexpr double kTissue = -300;                // HU: above that it is no air (Kalender 2011: fat -100)

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace

std::string writeFeltScene(const Volume& volume, const std::string& folder, const std::string& table,
                           const std::function<void(const std::string& scene)>& check) {
  const std::string name = fs::absolute(folder).lexically_normal().filename().string();
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
  };
  if (name.empty() || !std::all_of(name.begin(), name.end(), plain))
    throw std::invalid_argument(
        files::shown(folder, 4096) +
        ": the folder's name becomes that of the scene: letters, digits, _ and - are allowed");
  const std::string images = files::shown(volume.slices.empty() ? folder : volume.slices.front().file, 4096);
  if (table.empty() && volume.unit != "HU")
    throw std::invalid_argument(
        images +
        ": the shipped table is for values in HU, and the images do not say that theirs are: give one by "
        "--table");
  volume::Brick brick = toBrick(volume, {0, kMiddle, 0});
  double top = -1e300;
  for (std::uint32_t k = 0; k < brick.size[2]; ++k)
    for (std::uint32_t j = 0; j < brick.size[1]; ++j)
      for (std::uint32_t i = 0; i < brick.size[0]; ++i) {
        const Eigen::Vector3d at = brick.origin + brick.axes * Eigen::Vector3d(i, j, k);
        if (std::abs(at.x()) > kAround || std::abs(at.y() - kMiddle) > kAround || at.z() <= top) continue;
        const std::int16_t n = brick.stored[(std::size_t{k} * brick.size[1] + j) * brick.size[0] + i];
        if (n != volume::Brick::kNothing && (volume.unit != "HU" || brick.value(n) > kTissue)) top = at.z();
      }
  if (!(top > -1e300))
    throw std::invalid_argument(images + ": there is nothing but air over the middle of the images");
  brick.origin.z() += kTop - top;

  const fs::path source = table.empty() ? fs::path(material::databasePath()).parent_path().parent_path() /
                                              "scenes/ct_puncture/needle.csv"
                                        : fs::path(table);
  WrittenScene written(folder);
  written.save("needle.csv", scene::yaml::readFile(source.string(), std::size_t{1} << 20));
  std::string raw(2 * brick.stored.size(), '\0');
  for (std::size_t i = 0; i < brick.stored.size(); ++i) {
    const auto bits = static_cast<std::uint16_t>(brick.stored[i]);
    raw[2 * i] = static_cast<char>(bits & 255);
    raw[2 * i + 1] = static_cast<char>(bits >> 8);
  }
  written.save(name + ".raw", raw);
  std::string axes;
  for (int r = 0; r < 3; ++r)
    axes += std::string(r > 0 ? ", " : "") + "[" + number(brick.axes(r, 0)) + ", " +
            number(brick.axes(r, 1)) + ", " + number(brick.axes(r, 2)) + "]";
  std::string text =
      "# Written by vest_import feel: a needle and a probe in these images.\nvest_scene: 1\nname: " + name +
      "\ngravity: [0, 0, -9.81]\nseed: 1\nsolution: {integrator: newton_euler, dt: 0.001}\nimage:\n"
      "  file: " +
      name + ".raw\n  size: [" + std::to_string(brick.size[0]) + ", " + std::to_string(brick.size[1]) + ", " +
      std::to_string(brick.size[2]) + "]\n  axes: [" + axes + "]\n  origin: [" + number(brick.origin.x()) +
      ", " + number(brick.origin.y()) + ", " + number(brick.origin.z()) + "]\n";
  if (brick.slope != 1 || brick.intercept != 0)
    text += "  slope: " + number(brick.slope) + "\n  intercept: " + number(brick.intercept) + "\n";
  if (!brick.unit.empty()) text += "  unit: " + brick.unit + "\n";
  text += "  table: needle.csv\n";
  if (volume.unit == "HU")
    text +=
        "  regions:\n"
        "    - {name: soft, values: [-300, 150]}\n"
        "    - {name: bone, values: [150, 30000], roles: [forbidden], drawn: true}\n";
  written.save(name + ".yaml", text);
  try {
    return written.finish(name + ".yaml", check);
  } catch (const std::exception& error) {  // of a table that was given, its own name
    const std::string copy = files::shown((fs::path(folder) / "needle.csv").string(), 4096);
    const std::string message = error.what();
    if (table.empty() || message.compare(0, copy.size(), copy) != 0) throw;
    throw std::invalid_argument(files::shown(table, 4096) + message.substr(copy.size()));
  }
}

}  // namespace vest::image
