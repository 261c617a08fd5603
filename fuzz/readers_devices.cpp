#include "readers.h"
#include "vest_haptics/device/device.h"
#include "vest_haptics/device/replay.h"
#include "vest_instruments/files/read.h"
#include "vest_viz/camera/model.h"
#include "vest_viz/instrument/stl.h"

namespace vest::fuzz {

std::vector<Reader> deviceReaders() {
  static Folder folder;
  const auto written = [](const std::string& name, const std::string& input) {
    folder.clear();
    return folder.write(name, input);
  };
  return {
      {"haptic_motion",
       [=](const std::string& input) {
         const std::string file = written("motion.csv", input);
         takes(file, [&] {
           haptics::ReplayDevice device;
           device.open({{"file", file}});
           haptics::Sample sample;
           for (int i = 0; i < 100; ++i) device.read(sample);
         });
       },
       {}},
      {"camera",
       [=](const std::string& input) {
         const std::string file = written("camera.yaml", input);
         takes(file, [&] { camera::readCalibration(file); });
       },
       {}},
      {"instrument",
       [=](const std::string& input) {
         const std::string file = written("shaft.stl", input);
         takes(file, [&] { instrument::readStl(file, 0.6); });
       },
       shipped("vest_instruments/meshes/injection_needle_fixed.stl")},
  };
}

}  // namespace vest::fuzz
