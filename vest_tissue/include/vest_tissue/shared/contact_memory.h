/// Contact models in shared memory: written by the stepping thread at every step, read by haptic processes at
/// 1 kHz. One writer, any number of readers; nobody waits for anybody (a seqlock: the sequence is odd while
/// the writer writes, and a reader takes only what it read between two equal even sequences).
///
///   page  ┌ magic · version · bytes ┐ fixed once written
///         │ sequence                │ odd: being written
///         └ ContactImage            ┘ as 64 bit words
///
/// Every word is an atomic of its own, so a torn image is possible but no undefined behaviour, and the
/// sequence shows it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>

#include "vest_tissue/voxel/volume.h"

namespace vest::shared {

inline constexpr std::uint64_t kContactMagic = 0x314354'5453'4556ull;  ///< "VESTCT1", little-endian
inline constexpr std::uint64_t kContactVersion = 2;  ///< of this layout; readers refuse any other
inline constexpr int kContactInstruments = 4;        ///< left, right, third, endoscope
inline constexpr int kContactPlanes = 4;

inline constexpr std::uint64_t kFlagPresent = 1;   ///< the instrument is in the scene
inline constexpr std::uint64_t kFlagContact = 2;   ///< something touches it
inline constexpr std::uint64_t kFlagGrasping = 4;  ///< jaws hold tissue: the model is bilateral
inline constexpr std::uint64_t kFlagRigid = 8;     ///< reserved

/// Force of the tissue on the instrument at the proxy's tip, world frame, SI:
/// F(x, v) = wrench − K (x − x0) − B (v − v0). The same content as vest_msgs/ContactModel, but without the
/// force of a volume: who reads this computes that itself (voxel/law.h).
struct ContactRecord {
  std::uint64_t flags = 0;
  double position[3] = {};                ///< m, x0: tip of the proxy
  double orientation[4] = {0, 0, 0, 1};   ///< quaternion x y z w of the tip frame
  double commanded[3] = {};               ///< m, tip that the step was asked for
  double pivot[3] = {};                   ///< m, trocar
  double velocity[6] = {};                ///< m/s, rad/s: v0
  double wrench[6] = {};                  ///< N, N·m about the tip
  double stiffness[36] = {};              ///< N/m …, row-major
  double damping[36] = {};                ///< N·s/m …, row-major
  std::uint64_t plane_count = 0;          ///< 0 … 4
  double planes[kContactPlanes][4] = {};  ///< normal away from the tissue (length 1), offset in m
  double radius = 0.0;                    ///< m: distance from x0 within which the model holds
  double pinch_force = 0.0;               ///< N
  double jaw_torque = 0.0;                ///< N·m
  std::uint64_t feels = 0;                ///< voxel::Kind: what the tool is in the volume, if there is one
  double reach = 0.0;                     ///< m beyond the tip's frame to the point that feels it
};

struct ContactImage {
  std::uint64_t step = 0;  ///< simulation step: the heartbeat. One that stands still is a dead simulation
  std::uint64_t generation = 0;  ///< grows with every reset, snapshot, loaded or edited scene, and restart
  std::int64_t steady_ns = 0;    ///< CLOCK_MONOTONIC at which the step began
  std::uint64_t volume = 0;      ///< which volume is felt (ContactWriter::shareVolume); 0: none
  std::array<ContactRecord, kContactInstruments> contacts{};
};
static_assert(std::is_trivially_copyable_v<ContactImage> && sizeof(ContactImage) % 8 == 0);
inline constexpr std::size_t kContactWords = sizeof(ContactImage) / 8;

/// What lies in the shared page.
struct ContactPage {
  std::atomic<std::uint64_t> magic, version, bytes, sequence;
  std::array<std::atomic<std::uint64_t>, kContactWords> words;
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

/// Name of the memory of a session: two sessions on one machine differ in their master's port or namespace.
/// @param master_uri http://HOST:PORT; @param ns launch namespace, e.g. /vest
std::string contactMemoryName(const std::string& master_uri, const std::string& ns);

/// The simulation's end. The memory outlives it, so that readers keep what they have mapped across a restart.
class ContactWriter {
 public:
  /// Makes the memory, or takes over what an earlier writer left. @throws std::runtime_error naming memory
  /// and reason: not permitted, or another version's layout in use
  explicit ContactWriter(const std::string& name);
  ~ContactWriter();
  ContactWriter(const ContactWriter&) = delete;
  ContactWriter& operator=(const ContactWriter&) = delete;

  /// Real-time safe.
  void write(const ContactImage& image) noexcept;
  /// Makes a copy of a volume for readers, in a memory of its own: NAME_volume. The one before ends where no
  /// reader has it any more. Not real-time. @return what ContactImage::volume says from the first step of its
  /// scene on. @throws std::runtime_error naming memory and reason
  std::uint64_t shareVolume(const voxel::Volume& volume);
  std::uint64_t generation() const { return generation_; }
  /// What comes is not the step after the last: a reset, a snapshot, an edited or another scene. Real-time
  /// safe.
  void beginGeneration() noexcept { ++generation_; }

 private:
  std::string name_;
  ContactPage* page_ = nullptr;
  std::uint64_t generation_ = 0;
  bool volume_ = false;
};

/// A reader's end: maps read-only.
class ContactReader {
 public:
  explicit ContactReader(std::string name);
  ~ContactReader();
  ContactReader(const ContactReader&) = delete;
  ContactReader& operator=(const ContactReader&) = delete;

  /// Not real-time: tries to map, and looks for a newer volume. Empty: done; else what is wrong, in words.
  std::string connect();
  bool connected() const { return page_.load() != nullptr; }
  /// Copies the newest whole image. False where none has been written yet, or the writer was at it during
  /// `tries` attempts (also for ever, if it died half-way): `image` keeps what it had. Real-time safe.
  bool read(ContactImage& image, int tries = 4) const noexcept;
  /// The volume of that number; none where it is 0, or connect() has not found it yet. Valid until the next
  /// but one connect() finds another. Real-time safe.
  voxel::View volume(std::uint64_t number) const noexcept;
  const std::string& name() const { return name_; }

 private:
  struct Mapped;
  std::string connectVolume();

  std::string name_;
  std::unique_ptr<const Mapped> mapped_, before_;  ///< of connect()'s thread
  std::atomic<const Mapped*> volume_{nullptr};
  std::atomic<const ContactPage*> page_{nullptr};  ///< connect() and read() may be of different threads
};

}  // namespace vest::shared
