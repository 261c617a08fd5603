/// A scene that takes its place whole or not at all.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace vest::image {

/// Files of a folder that is there. Until finish() they lie in a hidden folder within it.
class WrittenScene {
 public:
  /// @throws std::invalid_argument where the folder cannot be written to
  explicit WrittenScene(const std::string& directory);
  ~WrittenScene();
  WrittenScene(const WrittenScene&) = delete;
  WrittenScene& operator=(const WrittenScene&) = delete;

  /// @throws std::invalid_argument naming the file where it cannot be written
  void save(const std::string& name, const std::string& bytes);
  /// All files take their places, if the check takes the scene.
  /// @return path of the scene @throws what the check throws, with the files' places in the message
  std::string finish(const std::string& scene, const std::function<void(const std::string& scene)>& check);

 private:
  std::string directory_, hidden_;
  std::vector<std::string> names_;
};

}  // namespace vest::image
