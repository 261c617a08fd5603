#pragma once

#include <string>

#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>
#include <boost/make_shared.hpp>

#include "tissue_input.h"

namespace vest::displays {

/// A chain of links; each revision cuts one more.
constexpr std::uint32_t kLinks = 6;

inline vest_msgs::TissueTopology::ConstPtr whole(std::uint32_t revision, const std::string& hash = "a") {
  auto t = boost::make_shared<vest_msgs::TissueTopology>();
  t->header.frame_id = "world";
  t->revision = revision;
  t->scene = "net";
  t->scene_hash = hash;
  t->objects.resize(1);
  vest_msgs::TissueObject& o = t->objects[0];
  o.name = "net";
  o.knot_count = kLinks + 1;
  for (std::uint32_t k = 0; k <= kLinks; ++k) {
    o.rest_position.insert(o.rest_position.end(), {0.01f * static_cast<float>(k), 0.0f, 0.0f});
    o.binding_start.push_back(k);
    o.binding_knots.push_back(k);
    o.binding_weights.push_back(1);
  }
  o.binding_start.push_back(kLinks + 1);
  o.triangles = {0, 1, 2};
  for (std::uint32_t k = 0; k < kLinks; ++k) {
    o.link_knots.insert(o.link_knots.end(), {k, k + 1});
    o.link_alive.push_back(k >= revision);  // each revision cuts one more
  }
  return t;
}

inline vest_msgs::TissueTopologyDelta::ConstPtr cut(std::uint32_t from) {
  auto d = boost::make_shared<vest_msgs::TissueTopologyDelta>();
  d->from_revision = from, d->revision = from + 1;
  d->removed_links = {from};
  return d;
}

inline vest_msgs::TissueState::ConstPtr state(std::uint32_t revision, std::uint64_t step) {
  auto s = boost::make_shared<vest_msgs::TissueState>();
  s->revision = revision, s->step = step;
  for (std::uint32_t k = 0; k <= kLinks; ++k)
    s->positions.insert(s->positions.end(),
                        {0.01f * static_cast<float>(k), 1e-6f * static_cast<float>(step), 0.0f});
  return s;
}

inline int cutLinks(TissueInput& input) {
  int dead = 0;
  for (const std::uint8_t alive : input.store().topology().objects[0].link_alive) dead += alive == 0;
  return dead;
}

}  // namespace vest::displays
