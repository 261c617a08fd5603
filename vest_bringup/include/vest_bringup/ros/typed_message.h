#pragma once

#include <stdexcept>
#include <string>

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include "vest_bringup/ros/bag_reader.h"
#include "vest_bringup/ros/message_layout.h"
#include "vest_instruments/files/read.h"

namespace vest::session {

/// Reads a recorded message as M.
/// @throws std::invalid_argument naming file and topic where the bag's type or MD5 is another one, or the
/// bytes are not an M; nothing was allocated by their counts then
template <class M>
void readMessage(const std::string& file, const BagMessage& message, M& to) {
  namespace traits = ros::message_traits;
  static const MessageLayout layout(traits::definition<M>());
  const BagConnection& c = message.connection;
  if (c.type != traits::datatype<M>() || c.md5sum != traits::md5sum<M>()) {
    throw std::invalid_argument(file + ": " + files::shown(c.topic) + " is of type " + files::shown(c.type) +
                                " with MD5 " + files::shown(c.md5sum) + " (allowed: " +
                                traits::datatype<M>() + " with MD5 " + traits::md5sum<M>() + ")");
  }
  if (!layout.fits(message.data, message.size)) {
    throw std::invalid_argument(file + ": " + files::shown(c.topic) + ": a message of " +
                                std::to_string(message.size) + " bytes at " + std::to_string(message.time()) +
                                " s is no " + c.type);
  }
  // IStream reads only, but asks for memory that may be written.
  ros::serialization::IStream in(const_cast<std::uint8_t*>(message.data), message.size);
  ros::serialization::deserialize(in, to);
}

}  // namespace vest::session
