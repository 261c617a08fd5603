#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace vest::session {

struct Recovery {
  std::string bag;                    ///< the valid bag
  std::uint64_t kept = 0;             ///< messages
  std::uint64_t damaged = 0;          ///< places where at least one message is lost
  std::optional<std::uint64_t> lost;  ///< messages, where the recorder left its count
  bool summarised = false;            ///< session.json was written
};

/// Makes a valid bag of one that is not whole, as a killed recorder leaves it: SESSION.bag.active becomes
/// SESSION.bag, and what it was made of is removed. session.json beside it is written where there is none.
/// Any other bag is left as it is, and becomes BAG.recovered.bag.
/// @param source the bag, or the folder that holds session.bag.active  @param target the valid bag; empty: as
/// above  @throws std::invalid_argument, std::runtime_error naming the file: nothing in it is a message, it
/// is being recorded, or the target is there; nothing has changed then
Recovery recoverBag(std::string source, std::string target);

}  // namespace vest::session
