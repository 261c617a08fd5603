#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <map>
#include <optional>
#include <unordered_map>

#include <Eigen/Geometry>

#include "vest_tissue/volume/mesh_file.h"
#include "words.h"

// Surfaces are read here and not by a library: docs/decisions/0004-files-are-read-strictly.md.
namespace vest::volume {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostTriangles = 500000;  // of a file (assumed)
constexpr std::size_t kMostCorners = 64;        // of a polygon (assumed)
// Of a coordinate, as a float holds it. What is too large for its mesh is refused there, with both sizes.
constexpr double kLargest = 1e38;

/// Collects polygons; vertices at one place are one vertex.
class Builder {
 public:
  explicit Builder(const std::string& path) : path_(path) {}

  [[noreturn]] void fail(const std::string& where, const std::string& what) const {
    throw std::invalid_argument(files::shown(path_, 4096) + where + ": " + what);
  }
  std::size_t size() const { return number_.size(); }
  void vertex(const Vector3d& v, const std::string& where) {
    if (number_.size() == kMostNodes) fail(where, "more than " + std::to_string(kMostNodes) + " vertices");
    number_.push_back(place(v, where));
  }
  /// Of the file's vertices, from 0.
  void polygon(const std::vector<std::size_t>& corners, const std::string& where) {
    std::vector<Index> k;
    for (const std::size_t c : corners) {
      if (c >= number_.size())
        fail(where, "vertex " + std::to_string(c) + "; allowed: 0 to " +
                        (number_.empty() ? "none: there is no vertex" : std::to_string(number_.size() - 1)));
      k.push_back(number_[c]);
    }
    face(k, where);
  }
  void triangle(const std::array<Vector3d, 3>& v, const std::string& where) {
    face({place(v[0], where), place(v[1], where), place(v[2], where)}, where);
  }
  Surface take() {
    if (surface_.triangles.empty()) fail("", "no triangles; allowed: at least one");
    return std::move(surface_);
  }

 private:
  Index place(const Vector3d& v, const std::string& where) {
    for (const double c : {v.x(), v.y(), v.z()}) {
      if (std::fabs(c) <= kLargest) continue;
      char text[32];
      std::snprintf(text, sizeof text, "%g", c);
      fail(where, std::string("a coordinate of ") + text + "; allowed: from -1e38 to 1e38");
    }
    // 0.0 + : a negative zero is the same place.
    const auto [found, fresh] = known_.emplace(std::array<double, 3>{0.0 + v[0], 0.0 + v[1], 0.0 + v[2]},
                                               static_cast<Index>(surface_.vertices.size()));
    if (fresh) surface_.vertices.push_back(v);
    return found->second;
  }

  void face(const std::vector<Index>& k, const std::string& where) {
    const std::size_t n = k.size();
    if (n < 3 || n > kMostCorners)
      fail(where,
           "a face of " + std::to_string(n) + " corners; allowed: 3 to " + std::to_string(kMostCorners));
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n; ++j)
        if (k[i] == k[j]) fail(where, "a face with two corners at one place; allowed: corners that differ");
    if (surface_.triangles.size() + n - 2 > kMostTriangles)
      fail(where, "more than " + std::to_string(kMostTriangles) + " triangles");
    const std::size_t first = n == 3 ? 0 : fanFrom(k, where);
    for (std::size_t i = 1; i + 1 < n; ++i)
      surface_.triangles.push_back({k[first], k[(first + i) % n], k[(first + i + 1) % n]});
  }

  /// Corner from which a fan fills the polygon: the one that turns inwards, if any.
  std::size_t fanFrom(const std::vector<Index>& k, const std::string& where) const {
    const std::size_t n = k.size();
    const auto& x = surface_.vertices;
    Vector3d normal = Vector3d::Zero();  // Newell's: twice the area
    for (std::size_t i = 0; i < n; ++i) normal += (x[k[i]] - x[k[0]]).cross(x[k[(i + 1) % n]] - x[k[0]]);
    std::optional<std::size_t> inward;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector3d in = x[k[i]] - x[k[(i + n - 1) % n]], out = x[k[(i + 1) % n]] - x[k[i]];
      if (in.cross(out).dot(normal) >= 0.0) continue;
      if (inward || n > 4)
        fail(where, "a polygon of " + std::to_string(n) +
                        " corners that is not convex; allowed: triangles, quadrilaterals, convex polygons "
                        "(triangulate it where it is made)");
      inward = i;
    }
    return inward.value_or(0);
  }

  const std::string& path_;
  Surface surface_;
  std::vector<Index> number_;  ///< per vertex of the file: of the surface
  struct Hash {
    std::size_t operator()(const std::array<double, 3>& v) const {
      std::uint64_t h = 0;
      for (const double c : v) {
        std::uint64_t bits;
        std::memcpy(&bits, &c, sizeof bits);
        h = (h ^ bits) * 0x9e3779b97f4a7c15ull;  // Fibonacci hashing (Knuth, TAOCP 3, 6.4)
        h ^= h >> 29;
      }
      return static_cast<std::size_t>(h);
    }
  };
  std::unordered_map<std::array<double, 3>, Index, Hash> known_;
};

std::string atLine(int line) {
  return ":" + std::to_string(line);
}

Surface readObj(const std::string& path, const std::string& text) {
  // A line that ends with a backslash goes on in the next one; the count of lines stays.
  std::string bytes = text;
  for (std::size_t at = bytes.find('\\'); at != std::string::npos; at = bytes.find('\\', at + 1)) {
    const std::size_t end = bytes.compare(at + 1, 2, "\r\n") == 0 ? at + 2 : at + 1;
    if (end < bytes.size() && bytes[end] == '\n') bytes[at] = bytes[end] = ' ';
  }
  Words in(path, bytes);
  Builder out(path);
  std::string word;
  std::vector<std::size_t> corners;
  while (in.next(word)) {
    if (word == "v") {
      Vector3d v;
      for (int a = 0; a < 3; ++a) {
        if (!in.nextOfLine(word)) in.fail("a vertex of " + std::to_string(a) + " numbers; allowed: three");
        v[a] = in.toNumber(word, "a coordinate");
      }
      for (int more = 0; in.nextOfLine(word); ++more) {  // weight, or colour
        if (more == 4) in.fail("a vertex of more than 7 numbers; allowed: x y z, then weight or colour");
        in.toNumber(word, "a number of a vertex");
      }
      out.vertex(v, atLine(in.line()));
    } else if (word == "f") {
      corners.clear();
      while (in.nextOfLine(word)) {
        const std::string number = word.substr(0, word.find('/'));
        const bool good = word.find_first_not_of("0123456789-/") == std::string::npos;
        double value = 0.0;
        if (!good || !files::parseNumber(number, value) || value == 0.0 || std::fabs(value) > 1e9 ||
            value != std::floor(value))
          in.fail("'" + files::shown(word, 40) +
                  "'; allowed: vertex, vertex/texture/normal, from 1, or from -1 backwards");
        const double index = value > 0.0 ? value - 1.0 : static_cast<double>(out.size()) + value;
        if (!(index >= 0.0 && index < static_cast<double>(out.size())))
          in.fail("a face names vertex " + number + "; allowed: the " + std::to_string(out.size()) +
                  " above it, from 1, or from -1 backwards");
        if (corners.size() > kMostCorners) break;
        corners.push_back(static_cast<std::size_t>(index));
      }
      out.polygon(corners, atLine(in.line()));
    } else if (word[0] == '#' || word == "vt" || word == "vn" || word == "g" || word == "o" || word == "s" ||
               word == "usemtl" || word == "mtllib" || word == "l" || word == "p") {
      in.skipLine();
    } else {
      in.fail("'" + files::shown(word, 40) +
              "'; allowed: v, vt, vn, f, g, o, s, usemtl, mtllib, l, p and lines that begin with #");
    }
  }
  return out.take();
}

std::uint32_t littleEndian(const char* p) {
  std::uint32_t v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

Surface readBinaryStl(const std::string& path, const std::string& bytes) {
  Builder out(path);
  const std::size_t count = (bytes.size() - 84) / 50;
  for (std::size_t t = 0; t < count; ++t) {
    std::array<Vector3d, 3> v;
    for (std::size_t i = 0; i < 9; ++i) {
      float c;
      const std::uint32_t bits = littleEndian(bytes.data() + 84 + 50 * t + 12 + 4 * i);
      std::memcpy(&c, &bits, sizeof c);
      v[i / 3][static_cast<Eigen::Index>(i % 3)] = static_cast<double>(c);
    }
    out.triangle(v, ": facet " + std::to_string(t));
  }
  return out.take();
}

Surface readStl(const std::string& path, const std::string& bytes) {
  const bool text = bytes.compare(0, 5, "solid") == 0;
  if (bytes.size() >= 84) {
    const std::size_t said = littleEndian(bytes.data() + 80);
    if (bytes.size() == 84 + 50 * said) return readBinaryStl(path, bytes);
    if (!text)
      throw std::invalid_argument(files::shown(path, 4096) + ": " + std::to_string(bytes.size()) +
                                  " bytes; allowed: " + std::to_string(84 + 50 * said) + " for its " +
                                  std::to_string(said) + " facets, or a text that begins with solid");
  }
  Words in(path, bytes);
  Builder out(path);
  std::string word;
  if (!text) in.fail("does not begin with solid; allowed: STL, text or binary");
  bool open = false;
  while (in.next(word)) {
    if (word == "solid" && !open) {
      open = true;
      in.skipLine();
    } else if (word == "endsolid" && open) {
      open = false;
      in.skipLine();
    } else if (word == "facet" && open) {
      in.expect("normal");
      for (int a = 0; a < 3; ++a) in.word("a normal");  // not used: it follows from the corners
      in.expect("outer");
      in.expect("loop");
      std::array<Vector3d, 3> v;
      for (Vector3d& corner : v) {
        in.expect("vertex");
        for (int a = 0; a < 3; ++a) corner[a] = in.number("a coordinate");
      }
      in.expect("endloop");
      in.expect("endfacet");
      out.triangle(v, atLine(in.line()));
    } else {
      in.fail("'" + files::shown(word, 40) + "'; allowed here: " + (open ? "facet, endsolid" : "solid"));
    }
  }
  if (open) in.fail("ends within a solid; allowed: a last line endsolid");
  return out.take();
}

enum class Scalar { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };

struct Property {
  std::string name;
  Scalar type = Scalar::Float;
  bool list = false;
  Scalar count = Scalar::Uint8;
};

bool isCorners(const Property& p) {
  return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
}

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

/// Numbers of the body of a PLY file, text or binary.
class PlyBody {
 public:
  PlyBody(const std::string& path, const std::string& bytes, Words& words, int order)
      : path_(path), bytes_(bytes), words_(words), order_(order), at_(words.place() + 1) {}

  double number(Scalar type) {
    if (order_ == 0) return words_.number("a value");
    static constexpr std::size_t kSize[] = {1, 1, 2, 2, 4, 4, 4, 8};
    const std::size_t size = kSize[static_cast<int>(type)];
    if (at_ > bytes_.size() || bytes_.size() - at_ < size) {
      throw std::invalid_argument(files::shown(path_, 4096) + ": ends after " +
                                  std::to_string(bytes_.size()) +
                                  " bytes; allowed: all elements that its header counts");
    }
    std::array<char, 8> b{};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(at_), size, b.begin());
    if (order_ > 0) std::reverse(b.begin(), b.begin() + static_cast<std::ptrdiff_t>(size));
    at_ += size;
    const auto as = [&](auto value) {
      std::memcpy(&value, b.data(), sizeof value);
      return static_cast<double>(value);
    };
    switch (type) {
      case Scalar::Int8:
        return as(std::int8_t{});
      case Scalar::Uint8:
        return as(std::uint8_t{});
      case Scalar::Int16:
        return as(std::int16_t{});
      case Scalar::Uint16:
        return as(std::uint16_t{});
      case Scalar::Int32:
        return as(std::int32_t{});
      case Scalar::Uint32:
        return as(std::uint32_t{});
      case Scalar::Float:
        return as(float{});
      default:
        return as(double{});
    }
  }
  std::string where(const Element& e, std::size_t i) const {
    return order_ == 0 ? atLine(words_.line()) : ": " + files::shown(e.name) + " " + std::to_string(i);
  }
  void end() {
    std::string more;
    if (order_ == 0 && words_.next(more))
      words_.fail("'" + files::shown(more, 40) + "'; allowed here: the end");
    if (order_ != 0 && at_ != bytes_.size()) {
      throw std::invalid_argument(files::shown(path_, 4096) + ": " + std::to_string(bytes_.size() - at_) +
                                  " bytes after the last element; allowed: none");
    }
  }

 private:
  const std::string& path_;
  const std::string& bytes_;
  Words& words_;
  int order_;  ///< 0: text; -1: little-endian, 1: big-endian
  std::size_t at_;
};

std::vector<Element> readPlyHeader(Words& in, int& order) {
  const auto scalar = [&](const std::string& word) {
    static const std::map<std::string, Scalar> known{
        {"char", Scalar::Int8},     {"int8", Scalar::Int8},     {"uchar", Scalar::Uint8},
        {"uint8", Scalar::Uint8},   {"short", Scalar::Int16},   {"int16", Scalar::Int16},
        {"ushort", Scalar::Uint16}, {"uint16", Scalar::Uint16}, {"int", Scalar::Int32},
        {"int32", Scalar::Int32},   {"uint", Scalar::Uint32},   {"uint32", Scalar::Uint32},
        {"float", Scalar::Float},   {"float32", Scalar::Float}, {"double", Scalar::Double},
        {"float64", Scalar::Double}};
    const auto found = known.find(word);
    if (found == known.end()) in.fail("type '" + files::shown(word, 40) + "'; allowed: char … double");
    return found->second;
  };
  if (in.word("ply") != "ply") in.fail("does not begin with ply; allowed: PLY, text or binary");
  std::string word;
  std::vector<Element> elements;
  bool format = false;
  for (;;) {
    word = in.word("end_header");
    if (word == "end_header") break;
    if (word == "comment" || word == "obj_info") {
      in.skipLine();
    } else if (word == "format" && !format) {
      format = true;
      word = in.word("a format");
      if (word != "ascii" && word != "binary_little_endian" && word != "binary_big_endian")
        in.fail("format '" + files::shown(word, 40) +
                "'; allowed: ascii, binary_little_endian, binary_big_endian");
      order = word == "ascii" ? 0 : word == "binary_big_endian" ? 1 : -1;
      in.expect("1.0");
    } else if (word == "element") {
      if (elements.size() == 16) in.fail("more than 16 elements");
      Element e;
      e.name = in.word("a name");
      for (const Element& other : elements)
        if (other.name == e.name) in.fail("element '" + files::shown(e.name, 40) + "' twice; allowed: once");
      e.count = in.whole("a count of elements", 2 * kMostNodes);
      elements.push_back(std::move(e));
    } else if (word == "property" && !elements.empty()) {
      if (elements.back().properties.size() == 64) in.fail("more than 64 properties");
      Property p;
      word = in.word("a type");
      p.list = word == "list";
      if (p.list) {
        p.count = scalar(in.word("a type"));
        if (p.count >= Scalar::Float) in.fail("a list counted by a float; allowed: whole numbers");
        word = in.word("a type");
      }
      p.type = scalar(word);
      p.name = in.word("a name");
      for (const Property& other : elements.back().properties)
        if (other.name == p.name) in.fail("property '" + files::shown(p.name, 40) + "' twice; allowed: once");
      elements.back().properties.push_back(std::move(p));
    } else {
      in.fail("'" + files::shown(word, 40) +
              "'; allowed here: comment, obj_info, format, element, property, end_header");
    }
  }
  if (!format) in.fail("no format; allowed: format ascii, binary_little_endian or binary_big_endian 1.0");
  return elements;
}

Surface readPly(const std::string& path, const std::string& bytes) {
  Words in(path, bytes);
  int order = 0;
  const std::vector<Element> elements = readPlyHeader(in, order);
  if (order != 0 && bytes.compare(in.place(), 2, "\r\n") == 0) in.skipLine();
  PlyBody body(path, bytes, in, order);
  Builder out(path);
  bool has_vertices = false, has_faces = false;
  std::vector<std::size_t> corners;
  for (const Element& e : elements) {
    const bool vertex = e.name == "vertex", face = e.name == "face";
    int axes = 0, lists = 0;
    for (const Property& p : e.properties) {
      axes += !p.list && (p.name == "x" || p.name == "y" || p.name == "z");
      lists += isCorners(p);
    }
    if (vertex && axes != 3) in.fail("vertices without x, y, z; allowed: the three of them");
    if (face && lists != 1) in.fail("faces without one list vertex_indices; allowed: one");
    if (face && !has_vertices) in.fail("faces before the vertices; allowed: after them");
    has_vertices = has_vertices || vertex;
    has_faces = has_faces || face;
    if (e.properties.empty() && e.count > 0) in.fail("an element without properties; allowed: at least one");
    for (std::size_t i = 0; i < e.count; ++i) {
      Vector3d v = Vector3d::Zero();
      corners.clear();
      for (const Property& p : e.properties) {
        if (!p.list) {
          const double value = body.number(p.type);
          if (vertex && p.name.size() == 1 && p.name[0] >= 'x' && p.name[0] <= 'z')
            v[p.name[0] - 'x'] = value;
          continue;
        }
        const double size = body.number(p.count);
        const bool of_face = face && isCorners(p);
        if (!(size >= 0.0 && size <= (of_face ? static_cast<double>(kMostCorners) : 1e6)) ||
            size != std::floor(size))
          out.fail(body.where(e, i), "a list of " + std::to_string(size) + " entries; allowed: 0 to " +
                                         std::to_string(of_face ? kMostCorners : 1000000));
        for (std::size_t k = 0; k < static_cast<std::size_t>(size); ++k) {
          const double index = body.number(p.type);
          if (!of_face) continue;
          if (!(index >= 0.0 && index < static_cast<double>(out.size())) || index != std::floor(index)) {
            char number[32];
            std::snprintf(number, sizeof number, "%.10g", index);
            out.fail(body.where(e, i), std::string("a face names vertex ") + number + "; allowed: below " +
                                           std::to_string(out.size()));
          }
          corners.push_back(static_cast<std::size_t>(index));
        }
      }
      if (vertex) out.vertex(v, body.where(e, i));
      if (face) out.polygon(corners, body.where(e, i));
    }
  }
  if (!has_vertices || !has_faces) in.fail("no vertices or no faces; allowed: both");
  body.end();
  return out.take();
}

}  // namespace

Surface readSurface(const std::string& path, const std::string& bytes) {
  const std::string ending = endingOf(path);
  if (ending == "obj") return readObj(path, bytes);
  if (ending == "stl") return readStl(path, bytes);
  if (ending == "ply") return readPly(path, bytes);
  throw std::invalid_argument(files::shown(path, 4096) + ": '." + files::shown(ending) +
                              "'; allowed: .obj, .stl or .ply");
}

}  // namespace vest::volume
