#include "readers.h"
#include "vest_effects/haemodynamics/model.h"
#include "vest_effects/haemodynamics/vessels.h"
#include "vest_instruments/files/read.h"

namespace vest::fuzz {

std::vector<Reader> effectsReaders() {
  static Folder folder;
  // case.json, then network.csv, inflow.csv and vessels.yaml.
  const auto network = [](const std::string& input) {
    folder.unpack("case.json", input);
    haemodynamics::Network read;
    if (!takes(folder.path(), [&] { read = haemodynamics::readCase(folder.path()); })) return;
    takes(folder.path(), [&] { haemodynamics::buildModel(read, 0.01); });
    takes(folder.path(), [] { haemodynamics::readVessels(folder.path()); });
  };
  const auto pelvis = [] {
    const std::string at = std::string(VEST_SOURCE_DIR) + "/vest_effects/data/vessels/pelvis/";
    std::string all = files::read(at + "case.json", 1 << 20);
    for (const char* name : {"network.csv", "inflow.csv", "vessels.yaml"})
      all += std::string("\n=== ") + name + "\n" + files::read(at + name, 1 << 20);
    return std::vector<std::string>{all};
  };
  return {{"network", network, pelvis}};
}

}  // namespace vest::fuzz
