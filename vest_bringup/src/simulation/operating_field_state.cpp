#include "field_impl.h"

namespace vest::simulation {

void OperatingField::save(std::vector<std::uint8_t>& bytes) const {
  const auto part = [&](auto&& write) {
    const std::size_t place = bytes.size();
    std::uint64_t size = 0;
    bytes.resize(place + sizeof size);
    write();
    size = bytes.size() - place - sizeof size;
    std::memcpy(bytes.data() + place, &size, sizeof size);
  };
  part([&] { fluid::save(impl_->fluid, bytes); });
  part([&] { smoke::save(impl_->smoke, bytes); });
  part([&] { lens::save(impl_->lens, bytes); });
  part([&] {
    const auto* b = reinterpret_cast<const std::uint8_t*>(&impl_->between);
    bytes.insert(bytes.end(), b, b + sizeof(Between));
  });
}

void OperatingField::adopt(const Effect& before, const std::vector<std::uint32_t>&) {
  const auto* const field = dynamic_cast<const OperatingField*>(&before);
  if (field == nullptr) return;
  const Impl& from = *field->impl_;
  if (from.fluid.particles.x.size() != impl_->fluid.particles.x.size() ||
      from.fluid.pools.depth.size() != impl_->fluid.pools.depth.size() ||
      from.smoke.density.size() != impl_->smoke.density.size())
    return;
  std::vector<float> knots(impl_->fluid.knots.size(), 0.0f);
  impl_->fluid = from.fluid;
  impl_->fluid.knots = std::move(knots), impl_->fluid.has_knots = false;
  std::fill(impl_->fluid.pools.bed_triangle.begin(), impl_->fluid.pools.bed_triangle.end(), -1);
  impl_->smoke = from.smoke;
  impl_->lens = from.lens, impl_->lens_parameters = from.lens_parameters;
  std::memcpy(static_cast<void*>(&impl_->between), &from.between, sizeof from.between);
  impl_->apply();
}

bool OperatingField::restore(const std::uint8_t* bytes, std::size_t count) {
  fluid::State f;
  smoke::State s;
  lens::State l;
  Between b;
  const auto part = [&](auto&& read) {
    std::uint64_t size;
    if (count < sizeof size) return false;
    std::memcpy(&size, bytes, sizeof size);
    bytes += sizeof size, count -= sizeof size;
    if (size > count || !read(bytes, static_cast<std::size_t>(size))) return false;
    bytes += size, count -= size;
    return true;
  };
  const bool good = part([&](const std::uint8_t* at, std::size_t n) {
                      return fluid::restore(*impl_->fluid_model, at, n, f);
                    }) &&
                    part([&](const std::uint8_t* at, std::size_t n) {
                      return smoke::restore(*impl_->smoke_model, at, n, s);
                    }) &&
                    part([&](const std::uint8_t* at, std::size_t n) { return lens::restore(at, n, l); }) &&
                    part([&](const std::uint8_t* at, std::size_t n) {
                      if (n == sizeof b) std::memcpy(&b, at, n);
                      return n == sizeof b && sane(b);
                    }) &&
                    count == 0;
  if (!good) return false;
  impl_->fluid = std::move(f), impl_->smoke = std::move(s), impl_->lens = l, impl_->between = b;
  impl_->apply();
  impl_->has_rigid = false;  // what was seen belongs to another State
  impl_->shown.clear();
  return true;
}

}  // namespace vest::simulation
