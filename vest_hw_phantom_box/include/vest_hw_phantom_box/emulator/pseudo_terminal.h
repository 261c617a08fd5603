// The emulator's end of a pseudo-terminal.
#pragma once

#include <cstdint>
#include <string>

#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::emulator {

/// A raw pty; never becomes the controlling terminal, never blocks.
class PseudoTerminal {
 public:
  PseudoTerminal() = default;
  ~PseudoTerminal() { close(); }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  /// `link`: a symbolic link to make at this path (an older symbolic link is replaced, nothing else ever is).
  /// Throws std::runtime_error.
  void open(const std::string& link = {});
  /// Hangs up: a reader's read() gives 0 or EIO. Removes the link if it is still ours.
  void close();
  bool isOpen() const { return master_ >= 0; }
  const std::string& path() const { return path_; }
  /// Somebody has the other end open.
  bool hasReader() const;
  /// Throws away what a former reader left unread.
  void flush();
  /// Writes what fits, the rest of a begun frame first. False: nothing of `bytes` could be taken (no one
  /// drains the other end), it is dropped whole.
  bool write(const protocol::Bytes& bytes);

 private:
  int master_ = -1;
  std::string path_;
  std::string link_;
  protocol::Bytes pending_;  ///< tail of a frame that did not fit: a frame is sent whole or not at all
};

}  // namespace vest::emulator
