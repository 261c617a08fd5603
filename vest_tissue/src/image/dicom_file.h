/// One DICOM file, by GDCM. These functions belong into a worker: GDCM trusts files more than one may.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vest::image {

inline constexpr std::size_t kMostFrames = 65536;  ///< of all files together

/// What a frame's header says, without pointers: a worker passes it on in shared memory. Nothing here names a
/// patient. Texts end with 0.
struct FrameHeader {
  enum Kind : std::uint32_t { Image, Report, Other };
  std::uint32_t kind, file, frame, frames;
  char series[68], modality[20], photometric[20], syntax[68], rescale_type[20], phase[68], acquisition[20];
  std::uint32_t columns, rows, samples, allocated, stored, high_bit, is_signed;
  bool localizer, has_position, has_orientation, has_spacing, rescaled, has_padding;
  double position[3], row[3], column[3];  ///< mm, patient; directions in which columns and rows count up
  double spacing[2];                      ///< mm between rows, between columns
  double thickness;                       ///< mm; 0: not said
  double slope, intercept;
  std::int32_t number, of;  ///< instance number, images in acquisition; 0: not said
  std::int64_t padding[2];  ///< stored values, in either order
};

/// Headers of all frames of a file, at most `most`; `file` is left 0. A file that is no DICOM at all, as
/// words and pictures beside the images are, has Kind::Other. @throws std::invalid_argument: damaged
std::size_t readHeaders(const std::string& path, FrameHeader* headers, std::size_t most);

/// Stored values of all frames, as bytes of this machine. @throws std::invalid_argument: damaged, not decoded
std::vector<char> readStored(const std::string& path, const FrameHeader& header);

}  // namespace vest::image
