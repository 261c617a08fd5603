#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <ros/package.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueTopology.h>
#include <xxhash.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "render.h"
#include "vest_bringup/data/coco.h"
#include "vest_bringup/data/hdf5.h"
#include "vest_bringup/data/lerobot.h"
#include "vest_bringup/ros/moment_bag.h"
#include "vest_bringup/ros/session_player.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/ros/conversions.h"

// Hands recorded sessions to other programs: simulates them again, and writes what learning and statistics
// read.

namespace {

namespace data = vest::data;
namespace fs = std::filesystem;
using nlohmann::json;

struct Wanted {
  std::vector<std::string> sessions, valid;
  std::string to, output, licence, python = "python3";
  double rate = 50;
  int width = 720, height = 576, threads = 1;
  bool pictures = false;
};

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

std::string hashOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<char> room(1U << 20U);
  const std::unique_ptr<XXH64_state_t, XXH_errorcode (*)(XXH64_state_t*)> state(XXH64_createState(),
                                                                                &XXH64_freeState);
  XXH64_reset(state.get(), 0);
  while (in.read(room.data(), static_cast<std::streamsize>(room.size())), in.gcount() > 0)
    XXH64_update(state.get(), room.data(), static_cast<std::size_t>(in.gcount()));
  return hex(XXH64_digest(state.get()));
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written (is the disk full?)");
}

/// One session on its way: episodes, and moments for the renderer.
class Collector {
 public:
  Collector(const Wanted& wanted, const std::string& path, bool valid)
      : wanted_(wanted),
        file_(fs::is_directory(path) ? path + "/session.bag" : path),
        name_(fs::absolute(file_).parent_path().filename().string()),
        valid_(valid) {}

  /// @param moments bag that gets what pictures show; empty: none
  void play(const std::string& moments) {
    vest::session::RecordedSession session(file_);
    vest::session::PlayOptions options;
    options.effects = true, options.threads = wanted_.threads;
    if (!moments.empty()) {
      moments_ = std::make_unique<vest::ros_shell::MomentBag>(moments);
      options.frames = moments_->frames();
    }
    const auto carried = session.effects() ? vest::session::exerciseOf(session) : std::nullopt;
    if (carried) exercise_ = carried->name, aim_ = carried->aim;
    played_ = vest::session::play(fs::path(file_).parent_path().string(), session, options,
                                  [this](const auto& world, const auto& input, const auto& report,
                                         const auto* engine) { look(world, input, report, engine); });
    if (moments_) moments_->close();
    // An exercise has its total when it is finished, which lies between two rows.
    if (played_.result && !episodes_.empty() && !episodes_.back().rows.empty())
      episodes_.back().rows.back().score = played_.result->total / 100;
    if (times_.empty())
      throw std::invalid_argument(left_out_ > 0 ? "the session has no endoscope: there is nothing to draw"
                                                : "the session is shorter than one row");
  }

  json card() const {
    json c{{"session", name_},
           {"bag_xxh64", hashOf(file_)},
           {"steps", played_.steps},
           {"state_hashes_compared", played_.compared},
           {"effects_hashes_compared", played_.compared_effects},
           {"faults", played_.faults},
           {"kernel", played_.kernel},
           {"split", valid_ ? "valid" : "train"},
           {"moments_without_endoscope_left_out", left_out_}};
    if (!played_.result) return c;
    c["exercise"] = {{"name", played_.result->exercise}, {"hash", played_.result->hash}};
    c["exercise"]["passed"] = played_.result->passed, c["exercise"]["total"] = played_.result->total;
    c["exercise"]["input_hash"] = hex(played_.result->input_hash);
    return c;
  }

  std::vector<data::Episode>& episodes() { return episodes_; }
  const std::vector<double>& times() const { return times_; }  ///< s, of each row of all episodes
  const std::map<std::uint16_t, std::string>& objects() const { return objects_; }
  const std::string& file() const { return file_; }

 private:
  void begin(const vest::scene::World& world, double dt) {
    data::Episode e;
    e.session = name_, e.scene = world.description().name, e.scene_hash = world.description().hash;
    e.exercise = exercise_, e.aim = aim_, e.valid = valid_, e.first_picture = times_.size();
    every_ = static_cast<std::uint64_t>(std::max(1L, std::lround(1 / (wanted_.rate * dt))));
    e.rate = 1 / (static_cast<double>(every_) * dt);
    begun_ = world.steps() - 1;
    episodes_.push_back(std::move(e));
    vest_msgs::TissueTopology topology;
    vest::ros_shell::toMsg(world, topology);
    for (const auto& o : topology.objects) objects_[o.segmentation_label] = o.name;
  }

  void look(const vest::scene::World& world, const vest::scene::StepInput& input,
            const vest::scene::StepReport& report, const vest::exercise::Engine* engine) {
    if (episodes_.empty() || world.steps() != last_ + 1 ||
        world.description().hash != episodes_.back().scene_hash)
      begin(world, input.dt);
    last_ = world.steps(), time_ += input.dt;
    data::Episode& e = episodes_.back();
    for (const vest::scene::Event& event : report.events) {
      vest_msgs::TissueEvent m;
      vest::ros_shell::toMsg(event, world.description(), m);
      e.events.push_back({world.time(), m.text, event.position, event.station, event.energy});
    }
    if ((last_ - begun_) % every_ != 0) return;
    if (moments_) {
      if (!input.tools[3].present) return void(++left_out_);
      moments_->write(time_, world, box_, input);
    }
    times_.push_back(time_);
    e.rows.push_back(row(world, input, report, engine));
  }

  static data::Row row(const vest::scene::World& world, const vest::scene::StepInput& input,
                       const vest::scene::StepReport& report, const vest::exercise::Engine* engine) {
    data::Row row;
    row.step = world.steps(), row.time = world.time(), row.state_hash = world.stateHash();
    if (engine) row.score = engine->result().total / 100;
    for (std::size_t i = 0; i < row.tools.size(); ++i) {
      const vest::scene::ToolInput& t = input.tools[i];
      const vest::scene::ContactModel& c = report.contacts[i];
      row.tools[i] = {t.present,   t.position,         t.orientation, t.jaw,        static_cast<int>(t.tool),
                      t.functions, c.wrench.head<3>(), c.grasping,    c.pinch_force};
    }
    return row;
  }

  const Wanted& wanted_;
  std::string file_, name_, exercise_, aim_;
  bool valid_;
  std::unique_ptr<vest::ros_shell::MomentBag> moments_;
  vest::kinematics::TrainerBox box_ = vest::kinematics::loadTrainerBox(
      ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml");
  std::vector<data::Episode> episodes_;
  std::vector<double> times_;
  std::map<std::uint16_t, std::string> objects_;
  vest::session::Played played_;
  std::uint64_t every_ = 1, begun_ = 0, last_ = 0, left_out_ = 0;
  double time_ = 0;
};

/// The folder that gets the files; gone again where it is not finished.
class Output {
 public:
  explicit Output(const std::string& folder) : folder_(fs::absolute(folder)), part_(folder_) {
    part_ += ".part";
    if (fs::exists(folder_) || fs::exists(part_))
      throw std::invalid_argument("--output: " + folder + " or " + folder +
                                  ".part is there already (allowed: a new folder)");
    fs::create_directories(part_);
  }
  ~Output() {
    std::error_code ignored;
    fs::remove_all(part_, ignored);
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  fs::path operator/(const std::string& name) const { return part_ / name; }
  const fs::path& part() const { return part_; }
  std::string name() const { return folder_.filename().string(); }
  void finish() { fs::rename(part_, folder_); }

 private:
  fs::path folder_, part_;
};

json columns() {
  json all = json::array(
      {{{"name", "t_s, obs/time, simulated_time"}, {"unit", "s"}, {"meaning", "simulated time"}}});
  for (const data::Column& c : data::columnsOf(0))
    all.push_back({{"name", "INSTRUMENT_" + c.name}, {"unit", c.unit}, {"meaning", c.meaning}});
  all.push_back(
      {{"name", "score"}, {"unit", "1"}, {"meaning", "total of the exercise over 100, known at its end"}});
  all.push_back({{"name", "rewards, next.reward"}, {"unit", "1"}, {"meaning", "change of the score"}});
  all.push_back(
      {{"name", "actions, action"},
       {"unit", "1"},
       {"meaning",
        "per hand 6 numbers in [-1, 1]: tip in world x y z (1: 2 mm in 20 ms), turn about the shaft, "
        "opening of the jaw (1: 0.1 rad in 20 ms), functions (on 1, off -1)"}});
  all.push_back({{"name", "frame_*.png, endoscope_image, observation.images.endoscope"},
                 {"unit", "1"},
                 {"meaning", "8 bit RGB"}});
  all.push_back({{"name", "depth_*.png"},
                 {"unit", "0.1 mm"},
                 {"meaning", "16 bit, along the optical axis; 0: nothing seen"}});
  all.push_back({{"name", "flow_*.flo"},
                 {"unit", "pixel"},
                 {"meaning", "place in this picture minus place in the one before"}});
  return all;
}

std::vector<std::string> size(const Wanted& wanted) {
  return {"--width", std::to_string(wanted.width), "--height", std::to_string(wanted.height)};
}

std::string frame(const fs::path& folder, std::size_t k) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%06zu.png", k);
  return (folder / name).string();
}

class Export {
 public:
  explicit Export(const Wanted& wanted) : wanted_(wanted), output_(wanted.output) {}

  void run() {
    if (wanted_.to == "lerobot") {  // before all else: whoever lacks LeRobot is told at once
      fs::create_directory(output_ / "work");
      lerobot_ = std::make_unique<data::LeRobot>(
          wanted_.python, ros::package::getPath("vest_bringup") + "/scripts/lerobot_writer.py",
          (output_ / "work").string());
    }
    const bool draws = wanted_.to == "coco" || wanted_.to == "mp4" || wanted_.pictures;
    for (const auto* list : {&wanted_.sessions, &wanted_.valid})
      for (const std::string& path : *list) {
        Collector session(wanted_, path, list == &wanted_.valid);
        const fs::path moments = output_ / "moments.bag";
        try {
          session.play(draws ? moments.string() : "");
        } catch (const vest::session::Difference& e) {
          throw vest::session::Difference(session.file() + ": " + e.what());
        } catch (const std::exception& e) {
          const std::string what = e.what();
          throw std::invalid_argument(what.rfind(session.file(), 0) == 0 ? what
                                                                         : session.file() + ": " + what);
        }
        if (draws) draw(session, moments);
        take(session);
      }
    if (wanted_.to == "hdf5")
      card_["actions_cut_off"] = data::writeHdf5((output_ / "sessions.hdf5").string(), episodes_, frames_);
    if (lerobot_) writeLeRobot();
    fs::remove_all(output_ / "frames");
    finish();
  }

 private:
  /// LeRobot makes a folder of its own; what is in it becomes ours, so that the card lies beside it.
  void writeLeRobot() {
    const fs::path made = output_ / "made";
    std::string name = output_.name();
    for (char& c : name)  // as LeRobot's hub has names
      if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
    lerobot_->write(made.string(), name, episodes_, frames_, wanted_.height, wanted_.width);
    for (const auto& entry : fs::directory_iterator(made))
      fs::rename(entry.path(), output_ / entry.path().filename().string());
    fs::remove(made), fs::remove_all(output_ / "work");
    card_["actions_cut_off"] = lerobot_->beyond();
    card_["lerobot"] = {
        {"version", lerobot_->version()}, {"format", lerobot_->format()}, {"repo_id", "vest/" + name}};
  }

  void draw(const Collector& session, const fs::path& moments) {
    std::vector<std::string> options = size(wanted_);
    options.emplace_back("--each-state");
    if (wanted_.to == "mp4") {
      const std::string rate = std::to_string(rateOf(session));
      options.insert(options.end(),
                     {"--no-frames", "--fps", rate, "--video", (output_ / "session.mp4").string()});
    } else {
      const bool coco = wanted_.to == "coco";
      const fs::path folder = coco ? output_.part() : output_ / "frames" / std::to_string(frames_.size());
      options.insert(options.end(), {"--output", folder.string()});
      if (coco) options.emplace_back("--truth");
      if (!coco)
        for (std::size_t k = 0; k < session.times().size(); ++k) frames_.push_back(frame(folder, k));
    }
    if (!vest::tools::render(moments.string(), options))
      throw std::runtime_error(session.file() + ": vest_render could not draw it (see above)");
    fs::remove(moments);
    if (wanted_.to != "coco") return;
    data::writeCoco(output_.part().string(), session.objects(), session.times(), wanted_.licence);
    fs::remove(output_ / "keypoints.csv");
  }

  static double rateOf(const Collector& session) {
    const auto& t = session.times();
    return t.size() < 2 ? 25 : static_cast<double>(t.size() - 1) / (t.back() - t.front());
  }

  void take(Collector& session) {
    card_["sessions"].push_back(session.card());
    for (data::Episode& e : session.episodes()) {
      e.name = "demo_" + std::to_string(episodes_.size());
      e.first_picture += first_picture_;
      e.leaveOutEnds();
      card_["episodes"].push_back({{"name", e.name},
                                   {"session", e.session},
                                   {"scene", e.scene},
                                   {"scene_hash", e.scene_hash},
                                   {"rows", e.rows.size()},
                                   {"rows_without_instruments_left_out", e.left_out},
                                   {"rate_hz", e.rate}});
      if (wanted_.to == "csv") {
        write(output_ / (e.name + ".csv"), data::toCsv(e));
        write(output_ / (e.name + "_events.csv"), data::eventsToCsv(e));
      }
      episodes_.push_back(std::move(e));
    }
    first_picture_ += session.times().size();
  }

  /// The data card, last: it has the hashes of all files.
  void finish() {
    card_["vest_export"] = 1, card_["version"] = VEST_VERSION, card_["format"] = wanted_.to;
    card_["frame"] = "world: z up against gravity, origin on the floor of the box (docs/conventions.md)";
    card_["licence"] = wanted_.licence, card_["columns"] = columns();
    card_["source"] = "re-simulated from step_inputs; each recorded hash was compared";
    if (wanted_.to == "coco" || wanted_.to == "mp4" || wanted_.pictures)
      card_["picture_size"] = {wanted_.width, wanted_.height};
    std::map<std::string, json> files;
    for (const auto& f : fs::recursive_directory_iterator(output_.part()))
      if (f.is_regular_file())
        files[f.path().lexically_relative(output_.part()).string()] = {{"bytes", f.file_size()},
                                                                       {"xxh64", hashOf(f.path())}};
    card_["files"] = files;
    write(output_ / "card.json", card_.dump(1) + "\n");
    std::size_t rows = 0;
    for (const auto& e : episodes_) rows += e.rows.size();
    output_.finish();
    std::printf("%s: %zu episode%s, %zu rows, %zu files\n", vest::files::shown(wanted_.output, 6000).c_str(),
                episodes_.size(), episodes_.size() == 1 ? "" : "s", rows, files.size() + 1);
  }

  const Wanted& wanted_;
  Output output_;
  std::vector<data::Episode> episodes_;
  std::vector<std::string> frames_;
  std::size_t first_picture_ = 0;
  json card_;
  std::unique_ptr<data::LeRobot> lerobot_;
};

void check(const Wanted& wanted) {
  if ((wanted.to == "coco" || wanted.to == "mp4") && wanted.sessions.size() + wanted.valid.size() != 1)
    throw std::invalid_argument("--to " + wanted.to + " takes one session at a time");
  if (wanted.pictures && wanted.to != "hdf5" && wanted.to != "lerobot")
    throw std::invalid_argument("--pictures goes with --to hdf5 and lerobot");
  if (wanted.pictures && wanted.to == "lerobot" && (wanted.width % 2 != 0 || wanted.height % 2 != 0))
    throw std::invalid_argument("--width, --height: a video of LeRobot has even numbers of pixels");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Exports recorded sessions for learning and statistics. They are simulated again, so that all rows "
      "have "
      "one rate. The folder gets card.json: units, versions, hashes, licence. Exit 0: exported; 1: the "
      "session "
      "does not re-simulate; 2: refused, nothing is written"};
  Wanted wanted;
  wanted.licence = "not stated: ask whoever recorded it";
  app.add_option("SESSION", wanted.sessions, "folders with session.bag, or bags")->required();
  app.add_option("--to", wanted.to,
                 "csv: tables; hdf5: robomimic's layout; lerobot: LeRobot's format 3; coco: pictures with "
                 "masks, keypoints, depth and flow; mp4: a video")
      ->required()
      ->check(CLI::IsMember({"csv", "hdf5", "coco", "mp4", "lerobot"}));
  app.add_option("--output", wanted.output, "new folder")->required();
  app.add_option("--valid", wanted.valid,
                 "hdf5: sessions for mask/valid, others: for the card; all of a trainee on one side")
      ->expected(1, -1);
  app.add_option("--rate", wanted.rate, "rows or pictures per simulated second")
      ->check(vest::files::number(0.1, 1000));
  app.add_flag("--pictures", wanted.pictures, "hdf5, lerobot: what the endoscope sees, too");
  app.add_option("--width", wanted.width, "of pictures, pixels")->check(CLI::Range(64, 4096));
  app.add_option("--height", wanted.height, "of pictures, pixels")->check(CLI::Range(64, 4096));
  app.add_option("--python", wanted.python, "lerobot: the Python that has it; without: the first on PATH");
  app.add_option("--licence", wanted.licence, "of the data, for the card");
  app.add_option("--threads", wanted.threads, "worker threads")->check(CLI::Range(1, 64));
  CLI11_PARSE(app, argc, argv);
  try {
    check(wanted);
    Export(wanted).run();
  } catch (const vest::session::Difference& e) {
    std::fprintf(stderr, "vest_export: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_export: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 2;
  }
  return 0;
}
