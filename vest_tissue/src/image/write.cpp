#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <locale>
#include <sstream>
#include <stdexcept>

#include <Eigen/LU>

#include "vest_tissue/image/volume.h"
#include "vest_tissue/volume/mesh_file.h"

namespace vest::image {
namespace {

std::string list(const Eigen::Vector3d& v, const char* between) {
  char text[96];
  std::snprintf(text, sizeof text, "%.17g%s%.17g%s%.17g", v[0], between, v[1], between, v[2]);
  return text;
}

/// http://teem.sourceforge.net/nrrd/format.html; lengths in mm, as viewers expect.
std::string nrrdHeader(const Volume& v) {
  std::string axes;
  for (int a = 0; a < 3; ++a) axes += (a == 0 ? "(" : " (") + list(1e3 * v.axes.col(a), ",") + ")";
  return std::string("NRRD0004\ntype: ") + (v.whole ? "int16" : "float") +
         "\ndimension: 3\nspace: left-posterior-superior\nsizes: " + std::to_string(v.size[0]) + " " +
         std::to_string(v.size[1]) + " " + std::to_string(v.size[2]) + "\nspace directions: " + axes +
         "\nkinds: domain domain domain\nspace units: \"mm\" \"mm\" \"mm\"\nendian: little\nencoding: "
         "raw\nspace origin: (" +
         list(1e3 * v.origin, ",") + ")\n\n";
}

/// https://itk.org/Wiki/ITK/MetaIO/Documentation
std::string metaHeader(const Volume& v) {
  const Eigen::Matrix3d d = v.direction();
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
         "False\n"
         "TransformMatrix = " +
         list(d.col(0), " ") + " " + list(d.col(1), " ") + " " + list(d.col(2), " ") +
         "\nOffset = " + list(1e3 * v.origin, " ") +
         "\nCenterOfRotation = 0 0 0\nElementSpacing = " + list(1e3 * v.spacing(), " ") +
         "\nDimSize = " + std::to_string(v.size[0]) + " " + std::to_string(v.size[1]) + " " +
         std::to_string(v.size[2]) + "\nElementType = " + (v.whole ? "MET_SHORT" : "MET_FLOAT") +
         "\nElementDataFile = LOCAL\n";
}

}  // namespace

void write(const Volume& volume, const std::string& path) {
  const std::string ending = volume::endingOf(path);
  if (ending != "nrrd" && ending != "mha")
    throw std::invalid_argument(path + ": ending: .nrrd and .mha can be written");
  if (ending == "mha" && !(volume.direction().transpose() * volume.direction()).isIdentity(1e-4))
    throw std::invalid_argument(
        path + ": a tilted series has sheared axes, which MetaImage cannot say; write .nrrd, or --resample");
  std::ofstream out(path, std::ios::binary);
  out << (ending == "nrrd" ? nrrdHeader(volume) : metaHeader(volume));
  if (volume.whole)
    out.write(reinterpret_cast<const char*>(volume.whole.get()),
              static_cast<std::streamsize>(2 * volume.voxels()));
  else
    out.write(reinterpret_cast<const char*>(volume.real.get()),
              static_cast<std::streamsize>(4 * volume.voxels()));
  out.close();
  if (!out) throw std::invalid_argument(path + ": cannot be written: " + std::strerror(errno));
}

}  // namespace vest::image
