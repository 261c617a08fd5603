#include "configuration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/package.h>

#include "vest_instruments/ros/footswitches.h"
#include "vest_instruments/tools/tool_names.h"

namespace vest_instruments {
namespace {

using vest::tools::kInstrumentCount;

std::string word(const ros::NodeHandle& nh, const std::string& name, const std::string& otherwise) {
  return read<std::string>(nh, name, otherwise, "a word");
}

vest::control::InputMap inputsFromParameters(const ros::NodeHandle& session_nh, const ros::NodeHandle& nh) {
  vest::control::InputMap map;
  for (std::size_t i = 0; i < kInstrumentCount; ++i) {
    const std::string name(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)));
    const std::string source = word(nh, "sources/" + name, "box");
    const auto known = vest::control::sourceFromName(source);
    if (!known) refuse(nh, "sources/" + name, "'" + source + "'", "none, box, haptic, crtk, teleop, replay");
    map.instruments[i].source = *known;
    map.instruments[i].handle = static_cast<vest::tools::Instrument>(i);
  }
  const vest::control::Footswitches pedals = readFootswitches(session_nh);
  const std::string next = word(nh, "tool_pedal_instrument", "right");
  int found = -1;
  for (int i = 0; i < 3; ++i) {
    if (vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)) == next) found = i;
  }
  if (found < 0) refuse(nh, "tool_pedal_instrument", "'" + next + "'", "left, right, third");
  vest::control::SwitchSource box{"box", {}};
  for (std::size_t i = 0; i < pedals.functions.size(); ++i) {
    const vest::control::PedalFunction f = pedals.functions[i];
    box.switches.push_back({static_cast<int>(i), f,
                            f == vest::control::PedalFunction::NextTool
                                ? vest::control::maskOf(static_cast<vest::tools::Instrument>(found))
                                : vest::control::kEveryInstrument});
  }
  map.switches.push_back(box);
  map.switches.push_back({"teleop", box.switches});  // a keyboard stands in for the footswitches
  return map;
}

}  // namespace

void refuse(const ros::NodeHandle& nh, const std::string& name, const std::string& value,
            const std::string& allowed) {
  throw std::runtime_error("parameter " + nh.resolveName(name) + ": " + value + "; allowed: " + allowed);
}

Configuration readConfiguration(const ros::NodeHandle& session_nh, const ros::NodeHandle& nh) {
  Configuration c;
  if (nh.hasParam("pedals"))
    refuse(nh, "pedals", "given to the instruments alone",
           "footswitch_preset in the session's namespace, where the driver reads it, too");
  const std::string shipped = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml";
  c.box = vest::kinematics::loadTrainerBox(word(nh, "trainer_box", shipped));
  for (std::size_t i = 0; i < kInstrumentCount; ++i) {
    auto& arm = c.box.arms[i];
    const std::string name(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)));
    if (name == "endoscope" || !arm.present) continue;
    const std::string tool = word(nh, "tools/" + name, std::string(vest::tools::toolName(arm.tool)));
    const auto kind = vest::tools::toolFromName(tool);
    if (!kind || *kind == vest::tools::ToolKind::Endoscope) {
      refuse(nh, "tools/" + name, "'" + tool + "'", vest::tools::handTools());
    }
    arm.tool = *kind;
  }
  if (nh.hasParam("optic_deg")) {
    const double optic = read<double>(nh, "optic_deg", 0, "a number");
    if (!(optic >= 0 && optic <= 90)) refuse(nh, "optic_deg", std::to_string(optic), "0 to 90 degrees");
    c.box.arms[static_cast<std::size_t>(vest::tools::Instrument::Endoscope)].optic_angle =
        optic * 0.017453292519943295;
  }
  static_cast<void>(readFootswitches(session_nh));  // a wrong one is refused in the driver's words
  c.footswitch_preset = word(session_nh, "footswitch_preset", "trainer");
  const std::string inputs = word(nh, "inputs", "");
  c.inputs = inputs.empty() ? inputsFromParameters(session_nh, nh) : vest::control::loadInputMap(inputs);
  for (const vest::control::SwitchSource& source : c.inputs.switches) {
    const std::string preset = word(session_nh, "footswitch_preset", "inputs");
    if (!inputs.empty() && source.on == "box" && preset != "inputs")
      refuse(session_nh, "footswitch_preset", "'" + preset + "' beside an input map with switches on the box",
             "inputs: the map says what its pedals do");
  }
  for (const std::string& tool :
       read<std::vector<std::string>>(nh, "tool_tray", {}, "a list of tools' names")) {
    const auto kind = vest::tools::toolFromName(tool);
    if (!kind || *kind == vest::tools::ToolKind::Endoscope || *kind == vest::tools::ToolKind::None) {
      refuse(nh, "tool_tray", "'" + tool + "'", "tools of the README's table, e.g. [clip_applier, scissors]");
    }
    c.tool_tray.push_back(*kind);
  }

  const auto tilt = read<std::vector<double>>(nh, "tilt", {0.0, 0.0}, "[about x, about y] in rad");
  if (tilt.size() != 2 || !(std::abs(tilt[0]) <= 0.8) || !(std::abs(tilt[1]) <= 0.8)) {
    refuse(nh, "tilt", "not two angles within ±0.8 rad", "[about x, about y] in rad, each within ±0.8");
  }
  c.X_WB = vest::kinematics::tiltedBox(tilt[0], tilt[1]);
  c.type_package = word(nh, "crtk_package", "auto");
  if (c.type_package == "auto") {
    ros::V_string packages;  // asking for a missing package by name would print an error
    ros::package::getAll(packages);
    const bool found = std::find(packages.begin(), packages.end(), "crtk_msgs") != packages.end();
    c.type_package = found ? "crtk_msgs" : "vest_msgs";
  } else if (c.type_package != "vest_msgs" && c.type_package != "crtk_msgs") {
    refuse(nh, "crtk_package", "'" + c.type_package + "'", "auto, vest_msgs, crtk_msgs");
  }
  c.set_robot_description = read<bool>(nh, "set_robot_description", true, "true or false");
  return c;
}

}  // namespace vest_instruments
