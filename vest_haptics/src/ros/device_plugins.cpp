#include "device_plugins.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <vector>

#include <tinyxml2.h>

namespace vest::ros_shell {
namespace {

// Beside full names of plug-ins.
std::string className(const std::string& word) {
  if (word == "sim") return "vest_haptics/Simulated";
  if (word == "phantom") return "vest_haptics/Phantom";
  if (word == "impulse_engine") return "vest_haptics/ImpulseEngine";
  if (word == "force_dimension") return "vest_haptics/ForceDimension";
  if (word == "replay") return "vest_haptics/Replay";
  return word;
}

// Files, each as often as it declares a device of one of these names. What is no XML was refused before.
std::vector<std::string> declaring(const std::vector<std::string>& files,
                                   const std::set<std::string>& names) {
  std::vector<std::string> found;
  for (const std::string& file : std::set<std::string>(files.begin(), files.end())) {
    tinyxml2::XMLDocument document;
    document.LoadFile(file.c_str());
    const tinyxml2::XMLElement* library = document.RootElement();
    if (library && library->Value() == std::string("class_libraries"))
      library = library->FirstChildElement("library");
    for (; library; library = library->NextSiblingElement("library")) {
      for (const tinyxml2::XMLElement* c = library->FirstChildElement("class"); c;
           c = c->NextSiblingElement("class")) {
        const char* name = c->Attribute("name") ? c->Attribute("name") : c->Attribute("type");
        const char* base = c->Attribute("base_class_type");
        if (name && base && base == std::string("vest::haptics::Device") && names.count(name) > 0)
          found.push_back(file);
      }
    }
  }
  return found;
}

}  // namespace

DevicePlugins::DevicePlugins() : loader_("vest_haptics", "vest::haptics::Device") {}

boost::shared_ptr<haptics::Device> DevicePlugins::create(const std::string& word) {
  const std::string name = className(word);
  const std::vector<std::string> files = declaring(loader_.getPluginXmlPaths(), {name, word});
  if (files.size() > 1) {
    std::string where;
    for (const std::string& file : files) where += " " + file;
    throw std::runtime_error("device '" + word + "' is declared " + std::to_string(files.size()) +
                             " times, in" + where + "; allowed: once. Rename the others in their files");
  }
  try {
    return loader_.createInstance(name);
  } catch (const pluginlib::PluginlibException& e) {
    std::string known;
    for (const std::string& c : loader_.getDeclaredClasses()) known += " " + c;
    throw std::runtime_error("device '" + word +
                             "' is no plug-in of vest_haptics; allowed: sim phantom "
                             "impulse_engine force_dimension replay, or one of" +
                             known + " (" + e.what() + ")");
  }
}

}  // namespace vest::ros_shell
