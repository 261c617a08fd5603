#include "series.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>
#include <tuple>

#include "vest_instruments/files/read.h"

namespace vest::image {
namespace {

using Eigen::Vector3d;
using Group = std::vector<FrameHeader>;

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument(what);
}

Vector3d vectorOf(const double (&v)[3]) {
  return {v[0], v[1], v[2]};
}

Vector3d normalOf(const FrameHeader& f) {
  return vectorOf(f.row).cross(vectorOf(f.column)).normalized();
}

/// Pictures that lie on one grid: same series, size, direction, spacing and phase.
bool alike(const FrameHeader& a, const FrameHeader& b) {
  const auto key = [](const FrameHeader& f) {
    return std::tuple(std::string(f.series), f.columns, f.rows, f.samples, std::string(f.phase),
                      std::string(f.modality), f.has_position && f.has_orientation && f.has_spacing);
  };
  if (key(a) != key(b)) return false;
  const double turned =
      std::max((vectorOf(a.row) - vectorOf(b.row)).norm(), (vectorOf(a.column) - vectorOf(b.column)).norm());
  const double wider = std::max(std::abs(a.spacing[0] - b.spacing[0]), std::abs(a.spacing[1] - b.spacing[1]));
  return turned < 2e-4 && wider <= 1e-4 * std::abs(a.spacing[0]);
}

std::string describe(const Group& group, const std::vector<std::string>& files) {
  const FrameHeader& f = group.front();
  return (f.modality[0] != 0 ? std::string(f.modality) : "no modality") + ", " +
         std::to_string(group.size()) + (group.size() == 1 ? " picture" : " pictures") + " of " +
         std::to_string(f.columns) + " x " + std::to_string(f.rows) + ", " + files[f.file];
}

/// @throws std::invalid_argument: why these pictures are no volume
void checkPictures(const Group& group, const std::vector<std::string>& files) {
  for (const FrameHeader& f : group) {
    const std::string file = files[f.file] + ": ";
    const std::string photometric = f.photometric;
    if (f.samples != 1 || (photometric != "MONOCHROME1" && photometric != "MONOCHROME2"))
      refuse(file + "colour: a volume needs grey values (MONOCHROME1 or MONOCHROME2), not " +
             (photometric.empty() ? "pictures without photometric interpretation" : photometric));
    if ((f.allocated != 8 && f.allocated != 16 && f.allocated != 32) || f.stored < 1 ||
        f.stored > f.allocated || f.high_bit + 1 != f.stored || f.is_signed > 1)
      refuse(file + "pixel format: " + std::to_string(f.stored) + " bits stored of " +
             std::to_string(f.allocated) + ", high bit " + std::to_string(f.high_bit) + " is not read");
    if (f.columns == 0 || f.rows == 0)
      refuse(file + "a picture of " + std::to_string(f.columns) + " x " + std::to_string(f.rows));
    if (!f.has_position || !f.has_orientation)
      refuse(file + "no position: without image position and orientation it is a picture, no volume");
    if (!f.has_spacing) refuse(file + "no pixel spacing: it is a picture, no volume");
    const Vector3d row = vectorOf(f.row), column = vectorOf(f.column), place = vectorOf(f.position);
    if (std::abs(row.norm() - 1) > 1e-3 || std::abs(column.norm() - 1) > 1e-3 ||
        std::abs(row.dot(column)) > 1e-3)
      refuse(file + "orientation: its two directions must be unit vectors at a right angle");
    if (!(f.spacing[0] >= 1e-4 && f.spacing[0] <= 1e3 && f.spacing[1] >= 1e-4 && f.spacing[1] <= 1e3))
      refuse(file + "pixel spacing: 0.0001 … 1000 mm are allowed");
    if (!(place.cwiseAbs().maxCoeff() <= 1e6)) refuse(file + "position: at most 1000000 mm are allowed");
    if (!(std::abs(f.slope) <= 1e30 && f.slope != 0 && std::abs(f.intercept) <= 1e30))
      refuse(file + "rescale slope and intercept: a slope of 0, or beyond 1e30");
  }
  const FrameHeader& first = group.front();
  if (group.size() * std::size_t{first.columns} * first.rows > kMostVoxels)
    refuse(files[first.file] + ": " + std::to_string(group.size()) + " slices of " +
           std::to_string(first.columns) + " x " + std::to_string(first.rows) +
           ": a volume has at most 2^28 voxels");
}

double along(const FrameHeader& f, const Vector3d& normal) {
  return normal.dot(vectorOf(f.position));
}

/// What is missing at an end leaves the others evenly apart: the pictures' numbers alone tell of it.
void noteEnds(Series& series) {
  std::int32_t first = series.frames.front().number, last = 0, of = 0;
  for (const FrameHeader& f : series.frames) {
    if (f.frames > 1 || f.number == 0) return;
    first = std::min(first, f.number), last = std::max(last, f.number), of = std::max(of, f.of);
  }
  const auto count = static_cast<std::int32_t>(series.frames.size());
  if (of > 0 ? of <= count : first == 1) return;  // phases may be numbered on
  series.notes.push_back("missing slice at an end? " + std::to_string(count) + " pictures, numbered " +
                         std::to_string(first) + " to " + std::to_string(last) +
                         (of > count ? "; the acquisition has " + std::to_string(of) : std::string()));
}

/// Whether several acquisitions lie at the same places.
bool phases(const Group& group, std::vector<Group>& split) {
  std::map<std::string, Group> by;
  for (const auto& f : group) by[f.acquisition].push_back(f);
  if (by.size() < 2) return false;
  const Vector3d normal = normalOf(group.front());
  std::map<std::string, std::set<long long>> places;
  std::size_t distinct = 0;
  std::set<long long> all;
  for (const auto& [name, frames] : by)
    for (const auto& f : frames)
      places[name].insert(std::llround(along(f, normal) * 1e3)),
          all.insert(std::llround(along(f, normal) * 1e3));
  for (const auto& [name, at] : places) distinct += at.size();
  if (distinct != group.size() || all.size() == group.size()) return false;
  for (auto& [name, frames] : by) split.push_back(std::move(frames));
  return true;
}

}  // namespace

Vector3d positionOf(const FrameHeader& f) {
  return 1e-3 * vectorOf(f.position);
}

Series chooseSeries(const std::string& path, const std::vector<std::string>& files,
                    const std::vector<FrameHeader>& headers, const std::string& wanted) {
  Series chosen;
  std::vector<Group> groups;
  std::map<std::string, std::pair<std::size_t, std::string>> aside;
  const auto setAside = [&](const char* kind, const FrameHeader& f) {
    auto& [count, file] = aside[kind];
    if (count++ == 0) file = files[f.file];
  };
  const bool pictures = std::any_of(headers.begin(), headers.end(), [](const FrameHeader& f) {
    return f.kind == FrameHeader::Image && !f.localizer;
  });
  for (const FrameHeader& f : headers) {
    if (f.kind == FrameHeader::Other) {
      setAside("no DICOM", f);
    } else if (f.kind == FrameHeader::Report) {
      if (!pictures)
        refuse(files[f.file] + ": report, plan or other object without a picture" +
               (f.modality[0] != 0 ? std::string(" (") + f.modality + ")" : std::string()));
      setAside("report, plan or other object without a picture", f);
    } else if (f.localizer && pictures) {
      setAside("localizer", f);
    } else {
      const auto same =
          std::find_if(groups.begin(), groups.end(), [&](const Group& g) { return alike(g.front(), f); });
      if (same == groups.end())
        groups.push_back({f});
      else
        same->push_back(f);
    }
  }
  for (const auto& [kind, what] : aside)
    chosen.notes.push_back("set aside: " + std::to_string(what.first) + " (" + kind + "), " + what.second);
  if (groups.empty()) refuse(path + ": no DICOM image in it");
  std::vector<Group> split;
  for (Group& g : groups)
    if (!phases(g, split)) split.push_back(std::move(g));
  groups = std::move(split);

  std::string list;
  std::size_t found = groups.size() == 1 && wanted.empty() ? 0 : groups.size(), hits = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    list += (i == 0 ? "" : "; ") + std::to_string(i + 1) + " (" + describe(groups[i], files) + ")";
    if (!wanted.empty() && (wanted == std::to_string(i + 1) || wanted == groups[i].front().series))
      found = i, ++hits;
  }
  if (found == groups.size() || hits > 1)
    refuse(path +
           (wanted.empty() || hits > 1 ? ": mixed series: choose one with --series: "
                                       : ": --series " + wanted + ": not in it; it has ") +
           list);
  chosen.frames = std::move(groups[found]);
  checkPictures(chosen.frames, files);
  const Vector3d normal = normalOf(chosen.frames.front());
  std::stable_sort(
      chosen.frames.begin(), chosen.frames.end(),
      [&](const FrameHeader& a, const FrameHeader& b) { return along(a, normal) < along(b, normal); });
  const FrameHeader &first = chosen.frames.front(), &last = chosen.frames.back();
  if (first.frames > 1 && along(first, normal) == along(last, normal))
    refuse(files[first.file] + ": no position for each frame of a multi-frame file");
  noteEnds(chosen);
  return chosen;
}

Spacing judgeSpacing(const Volume& volume) {
  Spacing s;
  const auto& slices = volume.slices;
  if (slices.size() < 2) return s;
  const Vector3d normal = volume.axes.col(0).cross(volume.axes.col(1)).normalized();
  std::vector<double> distances;
  std::vector<Vector3d> steps;
  for (std::size_t k = 1; k < slices.size(); ++k) {
    steps.push_back(slices[k].position - slices[k - 1].position);
    distances.push_back(normal.dot(steps.back()));
  }
  std::vector<double> sorted = distances;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
  s.median = sorted[sorted.size() / 2];
  s.largest = *std::max_element(distances.begin(), distances.end());
  const Vector3d mean =
      (slices.back().position - slices.front().position) / static_cast<double>(steps.size());
  const auto uneven = [&](std::size_t k, const char* format, double mm) {
    char text[120];
    std::snprintf(text, sizeof text, format, 1e3 * mm, 1e3 * s.median);
    s.even = false;
    s.cause = slices[k + 1].file + ": " + text + ", after " + slices[k].file;
  };
  for (std::size_t k = 0; k < steps.size() && s.even;
       ++k) {  // a missing slice tells more than what it shifts
    const double times = distances[k] / s.median;
    if (times > 1.5 && std::abs(times - std::round(times)) < 0.05)
      uneven(k, "missing slice: spacing %.6g mm where the others have %.6g mm", distances[k]);
  }
  for (std::size_t k = 0; k < steps.size() && s.even; ++k)
    if (std::abs(distances[k] - s.median) > kEven * s.median)
      uneven(k, "spacing: %.6g mm where the others have %.6g mm", distances[k]);
  for (std::size_t k = 0; k < steps.size() && s.even; ++k) {
    const double side = (steps[k] - mean * (distances[k] / normal.dot(mean))).norm();
    const double drift =
        (slices[k + 1].position - slices.front().position - static_cast<double>(k + 1) * mean).norm();
    if (side > kEven * s.median || drift > 0.1 * s.median)
      uneven(k, "spacing: %.6g mm off the line through all slices, which are %.6g mm apart",
             std::max(side, drift));
  }
  return s;
}

}  // namespace vest::image
