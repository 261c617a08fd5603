#include "vest_instruments/control/input_map.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <limits>

#include "../yaml/field.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace vest::control {
namespace {

using tools::kInstrumentCount;
using yaml::Field;

constexpr std::array<const char*, 5> kJoints{"yaw", "pitch", "insertion", "roll", "jaw"};

std::string instrumentWord(int i) {
  return std::string(tools::instrumentName(static_cast<tools::Instrument>(i)));
}

tools::Instrument readInstrument(const Field& f) {
  const std::string word = f.word({"left", "right", "third", "endoscope"});
  int i = 0;
  while (instrumentWord(i) != word) ++i;
  return static_cast<tools::Instrument>(i);
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& w : words) all += (all.empty() ? "" : ", ") + w;
  return all.empty() ? "nothing: the device has none" : all;
}

// Index of the word among those of a device.
int place(const Field& f, const std::string& word, const std::vector<std::string>& known) {
  const auto at = std::find(known.begin(), known.end(), word);
  if (at == known.end()) f.refuse("'" + word + "'", joined(known));
  return static_cast<int>(at - known.begin());
}

std::vector<std::string> readNames(const Field& f, const char* first, const char* second, std::size_t most) {
  const std::string allowed = "a list of at most " + std::to_string(most) + " names like " + first;
  if (!f.node.IsSequence() || f.node.size() > most) f.refuse("'" + f.text() + "'", allowed);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < f.node.size(); ++i) {
    const Field e = f.element(static_cast<int>(i));
    const std::string name = e.scalar(first);
    const auto begins = [&](const char* prefix) { return prefix != nullptr && name.rfind(prefix, 0) == 0; };
    const std::string kind = std::string(first).substr(0, 4);
    if (!begins(kind.c_str()) && !begins(second)) e.refuse("'" + name + "'", allowed);
    if (std::find(names.begin(), names.end(), name) != names.end())
      e.refuse("'" + name + "' given twice", "each name once");
    names.push_back(name);
  }
  return names;
}

EventDevice readDevice(const std::string& file, const Field& f, const std::string& name) {
  EventDevice d;
  d.name = name;
  f.onlyKeys({"path", "match", "recording", "grab", "buttons", "axes"});
  if (f.has("path") + f.has("match") + f.has("recording") != 1)
    f.refuse("not exactly one of path, match, recording", "one of them");
  if (f.has("path")) d.path = f.at("path").scalar("a path like /dev/input/by-id/NAME-event-kbd");
  if (f.has("match"))
    d.match = f.at("match").scalar("part of the device's name, as 'cat /proc/bus/input/devices' tells it");
  if (f.has("recording")) {
    const std::filesystem::path given = f.at("recording").scalar("a CSV file of events");
    d.recording =
        given.is_absolute() ? given.string() : (std::filesystem::path(file).parent_path() / given).string();
  }
  if (f.has("grab")) d.grab = f.at("grab").word({"true", "false"}) == "true";
  if (f.has("buttons")) d.buttons = readNames(f.at("buttons"), "KEY_A", "BTN_", Pedals::kMost);
  if (f.has("axes")) d.axes = readNames(f.at("axes"), "ABS_X", nullptr, 16);
  if (d.buttons.empty() && d.axes.empty()) f.refuse("neither buttons nor axes", "at least one of them");
  return d;
}

JointControl readControl(const Field& f, const EventDevice& device) {
  JointControl c;
  if (f.node.IsSequence()) {
    if (f.node.size() != 2) f.refuse("'" + f.text() + "'", "an axis, or two buttons [minus, plus]");
    c.minus = place(f.element(0), f.element(0).scalar("a button"), device.buttons);
    c.plus = place(f.element(1), f.element(1).scalar("a button"), device.buttons);
    return c;
  }
  std::string word = f.scalar("an axis, or two buttons [minus, plus]");
  if (word[0] == '-') {
    c.sign = -1.0;
    word.erase(0, 1);
  }
  c.axis = place(f, word, device.axes);
  return c;
}

// A list is its elements with commas between them, as of the parameter `options` of a device.
std::string wordOf(const Field& f) {
  if (f.node.IsScalar()) return f.node.Scalar();
  if (!f.node.IsSequence()) f.refuse("'" + f.text() + "'", "a word, or a list of words");
  std::string all;
  for (std::size_t i = 0; i < f.node.size(); ++i)
    all += (i > 0 ? ", " : "") + wordOf(f.element(static_cast<int>(i)));
  return all;
}

InstrumentInput readInput(const Field& f, int instrument, const std::vector<EventDevice>& devices) {
  InstrumentInput in;
  const std::string source =
      f.at("source").word({"none", "box", "haptic", "crtk", "teleop", "gamepad", "replay"});
  in.handle = static_cast<tools::Instrument>(instrument);
  if (source == "gamepad") {
    f.onlyKeys({"source", "device", "yaw", "pitch", "insertion", "roll", "jaw", "speed", "turn"});
    in.source = Source::Teleop;
    std::vector<std::string> known;
    for (const EventDevice& d : devices) known.push_back(d.name);
    const Field which = f.at("device");
    const int d = place(which, which.scalar("the name of a device"), known);
    in.device = known[static_cast<std::size_t>(d)];
    bool any = false;
    for (std::size_t k = 0; k < kJoints.size(); ++k) {
      if (!f.has(kJoints[k])) continue;
      in.pad.joints[k] = readControl(f.at(kJoints[k]), devices[static_cast<std::size_t>(d)]);
      any = true;
    }
    if (!any) f.refuse("moves no joint", "at least one of yaw, pitch, insertion, roll, jaw");
    if (f.has("speed")) in.pad.speed = f.at("speed").number(0.001, 0.5);
    if (f.has("turn")) in.pad.turn = f.at("turn").number(0.01, 10.0);
    return in;
  }
  in.source = *sourceFromName(source);
  if (source == "box" || source == "replay") {
    f.onlyKeys({"source", "handle"});
    if (f.has("handle")) in.handle = readInstrument(f.at("handle"));
  } else if (source == "haptic") {
    f.onlyKeys({"source", "device", "options"});
    in.device = f.at("device").scalar("sim, phantom, impulse_engine, force_dimension, replay, or a plug-in");
    if (!f.has("options")) return in;
    const Field options = f.at("options");
    if (!options.node.IsMap()) options.refuse("'" + options.text() + "'", "a map of words");
    for (auto it = options.node.begin(); it != options.node.end(); ++it) {
      if (!it->first.IsScalar()) options.refuse("'" + options.text() + "'", "a map of words");
      const std::string& key = it->first.Scalar();
      in.options[key] = wordOf(Field{options.file, options.path + "." + key, it->second});
    }
  } else {
    f.onlyKeys({"source"});
  }
  return in;
}

// The button's index: a name of an event device's list, a number elsewhere.
int readButton(const Field& f, const std::string& on, const std::vector<EventDevice>& devices) {
  for (const EventDevice& d : devices) {
    if (d.name == on) return place(f, f.scalar("a button of the device"), d.buttons);
  }
  const double number = f.number(0, on == "box" || on == "replay" ? Pedals::kCount - 1 : Pedals::kMost - 1);
  if (number != static_cast<int>(number)) f.refuse(f.text(), "a whole number");
  return static_cast<int>(number);
}

void readSwitch(const Field& f, InputMap& map) {
  f.onlyKeys({"on", "button", "function", "instruments"});
  const Field on = f.at("on");
  const std::string source = on.scalar("a source");
  std::vector<std::string> known{"box", "teleop", "replay"};
  for (int i = 0; i < kInstrumentCount; ++i) {
    if (map.instruments[static_cast<std::size_t>(i)].source == Source::Haptic)
      known.push_back("haptics/" + instrumentWord(i));
  }
  for (const EventDevice& d : map.devices) known.push_back(d.name);
  place(on, source, known);
  Switch s;
  s.button = readButton(f.at("button"), source, map.devices);
  const Field function = f.at("function");
  const auto what = function.node.IsScalar() ? pedalFunctionFromName(function.node.Scalar()) : std::nullopt;
  if (!what)
    function.refuse("'" + function.text() + "'", joined({kPedalFunctions.begin(), kPedalFunctions.end()}));
  s.function = *what;
  if (f.has("instruments")) {
    const Field list = f.at("instruments");
    if (!list.node.IsSequence() || list.node.size() == 0)
      list.refuse("'" + list.text() + "'", "a list of left, right, third, endoscope");
    s.instruments = 0;
    for (std::size_t i = 0; i < list.node.size(); ++i)
      s.instruments |= maskOf(readInstrument(list.element(static_cast<int>(i))));
  } else if (s.function == PedalFunction::NextTool) {
    f.refuse("a switch for tools without 'instruments'", "instruments: [right], whose tool is exchanged");
  }
  auto group = std::find_if(map.switches.begin(), map.switches.end(),
                            [&](const SwitchSource& g) { return g.on == source; });
  if (group == map.switches.end()) group = map.switches.insert(map.switches.end(), {source, {}});
  for (const Switch& other : group->switches) {
    if (other.button == s.button && (other.instruments & s.instruments) != 0)
      f.at("button").refuse(f.at("button").text() + " is there already",
                            "one function for a button and an instrument");
  }
  group->switches.push_back(s);
}

}  // namespace

std::string SwitchSource::topic() const {
  if (on == "box") return "phantom_box/footswitches";
  if (on == "teleop" || on == "replay") return on + "/footswitches";
  if (on.rfind("haptics/", 0) == 0) return on + "/buttons";
  return "input/" + on;
}

InputMap loadInputMap(const std::string& path) {
  const Field root = yaml::loadFile(path);
  root.onlyKeys({"devices", "instruments", "switches"});
  InputMap map;
  if (root.has("devices")) {
    const Field devices = root.at("devices");
    if (!devices.node.IsMap()) devices.refuse("not a map", "a map of devices, by name");
    for (auto it = devices.node.begin(); it != devices.node.end(); ++it) {
      const std::string name = it->first.IsScalar() ? it->first.Scalar() : "";
      const bool plain =
          !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) &&
          std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
      if (!plain || name == "box" || name == "teleop" || name == "replay")
        devices.refuse("'" + name + "'",
                       "names of letters, digits and _, a letter first; not box, teleop, replay");
      for (const EventDevice& d : map.devices) {
        if (d.name == name) devices.refuse("'" + name + "' given twice", "each name once");
      }
      map.devices.push_back(readDevice(path, Field{path, "devices." + name, it->second}, name));
    }
  }
  const Field instruments = root.at("instruments");
  instruments.onlyKeys({"left", "right", "third", "endoscope"});
  for (int i = 0; i < kInstrumentCount; ++i) {
    const std::string name = instrumentWord(i);
    if (instruments.has(name.c_str()))
      map.instruments[static_cast<std::size_t>(i)] = readInput(instruments.at(name.c_str()), i, map.devices);
  }
  if (root.has("switches")) {
    const Field switches = root.at("switches");
    if (!switches.node.IsSequence())
      switches.refuse("not a list", "a list of {on, button, function, instruments}");
    for (std::size_t i = 0; i < switches.node.size(); ++i)
      readSwitch(switches.element(static_cast<int>(i)), map);
  }
  return map;
}

}  // namespace vest::control
