#include "vest_bringup/ros/message_layout.h"

#include <algorithm>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace vest::session {
namespace {

constexpr const char* kSeparator =
    "================================================================================";

/// Bytes of a built-in type; 0: none of them.
std::size_t builtIn(const std::string& type) {
  static const std::map<std::string, std::size_t> kBytes = {
      {"bool", 1},  {"byte", 1},   {"char", 1},    {"int8", 1},   {"uint8", 1},
      {"int16", 2}, {"uint16", 2}, {"int32", 4},   {"uint32", 4}, {"float32", 4},
      {"int64", 8}, {"uint64", 8}, {"float64", 8}, {"time", 8},   {"duration", 8}};
  const auto found = kBytes.find(type);
  return found == kBytes.end() ? 0 : found->second;
}

bool takeCount(const std::uint8_t*& at, const std::uint8_t* end, std::uint32_t& count) {
  if (end - at < 4) return false;
  std::memcpy(&count, at, sizeof count);
  at += 4;
  return true;
}

}  // namespace

struct MessageLayout::Field {
  enum class Array { None, Fixed, Counted } array = Array::None;
  std::uint32_t count = 1;     ///< of a fixed array
  std::size_t bytes = 0;       ///< of an element of fixed size; 0: text, or another type
  const Type* type = nullptr;  ///< null: text where bytes is 0
};

struct MessageLayout::Type {
  std::vector<Field> fields;
  std::size_t least = 0;  ///< bytes that one takes at least
};

MessageLayout::~MessageLayout() = default;
MessageLayout::MessageLayout(MessageLayout&&) noexcept = default;

MessageLayout::MessageLayout(const std::string& definition) {
  // Types by name; those that are used stand behind those that use them, so they are read from the end.
  std::vector<std::pair<std::string, std::string>> texts(1);
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(kSeparator, 0) == 0) {
      std::getline(lines, line);
      if (line.rfind("MSG: ", 0) != 0) throw std::invalid_argument("message definition: no name behind ====");
      texts.emplace_back(line.substr(5), "");
    } else {
      texts.back().second += line + "\n";
    }
  }
  for (const auto& [name, text] : texts) types_[name] = std::make_unique<Type>();
  const auto find = [&](const std::string& word) -> const Type* {
    for (const auto& [name, type] : types_) {
      if (name == word || (name.size() > word.size() && name[name.size() - word.size() - 1] == '/' &&
                           name.compare(name.size() - word.size(), word.size(), word) == 0))
        return type.get();
    }
    throw std::invalid_argument("message definition: type " + word + " is not described");
  };
  for (auto text = texts.rbegin(); text != texts.rend(); ++text) {
    Type& type = *types_[text->first];
    std::istringstream rows(text->second);
    for (std::string row; std::getline(rows, row);) {
      row = row.substr(0, row.find('#'));
      std::istringstream words(row);
      std::string kind, name;
      if (!(words >> kind >> name) || row.find('=') != std::string::npos) continue;  // empty, or a constant
      Field field;
      if (const auto bracket = kind.find('['); bracket != std::string::npos) {
        const std::string count = kind.substr(bracket + 1, kind.size() - bracket - 2);
        field.array = count.empty() ? Field::Array::Counted : Field::Array::Fixed;
        if (!count.empty()) field.count = static_cast<std::uint32_t>(std::stoul(count));
        kind.resize(bracket);
      }
      field.bytes = builtIn(kind);
      if (field.bytes == 0 && kind != "string") field.type = find(kind);
      const std::size_t element = field.bytes > 0 ? field.bytes : field.type ? field.type->least : 4;
      type.least += field.array == Field::Array::Counted ? 4 : field.count * element;
      type.fields.push_back(field);
    }
  }
  root_ = types_[""].get();
}

bool MessageLayout::skip(const Type& type, const std::uint8_t*& at, const std::uint8_t* end) {
  for (const Field& field : type.fields) {
    std::uint32_t count = field.count;
    if (field.array == Field::Array::Counted && !takeCount(at, end, count)) return false;
    const auto left = static_cast<std::uint64_t>(end - at);
    const std::uint64_t least = field.bytes > 0 ? field.bytes
                                : field.type    ? std::max<std::size_t>(field.type->least, 1)
                                                : 4;
    if (count > left / least) return false;
    if (field.bytes > 0) {
      at += count * field.bytes;
      continue;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      if (field.type) {
        if (!skip(*field.type, at, end)) return false;
        continue;
      }
      std::uint32_t length = 0;
      if (!takeCount(at, end, length) || length > static_cast<std::uint64_t>(end - at)) return false;
      at += length;
    }
  }
  return true;
}

bool MessageLayout::fits(const std::uint8_t* data, std::size_t size) const {
  const std::uint8_t* at = data;
  return skip(*root_, at, data + size) && at == data + size;
}

}  // namespace vest::session
