
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "series.h"
#include "vest_instruments/files/read.h"
#include "volume_file.h"
#include "worker.h"

namespace vest::image {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr std::size_t kMostFiles = 20000;

std::vector<std::string> filesOf(const std::string& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) throw std::invalid_argument(path + ": does not exist");
  if (!fs::is_directory(status)) return {path};
  std::vector<std::string> files;
  for (auto it = fs::recursive_directory_iterator(path, error);
       !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    if (it->is_directory(error)) {
      if (it.depth() >= 8) throw std::invalid_argument(it->path().string() + ": more than 8 folders deep");
      continue;
    }
    files.push_back(it->path().string());
    if (files.size() > kMostFiles) throw std::invalid_argument(path + ": more than 20000 files");
  }
  if (error) throw std::invalid_argument(path + ": " + error.message());
  if (files.empty()) throw std::invalid_argument(path + ": no file in it");
  std::sort(files.begin(), files.end());  // messages and notes do not depend on the order in the folder
  return files;
}

struct HeaderTable {
  std::size_t count;
  FrameHeader frames[kMostFrames];
};

std::vector<FrameHeader> headersOf(const std::vector<std::string>& files) {
  const auto memory = sharedMemory(sizeof(HeaderTable));
  auto& table = *static_cast<HeaderTable*>(memory.get());
  inWorker(files, [&](std::size_t i) {
    const std::size_t added = readHeaders(files[i], table.frames + table.count, kMostFrames - table.count);
    for (std::size_t f = 0; f < added; ++f)
      table.frames[table.count + f].file = static_cast<std::uint32_t>(i);
    table.count += added;
  });
  std::vector<FrameHeader> headers(table.frames, table.frames + std::min(table.count, kMostFrames));
  for (FrameHeader& h : headers) {
    if (h.file >= files.size())
      throw std::invalid_argument(files.front() + ": is damaged: its reader failed");
    for (char* const text : {&h.series[67], &h.modality[19], &h.photometric[19], &h.syntax[67],
                             &h.rescale_type[19], &h.phase[67], &h.acquisition[19]})
      *text = 0;
    for (const auto& [text, length] : {std::pair(h.modality, 19), std::pair(h.photometric, 19)})
      for (int c = 0; c < length && text[c] != 0; ++c)
        if (text[c] < 32 || text[c] > 126) text[c] = '?';
  }
  return headers;
}

/// A stored value with its sign.
struct Stored {
  const char* bytes;
  std::size_t width;
  std::uint32_t bits;
  bool is_signed;
  std::int64_t operator[](std::size_t i) const {
    std::uint32_t raw = 0;
    std::memcpy(&raw, bytes + i * width, width);
    const std::int64_t value = raw & (0xffffffffu >> (32 - bits));
    return is_signed && (value >> (bits - 1)) != 0 ? value - (std::int64_t{1} << bits) : value;
  }
};

double rescale(const FrameHeader& f, std::int64_t stored) {
  return f.slope * static_cast<double>(stored) + f.intercept;
}

/// Rescaled values of a frame. @returns false where 16-bit whole numbers cannot hold them
template <class Value>
bool convert(const FrameHeader& f, const std::vector<char>& bytes, Value* to) {
  const std::size_t count = std::size_t{f.columns} * f.rows, width = f.allocated / 8;
  const Stored stored{bytes.data() + f.frame * count * width, width, f.stored, f.is_signed != 0};
  for (std::size_t i = 0; i < count; ++i) {
    const double value = rescale(f, stored[i]);
    if constexpr (std::is_same_v<Value, std::int16_t>)
      if (!(value >= -32768 && value <= 32767 && value == std::floor(value))) return false;
    to[i] = static_cast<Value>(value);
  }
  return true;
}

/// Pixels of all frames, one after the other, by a worker; null where `Value` cannot hold them.
template <class Value>
std::shared_ptr<Value> pixelsOf(const std::vector<std::string>& files,
                                const std::vector<FrameHeader>& frames) {
  const std::size_t layer = std::size_t{frames[0].columns} * frames[0].rows;
  const auto memory = sharedMemory(layer * frames.size() * sizeof(Value) + 1);
  auto* const values = static_cast<Value*>(memory.get());
  bool& wider = *reinterpret_cast<bool*>(values + layer * frames.size());
  std::vector<std::string> names;  // each file once, in the order of its first slice
  std::vector<std::vector<std::size_t>> of_file;
  std::vector<std::size_t> number(files.size(), files.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    std::size_t& n = number[frames[k].file];
    if (n == files.size()) n = names.size(), names.push_back(files[frames[k].file]), of_file.emplace_back();
    of_file[n].push_back(k);
  }
  inWorker(names, [&](std::size_t i) {
    if (wider) return;
    const auto bytes = readStored(names[i], frames[of_file[i].front()]);
    for (const std::size_t k : of_file[i])
      if (!convert(frames[k], bytes, values + k * layer)) wider = true;
  });
  if (wider) return nullptr;
  return {memory, values};
}

Slice sliceOf(const FrameHeader& f, const std::vector<std::string>& files) {
  Slice slice;
  slice.position = positionOf(f);
  slice.file = files[f.file];
  if (f.has_padding) {
    const double a = rescale(f, f.padding[0]), b = rescale(f, f.padding[1]);
    // As the values are kept: in single precision where they are no 16-bit whole numbers.
    slice.padding_low = static_cast<float>(std::min(a, b)),
    slice.padding_high = static_cast<float>(std::max(a, b));
  }
  return slice;
}

/// Slices at one place: equal ones are left out. @returns frames that stay
template <class Value>
void dropDuplicates(const std::vector<FrameHeader>& frames, const std::vector<std::string>& files,
                    Value* values, Volume& volume) {
  const std::size_t layer = volume.layer();
  std::size_t dropped = 0, kept = 0;
  std::string one;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    Slice slice = sliceOf(frames[k], files);
    // Nearer than a thousandth of a pixel is one place.
    const double same = 1e-6 * frames[k].spacing[0];
    if (kept > 0 && (slice.position - volume.slices[kept - 1].position).norm() <= same) {
      if (std::memcmp(values + k * layer, values + (kept - 1) * layer, layer * sizeof(Value)) != 0)
        throw std::invalid_argument(slice.file + ": duplicate: another picture at the place of " +
                                    volume.slices[kept - 1].file);
      ++dropped, one = slice.file;
      continue;
    }
    if (kept != k) std::memmove(values + kept * layer, values + k * layer, layer * sizeof(Value));
    volume.slices.push_back(std::move(slice)), ++kept;
  }
  volume.size[2] = static_cast<std::uint32_t>(kept);
  if (dropped > 0)
    volume.notes.push_back("duplicate: " + std::to_string(dropped) +
                           " left out that equal another at their place, " + one);
}

void setGrid(const std::vector<FrameHeader>& frames, Volume& volume) {
  const FrameHeader& f = frames.front();
  volume.origin = volume.slices.front().position;
  const Vector3d row(f.row[0], f.row[1], f.row[2]), column(f.column[0], f.column[1], f.column[2]);
  volume.axes.col(0) = 1e-3 * f.spacing[1] * row.normalized();
  volume.axes.col(1) = 1e-3 * f.spacing[0] * column.normalized();
  if (volume.slices.size() > 1) {
    volume.axes.col(2) =
        (volume.slices.back().position - volume.origin) / static_cast<double>(volume.slices.size() - 1);
  } else {
    if (!(f.thickness > 0 && f.thickness <= 1e3))
      throw std::invalid_argument(volume.slices.front().file +
                                  ": a single slice without slice thickness is no volume");
    volume.axes.col(2) = 1e-3 * f.thickness * row.cross(column).normalized();
    volume.notes.push_back("single slice: its thickness stands for the distance between slices");
  }
}

/// Judged as one regular grid.
Volume judged(Volume volume, const ReadOptions& options) {
  const Spacing spacing = judgeSpacing(volume);
  const bool tilted = volume.tilt() > 0.05 * M_PI / 180;
  if (spacing.even && !tilted) return volume;
  if (options.resample) return resampled(volume, spacing);
  if (!spacing.even) throw std::invalid_argument(spacing.cause + "; --resample interpolates");
  char text[80];
  std::snprintf(text, sizeof text, "tilt of %.4g degrees: axes are sheared", volume.tilt() * 180 / M_PI);
  volume.notes.push_back(text);
  return volume;
}

}  // namespace

Volume read(const std::string& path, const ReadOptions& options) {
  if (isVolumeFile(path) && !fs::is_directory(path)) {
    if (!options.series.empty()) throw std::invalid_argument(path + ": --series: the file holds one volume");
    return judged(readVolumeFile(path), options);
  }
  const auto files = filesOf(path);
  Series series = chooseSeries(path, files, headersOf(files), options.series);
  const auto& frames = series.frames;
  const FrameHeader& first = frames.front();
  Volume volume;
  volume.notes = std::move(series.notes);
  volume.modality = first.modality, volume.photometric = first.photometric;
  const std::string type = first.rescale_type;
  if (volume.modality == "CT" && first.rescaled && (type.empty() || type == "HU")) volume.unit = "HU";
  volume.size = {first.columns, first.rows, 0};
  if (const auto whole = pixelsOf<std::int16_t>(files, frames)) {
    dropDuplicates(frames, files, whole.get(), volume);
    volume.whole = whole;
  } else {
    const auto real = pixelsOf<float>(files, frames);
    dropDuplicates(frames, files, real.get(), volume);
    volume.real = real;
  }
  setGrid(frames, volume);
  if (volume.photometric == "MONOCHROME1")
    volume.notes.push_back("MONOCHROME1: low values are meant to be shown bright");
  return judged(std::move(volume), options);
}

}  // namespace vest::image
