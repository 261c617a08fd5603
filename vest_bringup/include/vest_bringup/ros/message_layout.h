#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace vest::session {

/// How a message lies in bytes, by the definition of its type (http://wiki.ros.org/msg). Tells whether bytes
/// can be such a message before anything is made of them: a count that lies would ask for any amount of
/// memory.
class MessageLayout {
 public:
  /// @param definition as ros::message_traits gives it: the message, then the types that it uses
  /// @throws std::invalid_argument where it is none
  explicit MessageLayout(const std::string& definition);
  ~MessageLayout();
  MessageLayout(MessageLayout&&) noexcept;

  /// Whether the bytes are one whole message, with nothing behind it.
  bool fits(const std::uint8_t* data, std::size_t size) const;

 private:
  struct Field;
  struct Type;
  static bool skip(const Type& type, const std::uint8_t*& at, const std::uint8_t* end);
  std::map<std::string, std::unique_ptr<Type>> types_;
  const Type* root_ = nullptr;
};

}  // namespace vest::session
