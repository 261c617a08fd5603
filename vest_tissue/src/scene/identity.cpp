#include "identity.h"

#include <memory>
#include <string>
#include <type_traits>

#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

#include "vest_tissue/fem/description.h"

namespace vest::scene {
namespace {

/// Takes numbers as they lie in memory, and structs apart by a binding: one with a member more than is named
/// here does not compile.
class Identity {
 public:
  Identity() { XXH64_reset(&state_, 0); }
  std::uint64_t digest() const { return XXH64_digest(&state_); }
  template <class... T>
  void operator()(const T&... v) {
    (one(v), ...);
  }

 private:
  XXH64_state_t state_{};

  void bytes(const void* data, std::size_t count) {
    if (count > 0) XXH64_update(&state_, data, count);
  }
  template <class T>
  std::enable_if_t<std::is_arithmetic_v<T> || std::is_enum_v<T>> one(const T& v) {
    bytes(&v, sizeof v);
  }
  template <int rows>
  void one(const Eigen::Matrix<double, rows, 1>& v) {
    bytes(v.data(), sizeof(double) * static_cast<std::size_t>(rows));
  }
  void one(const std::string& v) {
    one(v.size());
    bytes(v.data(), v.size());
  }
  template <class T, std::size_t n>
  void one(const std::array<T, n>& v) {
    for (const T& x : v) one(x);
  }
  template <class T>
  void one(const std::vector<T>& v) {
    one(v.size());
    if constexpr (std::is_arithmetic_v<T>) {
      bytes(v.data(), v.size() * sizeof(T));
    } else {
      for (const T& x : v) one(x);
    }
  }

  void one(const Link& v) {
    const auto& [kind, knot0, knot1, knot2, rest, area, stiffness, damping] = v;
    (*this)(kind, knot0, knot1, knot2, rest, area, stiffness, damping);
  }
  void one(const VolumeElement& v) {
    const auto& [triangles, bulk_modulus, rest_volume] = v;
    (*this)(triangles, bulk_modulus, rest_volume);
  }
  void one(const HingeElement& v) {
    const auto& [knots, stiffness] = v;
    (*this)(knots, stiffness);
  }
  void one(const Tether& v) {
    const auto& [knot, place, stiffness, damping] = v;
    (*this)(knot, place, stiffness, damping);
  }
  void one(const Skin& v) {
    const auto& [start, knots, weights, coordinates, triangles, layer] = v;
    (*this)(start, knots, weights, coordinates, triangles, layer);
  }
  void one(const TubeMap& v) {
    const auto& [station, rings, segment] = v;
    (*this)(station, rings, segment);
  }
  void one(const material::Law& v) {
    const auto& [youngs_modulus, a2, a3, a4, max_strain] = v;
    (*this)(youngs_modulus, a2, a3, a4, max_strain);
  }
  void one(const interaction::ThermalMaterial& v) {
    const auto& [heat_capacity, conductivity, perfusion, water] = v;
    (*this)(heat_capacity, conductivity, perfusion, water);
  }
  void one(const motility::Wave& v) {
    const auto& [pressure, scatter, waves, direction, frequency, frequency_scatter] = v;
    (*this)(pressure, scatter, waves, direction, frequency, frequency_scatter);
  }
  void one(const motility::Motility& v) {
    const auto& [waves, ramp] = v;
    (*this)(waves, ramp);
  }
  void one(const fem::Material& v) {
    const auto& [youngs_modulus, poisson_ratio, density, mass, stiffness] = v;
    (*this)(youngs_modulus, poisson_ratio, density, mass, stiffness);
  }
  void one(const fem::Load& v) {
    const auto& [node, force] = v;
    (*this)(node, force);
  }
  void one(const fem::Prescribed& v) {
    const auto& [node, displacement] = v;
    (*this)(node, displacement);
  }
  void one(const std::shared_ptr<const fem::Description>& v) {
    one(v != nullptr);
    if (!v) return;
    const auto& [name, strain, motion, equilibrium, nodes, tetrahedra, fixed, prescribed, material, materials,
                 cell_material, loads, outer] = *v;
    (*this)(name, strain, motion, equilibrium, nodes, tetrahedra, fixed, prescribed, material, materials,
            cell_material, loads, outer);
  }
  void one(const suture::Section& v) {
    const auto& [radius, linear_density, stretch, shear, bend, twist, friction, damping, drag, strain_damping,
                 yield_moment, friction_fall, friction_pressure] = v;
    (*this)(radius, linear_density, stretch, shear, bend, twist, friction, damping, drag, strain_damping,
            yield_moment, friction_fall, friction_pressure);
  }
  void one(const suture::DriveRow& v) {
    const auto& [t, place, angle] = v;
    (*this)(t, place, angle);
  }
  void one(const suture::HeldNode& v) {
    const auto& [node, hold, drive] = v;
    (*this)(node, hold, drive);
  }
  void one(const suture::NodeLoad& v) {
    const auto& [node, force] = v;
    (*this)(node, force);
  }
  void one(const suture::Needle& v) {
    const auto& [points, radius, density, swage] = v;
    (*this)(points, radius, density, swage);
  }
  void one(const suture::RodDescription& v) {
    const auto& [name, nodes, closed, section, natural_shape, turn, held, loads, needle] = v;
    (*this)(name, nodes, closed, section, natural_shape, turn, held, loads, needle);
  }

 public:
  void one(const Object& v) {
    const auto& [name, organ, material, roles, model, law, density, rest_position, position, mass, damping,
                 fixed, links, volumes, hinges, tethers, contact_triangles, contact_thickness, friction,
                 full_contact, tear_strain, thermal, knot_perfusion, motility, grasp_damage_threshold,
                 cut_toughness, puncture_force, wall_thickness, skin, tube, fem] = v;
    (*this)(name, organ, material, roles, model, law, density, rest_position, mass, damping, fixed, links,
            volumes, hinges, tethers, contact_triangles, contact_thickness, friction, full_contact,
            tear_strain, thermal, knot_perfusion, motility, grasp_damage_threshold, cut_toughness,
            puncture_force, wall_thickness, skin, tube, fem);
    one(position.size());
  }
  void one(const Suture& v) {
    const auto& [material, size, kind, strength, knot_strength, friction, path, segment, needle,
                 needle_length, needle_wire, needle_normal, loop, loop_at, loop_ahead, loop_across, rod] = v;
    (*this)(material, size, kind, strength, knot_strength, friction, path, segment, needle, needle_length,
            needle_wire, needle_normal, loop, loop_at, loop_ahead, loop_across, rod);
  }
};

template <class T>
std::uint64_t identity(const T& v) {
  Identity all;
  all(v);
  return all.digest();
}

}  // namespace

std::uint64_t identityOf(const Object& object) {
  return identity(object);
}
std::uint64_t identityOf(const Suture& suture) {
  return identity(suture);
}

}  // namespace vest::scene
