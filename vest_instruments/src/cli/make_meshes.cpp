// Writes the visual meshes of all tools as binary STL: `make_meshes --output DIR`. The results are kept in
// meshes/.
//
// Frames: TOOL_shaft and TOOL_fixed in the tip frame (shaft along −z), TOOL_jaw_left and TOOL_jaw_right in
// the frame of their jaw (origin on the jaws' axis, z to the point, the other jaw on the other side of x =
// 0).
#include <algorithm>
#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "mesh_builder.h"
#include "vest_instruments/tools/tool_geometry.h"

namespace {

using namespace vest::meshes;
namespace tools = vest::tools;
using vest::tools::ToolGeometry;
using vest::tools::toolGeometry;
using vest::tools::ToolKind;

constexpr double kShaftLength = 0.35;  // m beyond the tip frame's origin

/// Rows of teeth: 0 … depth, one tooth per `pitch`.
double tooth(double z, double pitch, double depth) {
  const double phase = z / pitch - std::floor(z / pitch);
  return depth * (phase < 0.5 ? 2.0 * phase : 2.0 - 2.0 * phase);
}

/// Round knuckle about the jaws' axis, on one side of the middle.
void addKnuckle(Mesh& mesh, double radius, double y_low, double y_high) {
  std::vector<Ring> rings;
  for (const double y : {y_low, y_high}) {
    Ring ring;
    for (int k = 0; k < 16; ++k) {
      const double a = 2.0 * M_PI * k / 16;
      ring.emplace_back(radius * std::cos(a), y, radius * std::sin(a));
    }
    rings.push_back(ring);
  }
  mesh.loft(rings);
}

/// A jaw as a loft along z of half-round bars on the side x > 0.
/// @param width half width in y, @param height in x, @param inner x of the inner face; each of z
template <class Width, class Height, class Inner>
void addBar(Mesh& mesh, double z0, double z1, int stations, Width width, Height height, Inner inner) {
  std::vector<Ring> rings;
  for (int i = 0; i <= stations; ++i) {
    const double z = z0 + (z1 - z0) * i / stations, w = width(z), h = height(z), x0 = inner(z);
    Ring ring{Vector3d(x0, -w, z), Vector3d(x0, 0, z), Vector3d(x0, w, z)};
    for (int k = 0; k <= 6; ++k) {  // the rounded back
      const double a = M_PI * k / 6;
      ring.emplace_back(0.35 * h + 0.65 * h * std::sin(a), w * std::cos(a), z);
    }
    rings.push_back(ring);
  }
  mesh.loft(rings);
}

double rounded(double z, double length, double r) {  // 1, going to 0.25 over the last r
  const double s = std::clamp((z - (length - r)) / r, 0.0, 1.0);
  return std::sqrt(std::max(0.0625, 1.0 - s * s));
}

/// Fenestrated: a bar bent to a closed loop round a window, toothed on its inner face.
Mesh grasperJaw(double length) {
  Mesh mesh;
  const double z0 = 0.004, half = 0.0015, bar = 0.00055, r = half;
  std::vector<Vector2d> path;  // (y, z)
  const int straight = 32, arc = 8;
  const double z_end = length - r - bar;
  for (int i = 0; i < straight; ++i) path.emplace_back(half, z0 + (z_end - z0) * i / straight);
  for (int i = 0; i < arc; ++i) {
    path.emplace_back(half * std::cos(M_PI * i / arc), z_end + r * std::sin(M_PI * i / arc));
  }
  for (int i = 0; i < straight; ++i) path.emplace_back(-half, z_end - (z_end - z0) * i / straight);
  for (int i = 0; i < arc; ++i) {
    path.emplace_back(-half * std::cos(M_PI * i / arc), z0 - 0.8 * half * std::sin(M_PI * i / arc));
  }
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Vector2d t = (path[(i + 1) % path.size()] - path[(i + path.size() - 1) % path.size()]).normalized();
    const Vector3d out(0, t.y(), -t.x());
    const Vector3d p(0, path[i].x(), path[i].y());
    const double s = std::clamp(path[i].y() / length, 0.0, 1.0), h = 0.0023 - 0.0009 * s;
    const double x0 = tooth(path[i].y(), 2.0 * (z_end - z0) / straight, 0.00035);
    rings.push_back({p + Vector3d(x0, 0, 0) - bar * out, p + Vector3d(x0, 0, 0) + bar * out,
                     p + Vector3d(0.65 * h, 0, 0) + bar * out, p + Vector3d(h, 0, 0) + 0.35 * bar * out,
                     p + Vector3d(h, 0, 0) - 0.35 * bar * out, p + Vector3d(0.65 * h, 0, 0) - bar * out});
  }
  mesh.loft(rings, true);
  addBar(
      mesh, -0.002, 0.0035, 6, [](double z) { return z < 0 ? 0.0009 : 0.0009 + 0.26 * z; },
      [](double) { return 0.0023; }, [](double) { return 0.0001; });
  addKnuckle(mesh, 0.0018, 0.0, 0.0009);
  return mesh;
}

/// Metzenbaum: slender curved blades that slide past each other at y = 0.
Mesh scissorBlade(double length) {
  Mesh mesh;
  std::vector<Ring> rings;
  const int stations = 28;
  for (int i = 0; i <= stations; ++i) {
    const double z = -0.002 + (length + 0.002) * i / stations, s = std::clamp(z / length, 0.0, 1.0);
    const double bend = 0.0014 * s * s, back = 0.0021 * (1.0 - 0.72 * s) * rounded(z, length, 0.002);
    const double edge = -0.0004 * (1.0 - s), thick = 0.0011 * (1.0 - 0.5 * s);
    rings.push_back({Vector3d(edge, bend, z), Vector3d(0.5 * (edge + back), bend, z), Vector3d(back, bend, z),
                     Vector3d(back, bend + 0.6 * thick, z), Vector3d(0.75 * back, bend + thick, z),
                     Vector3d(0.35 * back, bend + 0.85 * thick, z),
                     Vector3d(edge + 0.00015, bend + 0.15 * thick, z)});
  }
  mesh.loft(rings);
  addKnuckle(mesh, 0.0019, 0.0, 0.0011);
  return mesh;
}

/// Jaw with a groove along its inner face, which holds the clip's leg.
Mesh clipJaw(double length) {
  Mesh mesh;
  std::vector<Ring> rings;
  const int stations = 16;
  for (int i = 0; i <= stations; ++i) {
    const double z = -0.002 + (length + 0.002) * i / stations;
    const double w = (z < 0.002 ? 0.0010 : 0.0017) * rounded(z, length, 0.0012), h = 0.0024,
                 g = z < 0.002 ? 0 : 0.0007;
    rings.push_back({Vector3d(0.0001, -w, z), Vector3d(0.0001, -0.5 * w, z),
                     Vector3d(0.0001 + g, -0.45 * w, z), Vector3d(0.0001 + g, 0.45 * w, z),
                     Vector3d(0.0001, 0.5 * w, z), Vector3d(0.0001, w, z), Vector3d(0.6 * h, w, z),
                     Vector3d(h, 0.5 * w, z), Vector3d(h, -0.5 * w, z), Vector3d(0.6 * h, -w, z)});
  }
  mesh.loft(rings);
  addKnuckle(mesh, 0.0019, 0.0, 0.0010);
  return mesh;
}

/// Smooth paddle that widens towards a round point.
Mesh bipolarJaw(double length) {
  Mesh mesh;
  addBar(
      mesh, -0.002, length, 30,
      [&](double z) {
        const double s = std::clamp(z / length, 0.0, 1.0);
        return (0.0010 + 0.0010 * s) * rounded(z, length, 0.003);
      },
      [&](double z) { return 0.0022 - 0.0008 * std::clamp(z / length, 0.0, 1.0); },
      [](double z) { return z < 0.003 ? 0.0003 : 0.00008; });
  addKnuckle(mesh, 0.0018, 0.0, 0.0010);
  return mesh;
}

/// Short and stout, with a finely toothed carbide insert.
Mesh needleHolderJaw(double length) {
  Mesh mesh;
  addBar(
      mesh, -0.002, length, 60,
      [&](double z) {
        return (0.0019 - 0.0007 * std::clamp(z / length, 0.0, 1.0)) * rounded(z, length, 0.0015);
      },
      [&](double z) { return 0.0025 - 0.0008 * std::clamp(z / length, 0.0, 1.0); },
      [](double z) { return z < 0.003 ? 0.0003 : 0.00005 + tooth(z, 0.0005, 0.00018); });
  addKnuckle(mesh, 0.0020, 0.0, 0.0012);
  return mesh;
}

/// Insulated tube, a steel collar, and the two prongs that carry the jaws.
Mesh shaftWithJaws(const ToolGeometry& tool) {
  Mesh mesh;
  const double axis = -tool.jaw_length, r = tool.shaft_radius, end = axis - 0.004;
  mesh.revolve({{r, -kShaftLength}, {r, end - 0.003}, {0.94 * r, end - 0.0028}, {0.94 * r, end}}, 20);
  for (const double side : {-1.0, 1.0}) {
    const double y0 = side * 0.0013, y1 = side * 0.0021;
    mesh.block({-0.0012, std::min(y0, y1), end - 0.0005}, {0.0012, std::max(y0, y1), axis + 0.0014});
  }
  return mesh;
}

Mesh plainShaft(double r) {
  Mesh mesh;
  mesh.revolve({{r, -kShaftLength}, {r, -0.002}, {0.97 * r, -0.0005}, {0.85 * r, 0.0}}, 24);
  return mesh;
}

Mesh hook() {
  Mesh mesh;
  mesh.revolve({{0.0019, -0.001}, {0.0019, 0.002}, {0.0013, 0.0035}, {0.0008, 0.004}}, 20);  // ceramic neck
  std::vector<Vector2d> path{{0, 0.003}, {0, 0.006}, {0, 0.009}, {0, 0.0125}};
  for (int i = 1; i <= 8; ++i) {
    const double a = 0.5 * M_PI * i / 8, r = 0.0015;
    path.emplace_back(r * (1.0 - std::cos(a)), 0.0125 + r * std::sin(a));
  }
  path.emplace_back(0.0030, 0.0140);
  path.emplace_back(0.0040, 0.0140);
  path.emplace_back(0.0044, 0.0140);
  mesh.wire(path, 0.0006, 14);
  return mesh;
}

/// Open tube of steel with three rows of side holes.
Mesh cannula(double r) {
  Mesh mesh;
  const int around = 24, along = 13;
  const double z0 = -0.024, z1 = 0.0, inner = 0.8 * r;
  const auto point = [&](double radius, int k, int i) {
    const double a = 2.0 * M_PI * k / around;
    return Vector3d(radius * std::cos(a), radius * std::sin(a), z0 + (z1 - z0) * i / along);
  };
  const auto hole = [&](int k, int i) { return k % 6 == 0 && i >= 5 && i < 12 && i % 3 == 2; };
  const auto quad = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    mesh.add(a, b, c);
    mesh.add(a, c, d);
  };
  for (int k = 0; k < around; ++k) {
    for (int i = 0; i < along; ++i) {
      if (hole(k, i)) {  // the hole's four walls, facing into it
        const int c[5][2] = {{k, i}, {k + 1, i}, {k + 1, i + 1}, {k, i + 1}, {k, i}};
        for (int e = 0; e < 4; ++e) {
          quad(point(r, c[e][0], c[e][1]), point(inner, c[e][0], c[e][1]),
               point(inner, c[e + 1][0], c[e + 1][1]), point(r, c[e + 1][0], c[e + 1][1]));
        }
        continue;
      }
      quad(point(r, k, i), point(r, k + 1, i), point(r, k + 1, i + 1), point(r, k, i + 1));
      quad(point(inner, k, i), point(inner, k, i + 1), point(inner, k + 1, i + 1), point(inner, k + 1, i));
    }
    quad(point(r, k, along), point(r, k + 1, along), point(inner, k + 1, along), point(inner, k, along));
    quad(point(r, k, 0), point(inner, k, 0), point(inner, k + 1, 0), point(r, k + 1, 0));
  }
  return mesh;
}

/// Needle of 20 gauge with a bevel of 30 degrees.
Mesh needle() {
  Mesh mesh;
  mesh.revolve({{0.0022, -0.001}, {0.0022, 0.0006}, {0.0006, 0.003}}, 20);
  std::vector<Ring> rings;
  const double r = 0.000454;
  for (const double z : {0.002, 0.010, 0.02}) {
    Ring ring;
    for (int k = 0; k < 14; ++k) {
      const double a = 2.0 * M_PI * k / 14, x = r * std::cos(a);
      ring.emplace_back(x, r * std::sin(a), z > 0.015 ? z - (x + r) * std::sqrt(3.0) : z);
    }
    rings.push_back(ring);
  }
  mesh.loft(rings);
  return mesh;
}

Mesh knotPusher() {
  Mesh mesh;
  mesh.revolve({{0.0012, -0.002}, {0.0012, 0.0090}, {0.0011, 0.0100}, {0.0008, 0.0108}, {0.0004, 0.0112}},
               20);
  return mesh;
}

/// A square of gauze folded lengthwise over jaws: pleats where it is gathered, soft folds to its round front.
Mesh gauze() {
  const tools::Capsule wad = toolGeometry(ToolKind::Swab).fixed.front();
  const double front = wad.b.z() + wad.radius;
  Mesh mesh;
  std::vector<Ring> rings;
  constexpr int kStations = 18, kAround = 38;
  for (int i = 0; i <= kStations; ++i) {
    const double s = static_cast<double>(i) / kStations, z = -0.001 + (front + 0.001) * s;
    // Within the wad's capsule, and narrow at the jaws.
    const double cap =
        z > wad.b.z() ? std::sqrt(std::max(0.0, 1 - std::pow((z - wad.b.z()) / wad.radius, 2))) : 1.0;
    const double neck = 0.42 + 0.58 * std::min(1.0, std::pow(std::max(0.0, z + 0.001) / 0.009, 0.7));
    const double gathered = std::exp(-z / 0.005);
    Ring ring;
    for (int k = 0; k < kAround; ++k) {
      const double a = 2.0 * M_PI * k / kAround;
      const double pleats = 0.16 * gathered * std::cos(11 * a + 60 * z),
                   folds = 0.055 * (1 - gathered) * std::sin(3 * a + 230 * z) +
                           0.04 * std::sin(5 * a - 400 * z + 1.0);
      // The edge of the cloth: a step along the wad.
      const double turn = a / (2.0 * M_PI) + 6 * z,
                   edge = 0.10 * (1 - (turn - std::floor(turn))) * (1 - gathered);
      const double r = wad.radius * std::max(0.02, cap * neck) * (0.90 + pleats + folds + edge);
      ring.emplace_back(1.05 * r * std::cos(a), 0.95 * r * std::sin(a), z);
    }
    rings.push_back(ring);
  }
  mesh.loft(rings);
  return mesh;
}

/// Tube with a bright rim and the glass of the optic, ground to its angle of 30 degrees.
Mesh endoscope(double r) {
  Mesh mesh;
  const int n = 32;
  std::vector<Ring> rings;
  const double slope = std::tan(M_PI / 6.0);
  for (int i = 0; i < 3; ++i) {
    Ring ring;
    for (int k = 0; k < n; ++k) {
      const double a = 2.0 * M_PI * k / n, radius = i == 2 ? 0.9 * r : r;
      const double y = radius * std::sin(a);
      // The picture's down is +y: the face looks there, so the tube is longest on the side of −y.
      const double z = i == 0 ? -kShaftLength : -(y + r) * slope - (i == 1 ? 0.0003 : 0.0);
      ring.emplace_back(radius * std::cos(a), y, z);
    }
    rings.push_back(ring);
  }
  mesh.loft(rings);
  return mesh;
}

/// Cannula and head of a trocar, in the trocar's frame: the pivot lies in the wall, the head outside (−z).
Mesh trocar(double bore) {
  Mesh mesh;
  const double r = bore + 0.0010;
  mesh.revolve({{bore, 0.018},
                {r, 0.015},
                {r, -0.030},
                {0.011, -0.034},
                {0.011, -0.058},
                {0.007, -0.062},
                {bore, -0.062}},
               28, true);
  return mesh;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Writes the visual meshes of the instruments as binary STL (metres)"};
  std::string directory;
  app.add_option("--output", directory, "folder to write to")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto write = [&](const std::string& name, const Mesh& mesh) {
      mesh.write(directory + "/" + name + ".stl");
      std::cout << name << " " << mesh.size() << "\n";
    };
    for (const ToolKind kind : {ToolKind::Grasper, ToolKind::Scissors, ToolKind::ClipApplier,
                                ToolKind::BipolarForceps, ToolKind::NeedleHolder}) {
      const ToolGeometry& g = toolGeometry(kind);
      const std::string name(vest::tools::toolName(kind));
      Mesh jaw;
      if (kind == ToolKind::Grasper) jaw = grasperJaw(g.jaw_length);
      if (kind == ToolKind::Scissors) jaw = scissorBlade(g.jaw_length);
      if (kind == ToolKind::ClipApplier) jaw = clipJaw(g.jaw_length);
      if (kind == ToolKind::BipolarForceps) jaw = bipolarJaw(g.jaw_length);
      if (kind == ToolKind::NeedleHolder) jaw = needleHolderJaw(g.jaw_length);
      write(name + "_shaft", shaftWithJaws(g));
      write(name + "_jaw_left", jaw);
      write(name + "_jaw_right", jaw.turned());
    }
    const double r = toolGeometry(ToolKind::CoagulationHook).shaft_radius;
    for (const ToolKind kind : {ToolKind::None, ToolKind::CoagulationHook, ToolKind::SuctionIrrigator,
                                ToolKind::InjectionNeedle, ToolKind::SlingApplicator, ToolKind::Swab}) {
      write(std::string(vest::tools::toolName(kind)) + "_shaft",
            plainShaft(kind == ToolKind::SuctionIrrigator ? 0.78 * r : r));
    }
    write("coagulation_hook_fixed", hook());
    write("suction_irrigator_fixed", cannula(r));
    write("injection_needle_fixed", needle());
    write("sling_applicator_fixed", knotPusher());
    write("swab_fixed", gauze());
    write("endoscope_shaft", endoscope(toolGeometry(ToolKind::Endoscope).shaft_radius));
    write("trocar", trocar(0.0028));
    write("endoscope_trocar", trocar(0.0053));
  } catch (const std::exception& e) {
    std::cerr << "make_meshes: " << e.what() << "\n";
    return 1;
  }
  return 0;
}
