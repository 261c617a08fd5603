/// How much of each label a smooth kernel sees around a place of an image.
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "vest_tissue/volume/image.h"

namespace vest::volume {

class LabelField {
 public:
  explicit LabelField(const LabelledImage& image) : image_(image) {}

  struct Shares {
    static constexpr int kMost = 8;  ///< labels that are told apart around one place
    std::array<std::uint16_t, kMost> label{};
    std::array<double, kMost> share{};
    int count = 0;
    double of(std::uint16_t label) const;
    double any() const;          ///< of all labels but 0
    std::uint16_t most() const;  ///< 0: none is there
    void add(std::uint16_t label, double share);
  };
  /// @param place m from the image's origin, along its axes
  Shares at(const Eigen::Vector3d& place) const;

 private:
  const LabelledImage& image_;
};

}  // namespace vest::volume
