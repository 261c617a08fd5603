#include "vest_haptics/trial/trial.h"

#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <stdexcept>

#include "vest_tissue/scene/fill_record.h"

namespace vest::haptics {
namespace {

std::string newName() {
  static std::atomic<int> count{0};
  return "/vest_trial_" + std::to_string(::getpid()) + "_" + std::to_string(++count);
}

}  // namespace

Trial::Trial(scene::World& world, tools::ToolKind tool, Device& device, const ControllerOptions& options)
    : world_(world),
      device_(device),
      options_(options),
      instrument_(options.arm, control::Source::Haptic),
      reader_(std::make_shared<shared::ContactReader>(newName())),
      writer_(reader_->name()),
      loop_(device, options, reader_) {
  if (world.description().feel) image_.volume = writer_.shareVolume(*world.description().feel);
  reader_->connect();
  ::shm_unlink(reader_->name().c_str());
  instrument_.exchangeTool(tool);
  image_.generation = writer_.generation();
  loop_.post(Command::Enable);
}

const TrialSample& Trial::tick(std::int64_t now_ns, double jaw, int steps) {
  if (began_ < 0) began_ = now_ns;
  const TickReport& r = loop_.tickOnce(now_ns);
  device_.advance(options_.period);

  // The trocar, as the instrument node has it.
  const double now = 1e-9 * static_cast<double>(now_ns - began_);
  if (r.valid) {
    instrument_.servoPose(control::Source::Haptic, r.X_BTip, now);
    instrument_.servoJaw(control::Source::Haptic, jaw, now);
  }
  instrument_.update(now);

  scene::ToolInput& tool = input_.tools[static_cast<std::size_t>(options_.instrument)];
  const Eigen::Isometry3d X_WTip = options_.X_WB * instrument_.tip();
  tool.present = instrument_.valid();
  tool.tool = instrument_.tool();
  tool.position = X_WTip.translation();
  tool.orientation = Eigen::Quaterniond(X_WTip.linear());
  tool.pivot = options_.X_WB * options_.arm.pivot_B;
  tool.jaw = instrument_.measured()[4];
  for (int i = 0; i < steps; ++i) {
    input_.step = world_.steps() + 1;
    input_.dt = world_.description().dt;
    world_.step(input_, report_);
    input_.requests.clear();
  }
  image_.step = world_.steps();
  image_.steady_ns = now_ns;
  const std::size_t i = static_cast<std::size_t>(options_.instrument);
  shared::fillRecord(report_.contacts[i], tool, image_.contacts[i]);
  writer_.write(image_);

  sample_.time = now;
  sample_.tip = tool.position;
  sample_.asked = r.force_true_W;
  sample_.shown = r.force_shown_W;
  sample_.loads = r.loads;
  sample_.contact = report_.contacts[i].in_contact;
  sample_.grasping = report_.contacts[i].grasping;
  sample_.jaw = tool.jaw;
  sample_.allowance = r.allowance;
  sample_.limits = r.limits;
  return sample_;
}

void writeSamples(const std::string& path, const std::vector<TrialSample>& samples) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw std::runtime_error(path + ": cannot be written");
  std::fputs(
      "t_s,tip_x_m,tip_y_m,tip_z_m,asked_x_N,asked_y_N,asked_z_N,shown_x_N,shown_y_N,shown_z_N,contact,"
      "grasping,"
      "jaw_rad,allowance,limits\n",
      file);
  for (const TrialSample& s : samples) {
    std::fprintf(file, "%.3f,%.6f,%.6f,%.6f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%d,%d,%.3f,%.3f,%u\n", s.time,
                 s.tip.x(), s.tip.y(), s.tip.z(), s.asked.x(), s.asked.y(), s.asked.z(), s.shown.x(),
                 s.shown.y(), s.shown.z(), s.contact, s.grasping, s.jaw, s.allowance, s.limits);
  }
  if (std::fclose(file) != 0) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace vest::haptics
