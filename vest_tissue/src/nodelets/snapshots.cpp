#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "vest_instruments/files/read.h"
#include "vest_tissue/ros/tissue_server.h"

// The snapshot service: by name in memory (and in the session's folder where there is one, for
// re-simulation), or in a file.
namespace vest::ros_shell {
namespace {

constexpr std::size_t kMostSnapshots = 64;
constexpr std::size_t kMostBytes = 1u << 30;  // of a file
bool isPath(const std::string& name) {
  return name.find('/') != std::string::npos;
}

/// Anyone on the network may call the service: what it writes is a file of the session's own folder.
void checkWord(const std::string& name) {
  const auto plain = [](char c) { return c >= ' ' && c != '/' && c != 127; };
  if (name.size() > 100 || !std::all_of(name.begin(), name.end(), plain))
    throw std::invalid_argument(
        "name: " + files::shown(name, 300) +
        " (allowed: a word without '/', which becomes a file in the session's snapshots/)");
}

/// In a folder of snapshots that may not be there yet. No link is followed, in the folder's place or in the
/// file's: the file is written beside it and takes its name whole.
void keepFile(const std::string& file, const std::vector<std::uint8_t>& bytes) {
  const std::string folder = std::filesystem::path(file).parent_path().string(), beside = file + ".part";
  mkdir(folder.c_str(), 0777);
  const int in = open(folder.c_str(), O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (in < 0) throw std::invalid_argument(folder + ": is no folder (allowed: a folder, not a link to one)");
  const auto name = [](const std::string& path) { return std::filesystem::path(path).filename().string(); };
  unlinkat(in, name(beside).c_str(), 0);
  const int out =
      openat(in, name(beside).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  std::size_t done = 0;
  while (out >= 0 && done < bytes.size()) {
    const ssize_t n = write(out, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::size_t>(n);
  }
  bool kept = out >= 0 && close(out) == 0 && done == bytes.size();
  kept = kept && renameat(in, name(beside).c_str(), in, name(file).c_str()) == 0;
  if (!kept) unlinkat(in, name(beside).c_str(), 0);
  close(in);
  if (!kept) throw std::invalid_argument(file + ": cannot be written");
}

}  // namespace

bool TissueServer::keepsFiles() const {
  std::error_code unknown;
  return !session_directory_.empty() && std::filesystem::is_directory(session_directory_, unknown);
}

std::string TissueServer::snapshotFile(const std::string& name) const {
  if (isPath(name)) return name;
  return session_directory_.empty() ? "" : session_directory_ + "/snapshots/" + name + ".snapshot";
}

bool TissueServer::onSnapshot(vest_msgs::Snapshot::Request& req, vest_msgs::Snapshot::Response& res) {
  // In the same call as what is done, so that no step comes between.
  const auto answer = [&](scene::Simulation& s) {
    res.step = s.world().steps();
    res.state_hash = s.world().stateHash();
  };
  try {
    if (req.name.empty()) throw std::invalid_argument("name: empty (allowed: a word, or the path of a file)");
    const std::string file = snapshotFile(req.name);
    if (req.operation == vest_msgs::Snapshot::Request::SAVE) {
      checkWord(req.name);
      std::vector<std::uint8_t> bytes;
      runner_->call([&](scene::Simulation& s) { s.save(bytes), answer(s); });
      if (keepsFiles()) keepFile(file, bytes);
      if (snapshots_.size() >= kMostSnapshots && snapshots_.count(req.name) == 0)
        throw std::invalid_argument("64 snapshots are kept already (allowed: names in use)");
      snapshots_[req.name] = std::move(bytes);
    } else if (req.operation == vest_msgs::Snapshot::Request::RESTORE) {
      std::vector<std::uint8_t> bytes;
      const auto kept = snapshots_.find(req.name);
      if (kept != snapshots_.end()) {
        bytes = kept->second;
        // Saved before anything was recorded: re-simulation will ask for it.
        if (keepsFiles() && !std::filesystem::exists(file)) keepFile(file, bytes);
      } else {
        if (file.empty()) throw std::invalid_argument("there is no snapshot '" + req.name + "'");
        try {
          const std::string read = files::read(file, kMostBytes);
          bytes.assign(read.begin(), read.end());
        } catch (const files::Refused& why) {
          throw std::invalid_argument("there is no snapshot '" + files::shown(req.name, 300) +
                                      "': " + why.value);
        }
      }
      runner_->restore(bytes, req.name, answer);
      topology_due_ = true;
    } else {
      throw std::invalid_argument("operation: " + std::to_string(req.operation) +
                                  " (allowed: 0 SAVE, 1 RESTORE)");
    }
    res.success = true;
    const bool memory = !isPath(req.name) && !keepsFiles();
    res.message = memory ? req.name + " (in memory: nothing is recorded)" : file;
  } catch (const std::exception& e) {
    res.success = false;
    res.message = std::string("snapshot refused: ") + e.what();
    ROS_ERROR("%s", res.message.c_str());
    runner_->call(answer);
  }
  return true;
}

}  // namespace vest::ros_shell
