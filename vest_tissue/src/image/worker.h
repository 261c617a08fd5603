/// Work on files of strangers in a process of its own, so that what kills it is one message.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace vest::image {

/// Memory that a worker fills and its parent reads; zero at first, taken page by page as it is written.
/// @throws std::invalid_argument where the machine has none
std::shared_ptr<void> sharedMemory(std::size_t bytes);

/// Runs work(0) … work(files - 1) in a child process, which may use 4 s of processor time a file and 300 MB,
/// and more in proportion to a large file. Only what it writes to sharedMemory() is left of it: check that
/// before use, for a file may have taken the worker over. Its output is discarded.
/// @param bytes what each file unpacks to, where that counts in place of its size
/// @throws std::invalid_argument "FILE: cause": what work threw, or how the process died
void inWorker(const std::vector<std::string>& files, const std::function<void(std::size_t)>& work,
              std::optional<std::size_t> bytes = {});

/// For fuzzers: inWorker() works in the calling process from now on, which may be ended by what it reads.
/// @param within true while it works: what ends the process then is the file's
/// @param memory bytes that a file may take
void workHere(volatile bool& within, std::size_t memory);

}  // namespace vest::image
