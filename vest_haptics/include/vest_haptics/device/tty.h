#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace vest::haptics {

/// A serial line, raw 8N1, never the controlling terminal. One thread.
class Tty {
 public:
  Tty() = default;
  ~Tty() { close(); }
  Tty(const Tty&) = delete;
  Tty& operator=(const Tty&) = delete;
  /// Empty, or what is wrong and what to do.
  std::string open(const std::string& path, unsigned baud);
  /// The other end of a new pseudo-terminal, with a symbolic link to it. Empty, or what is wrong.
  std::string openPseudo(const std::string& link);
  void close();
  bool isOpen() const { return fd_ >= 0; }
  /// Bytes within timeout_ms; 0: none came; −1: hung up or gone.
  int read(std::uint8_t* buffer, std::size_t capacity, int timeout_ms);
  bool write(const void* bytes, std::size_t size);
  void flush();

 private:
  int fd_ = -1;
  bool pseudo_ = false;
  std::string link_;
};

}  // namespace vest::haptics
