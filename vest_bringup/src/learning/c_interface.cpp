#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "step_input.h"
#include "vest_bringup/learning/environment.h"
#include "vest_bringup/vest.h"

namespace {

using vest::learning::Environment;
using vest::learning::Environments;
using vest::learning::kActionSize;
using vest::learning::kObservationSize;
using vest::learning::Task;
using vest::scene::World;

using Model = std::shared_ptr<const Task>;
struct Tissue {
  Tissue(const vest::scene::Description& d, int parts_of_dt, int threads)
      : world(d, threads), parts(parts_of_dt) {}
  World world;
  int parts;  ///< of the scene's dt: a World takes 0.01 s at most
  vest::scene::StepInput input;
  vest::scene::StepReport report;

  /// One step of `input`.
  void step();
};

struct Entry {
  std::mutex in_use;
  std::variant<Model, std::unique_ptr<Tissue>, std::unique_ptr<Environment>, std::unique_ptr<Environments>>
      what;
  std::mutex error_mutex;
  std::string error;
};

/// Numbers in place of pointers: a closed handle is looked up and not found, whatever lies in memory.
class Registry {
 public:
  vest_handle add(std::shared_ptr<Entry> entry) {
    const std::lock_guard lock(mutex_);
    entries_.emplace(++last_, std::move(entry));
    return last_;
  }
  std::shared_ptr<Entry> find(vest_handle handle) {
    const std::lock_guard lock(mutex_);
    const auto it = entries_.find(handle);
    return it == entries_.end() ? nullptr : it->second;
  }
  std::shared_ptr<Entry> remove(vest_handle handle) {
    const std::lock_guard lock(mutex_);
    const auto it = entries_.find(handle);
    if (it == entries_.end()) return nullptr;
    auto entry = std::move(it->second);
    entries_.erase(it);
    return entry;
  }

 private:
  std::mutex mutex_;
  std::map<vest_handle, std::shared_ptr<Entry>> entries_;
  vest_handle last_ = 0;
};

Registry& registry() {
  static auto* const all = new Registry;  // outlives whatever closes handles while the program ends
  return *all;
}

thread_local std::string thread_error, told_error, told_scene;

struct Failure {
  int code;
  std::string text;
};
[[noreturn]] void fail(int code, std::string text) {
  throw Failure{code, std::move(text)};
}
void Tissue::step() {
  if (world.step(input, report) == vest::scene::Status::Fault)
    fail(VEST_FAULT, "step " + std::to_string(world.steps()) + ": fault of object '" +
                         std::string(report.fault_object) + "'");
}
[[noreturn]] void badArgument(std::string text) {
  fail(VEST_BAD_ARGUMENT, std::move(text));
}
void need(const void* pointer, const char* name) {
  if (!pointer) badArgument(std::string(name) + " is NULL");
}
void needSize(std::size_t count, std::size_t wanted, const char* name) {
  if (count != wanted)
    badArgument(std::string(name) + ": " + std::to_string(count) +
                " numbers (allowed: " + std::to_string(wanted) + ")");
}
void needPicture(std::size_t pictures, std::int32_t width, std::int32_t height, const void* rgb,
                 std::size_t rgb_count, const void* depth, std::size_t depth_count) {
  for (const std::int32_t side : {width, height})
    if (side < 8 || side > 1024)
      badArgument("width and height: " + std::to_string(side) + " pixels (allowed: 8 to 1024)");
  const auto pixels = pictures * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  need(rgb, "rgb"), needSize(rgb_count, 3 * pixels, "rgb");
  need(depth, "depth"), needSize(depth_count, pixels, "depth");
}
/// Cut off to the room, with its 0.
void copyText(const std::string& from, char* text, std::size_t capacity) {
  need(text, "text");
  if (capacity == 0) badArgument("capacity: 0 (allowed: 1 and more)");
  const std::size_t length = std::min(from.size(), capacity - 1);
  from.copy(text, length);
  text[length] = 0;
}
template <class S>
void needStruct(const S* s, const char* name) {
  need(s, name);
  if (s->struct_size != sizeof(S))
    badArgument(std::string(name) + ": struct_size is " + std::to_string(s->struct_size) +
                " (allowed: " + std::to_string(sizeof(S)) + ")");
}
int threads(std::int32_t wanted) {
  if (wanted < 1 || wanted > 64) badArgument("threads: " + std::to_string(wanted) + " (allowed: 1 to 64)");
  return wanted;
}

/// Runs a call and makes a code and a text of what it throws.
template <class Work>
int guarded(Entry* entry, Work work) noexcept {
  int code = VEST_OK;
  const char* text = "";
  std::string kept;
  try {
    try {
      work();
    } catch (Failure& f) {
      code = f.code;
      kept = std::move(f.text);
    } catch (const std::bad_alloc&) {
      code = VEST_INTERNAL, text = "out of memory";
    } catch (const std::logic_error& e) {  // with std::invalid_argument
      code = dynamic_cast<const std::invalid_argument*>(&e) ? VEST_REFUSED : VEST_OVER;
      kept = e.what();
    } catch (const std::runtime_error& e) {  // files
      code = VEST_REFUSED, kept = e.what();
    } catch (const std::exception& e) {
      code = VEST_INTERNAL, kept = e.what();
    } catch (...) {
      code = VEST_INTERNAL, text = "unknown";
    }
    if (*text != 0) kept = text;
    if (code != VEST_OK) thread_error = kept;
    if (entry) {
      const std::lock_guard lock(entry->error_mutex);
      entry->error = std::move(kept);
    }
  } catch (...) {  // no memory for the text
    if (code == VEST_OK) code = VEST_INTERNAL;
  }
  return code;
}

template <class Work>
int onHandle(vest_handle handle, Work work) noexcept {
  std::shared_ptr<Entry> entry;
  try {
    entry = registry().find(handle);
  } catch (...) {
    return VEST_INTERNAL;
  }
  if (!entry)
    return guarded(nullptr, [&] {
      fail(VEST_BAD_HANDLE, "handle " + std::to_string(handle) + " is closed or was never opened");
    });
  const std::unique_lock lock(entry->in_use, std::try_to_lock);
  return guarded(entry.get(), [&] {
    if (!lock.owns_lock()) fail(VEST_BUSY, "another thread is using this handle");
    work(*entry);
  });
}

template <class T>
T& as(Entry& entry, const char* kind) {
  T* const found = std::get_if<T>(&entry.what);
  if (!found) fail(VEST_BAD_HANDLE, std::string("this handle is no ") + kind);
  return *found;
}
template <class T, class Work>
int on(vest_handle handle, const char* kind, Work work) noexcept {
  return onHandle(handle, [&](Entry& entry) { work(as<T>(entry, kind)); });
}
template <class Work>
int onEnvironment(vest_handle handle, Work work) noexcept {
  return on<std::unique_ptr<Environment>>(handle, "environment", [&](auto& e) { work(*e); });
}
template <class Work>
int onVector(vest_handle handle, Work work) noexcept {
  return on<std::unique_ptr<Environments>>(handle, "vector of environments", [&](auto& e) { work(*e); });
}
/// On the World of a world or an environment.
template <class Work>
int onWorld(vest_handle handle, Work work) noexcept {
  return onHandle(handle, [&](Entry& entry) {
    if (auto* e = std::get_if<std::unique_ptr<Environment>>(&entry.what)) return work((*e)->world());
    work(as<std::unique_ptr<Tissue>>(entry, "world and no environment")->world);
  });
}
template <class Work>
int onObject(vest_handle handle, std::size_t object, Work work) noexcept {
  return onWorld(handle, [&](World& world) {
    if (object >= world.objectCount())
      badArgument("object: " + std::to_string(object) + " (allowed: 0 to " +
                  std::to_string(world.objectCount() - 1) + ")");
    work(world);
  });
}

template <class T>
vest_handle open(T what) {
  auto entry = std::make_shared<Entry>();
  entry->what = std::move(what);
  return registry().add(std::move(entry));
}

void fill(const vest::learning::StepResult& from, vest_result& to) {
  to.reward = from.reward, to.score = from.score;
  to.terminated = from.terminated, to.truncated = from.truncated, to.passed = from.passed;
}

}  // namespace

extern "C" {

const char* vest_error(vest_handle handle) {
  try {
    told_error = thread_error;
    if (handle == 0) return told_error.c_str();
    if (const auto entry = registry().find(handle)) {
      const std::lock_guard lock(entry->error_mutex);
      told_error = entry->error;
    }
    return told_error.c_str();
  } catch (...) {
    return "out of memory";
  }
}

const char* vest_version(void) {
  return VEST_VERSION;
}

int vest_close(vest_handle handle) {
  std::shared_ptr<Entry> entry;
  return guarded(nullptr, [&] {
    entry = registry().remove(handle);
    if (!entry) fail(VEST_BAD_HANDLE, "handle " + std::to_string(handle) + " is closed or was never opened");
  });
}

int vest_world_new(const vest_world_options* options, vest_handle* world) {
  return guarded(nullptr, [&] {
    need(world, "world");
    *world = 0;
    needStruct(options, "options");
    need(options->scene, "options: scene");
    auto description = vest::scene::loadScene(options->scene);
    const int parts = std::max(1, static_cast<int>(std::ceil(description.dt / 0.01 * (1.0 - 1e-12))));
    description.dt /= parts;
    *world = open(std::make_unique<Tissue>(description, parts, threads(options->threads)));
  });
}

int vest_world_step(vest_handle handle, uint64_t steps) {
  return on<std::unique_ptr<Tissue>>(handle, "world", [&](auto& tissue) {
    World& w = tissue->world;
    tissue->input = {};
    tissue->input.dt = w.description().dt;
    for (std::uint64_t k = 0; k < steps * static_cast<std::uint64_t>(tissue->parts); ++k) {
      tissue->input.step = w.steps() + 1;
      tissue->step();
    }
  });
}

int vest_world_step_input(vest_handle handle, const vest_input* input) {
  return on<std::unique_ptr<Tissue>>(handle, "world", [&](auto& tissue) {
    needStruct(input, "input");
    vest::learning::read(*input, tissue->world, tissue->input);
    tissue->step();
  });
}

int vest_model_load(const vest_model_options* options, vest_handle* model) {
  return guarded(nullptr, [&] {
    need(model, "model");
    *model = 0;
    needStruct(options, "options");
    need(options->task, "options: task"), need(options->scene, "options: scene"),
        need(options->box, "options: box");
    vest::learning::TaskOptions o;
    o.task = options->task, o.scene = options->scene, o.box = options->box;
    o.vessels = options->vessels ? options->vessels : "";
    o.skip = options->skip == 0 ? 20 : options->skip;
    o.limit = options->limit_s;
    *model = open(vest::learning::makeTask(o));
  });
}

const char* vest_task_scene(const char* task) {
  if (task && vest::exercise::isExerciseFile(task)) {
    try {
      told_scene = vest::exercise::loadExercise(task).scene;
      return told_scene.c_str();
    } catch (...) {
      return "";
    }
  }
  for (const auto& row : vest::learning::tasks())
    if (task && std::strcmp(task, row.name) == 0) return row.scene;
  return "";
}

const char* vest_task_name(size_t index) {
  const auto& all = vest::learning::tasks();
  return index < all.size() ? all[index].name : nullptr;
}

int vest_model_action_size(vest_handle model, size_t* numbers) {
  return on<Model>(model, "model", [&](const Model& task) {
    need(numbers, "numbers");
    *numbers = task->actionSize();
  });
}

int vest_model_observation_size(vest_handle model, size_t* numbers) {
  return on<Model>(model, "model", [&](const Model& task) {
    need(numbers, "numbers");
    *numbers = task->observationSize();
  });
}

int vest_model_observation_name(vest_handle model, size_t index, char* text, size_t capacity) {
  return on<Model>(model, "model", [&](const Model& task) {
    if (index >= task->names.size())
      badArgument("index: " + std::to_string(index) + " (allowed: 0 to " +
                  std::to_string(task->names.size() - 1) + ")");
    copyText(task->names[index], text, capacity);
  });
}

size_t vest_action_size(void) {
  return kActionSize;
}
size_t vest_observation_size(void) {
  return kObservationSize;
}

int vest_env_new(vest_handle model, int32_t threads_wanted, vest_handle* env) {
  if (env) *env = 0;
  return on<Model>(model, "model", [&](const Model& task) {
    need(env, "env");
    *env = open(vest::learning::makeEnvironment(task, threads(threads_wanted)));
  });
}

int vest_reset(vest_handle env, uint64_t seed, float* observation, size_t count) {
  return onEnvironment(env, [&](Environment& e) {
    need(observation, "observation"), needSize(count, e.task().observationSize(), "observation");
    e.reset(seed, observation);
  });
}

int vest_step(vest_handle env, const float* action, size_t action_count, float* observation, size_t count,
              vest_result* result) {
  return onEnvironment(env, [&](Environment& e) {
    need(action, "action"), needSize(action_count, e.task().actionSize(), "action");
    need(observation, "observation"), needSize(count, e.task().observationSize(), "observation");
    needStruct(result, "result");
    fill(e.step(action, observation), *result);
  });
}

int vest_expert(vest_handle env, float* action, size_t action_count) {
  return onEnvironment(env, [&](Environment& e) {
    need(action, "action"), needSize(action_count, e.task().actionSize(), "action");
    e.expert(action);
  });
}

int vest_tip(vest_handle env, double* pose, size_t count) {
  return onEnvironment(env, [&](Environment& e) {
    need(pose, "pose"), needSize(count, 8, "pose");
    const vest::scene::ToolInput tool = e.tool();
    const Eigen::Quaterniond& q = tool.orientation;
    const double all[8] = {
        tool.position.x(), tool.position.y(), tool.position.z(), q.x(), q.y(), q.z(), q.w(), tool.jaw};
    std::copy(all, all + 8, pose);
  });
}

int vest_observe(vest_handle env, float* observation, size_t count) {
  return onEnvironment(env, [&](Environment& e) {
    need(observation, "observation"), needSize(count, e.task().observationSize(), "observation");
    e.observe(observation);
  });
}

int vest_exercise_result(vest_handle env, char* json, size_t* size) {
  return onEnvironment(env, [&](Environment& e) {
    need(size, "size");
    const std::string text = e.result();
    if (text.empty()) fail(VEST_REFUSED, "this environment is no exercise");
    const std::size_t room = std::exchange(*size, text.size() + 1);
    if (!json) return;
    if (room < text.size() + 1)
      badArgument("size: room for " + std::to_string(room) +
                  " bytes (needed: " + std::to_string(text.size() + 1) + ")");
    copyText(text, json, room);
  });
}

int vest_picture(vest_handle env, int32_t width, int32_t height, uint8_t* rgb, size_t rgb_count, float* depth,
                 size_t depth_count) {
  return onEnvironment(env, [&](Environment& e) {
    needPicture(1, width, height, rgb, rgb_count, depth, depth_count);
    e.picture(width, height, rgb, depth);
  });
}

int vest_vec_new(vest_handle model, size_t environments, int32_t threads_wanted, vest_handle* vec) {
  if (vec) *vec = 0;
  return on<Model>(model, "model", [&](const Model& task) {
    need(vec, "vec");
    *vec = open(std::make_unique<Environments>(task, environments, threads(threads_wanted)));
  });
}

int vest_vec_reset(vest_handle vec, const uint64_t* seeds, size_t environments, float* observations,
                   size_t count) {
  return onVector(vec, [&](Environments& v) {
    need(seeds, "seeds"), needSize(environments, v.count(), "seeds");
    need(observations, "observations"),
        needSize(count, v.count() * v.at(0).task().observationSize(), "observations");
    v.reset(seeds, observations);
  });
}

int vest_vec_step(vest_handle vec, const float* actions, size_t action_count, float* observations,
                  size_t count, vest_result* results, size_t environments) {
  return onVector(vec, [&](Environments& v) {
    need(actions, "actions"), needSize(action_count, v.count() * v.at(0).task().actionSize(), "actions");
    need(observations, "observations"),
        needSize(count, v.count() * v.at(0).task().observationSize(), "observations");
    needStruct(results, "results"), needSize(environments, v.count(), "results");
    std::vector<vest::learning::StepResult> found(v.count());
    v.step(actions, observations, found.data());
    for (std::size_t i = 0; i < found.size(); ++i) fill(found[i], results[i]);
  });
}

int vest_vec_picture(vest_handle vec, int32_t width, int32_t height, uint8_t* rgb, size_t rgb_count,
                     float* depth, size_t depth_count) {
  return onVector(vec, [&](Environments& v) {
    needPicture(v.count(), width, height, rgb, rgb_count, depth, depth_count);
    v.pictures(width, height, rgb, depth);
  });
}

int vest_vec_expert(vest_handle vec, float* actions, size_t action_count) {
  return onVector(vec, [&](Environments& v) {
    need(actions, "actions"), needSize(action_count, v.count() * v.at(0).task().actionSize(), "actions");
    for (std::size_t i = 0; i < v.count(); ++i) v.at(i).expert(actions + i * v.at(i).task().actionSize());
  });
}

int vest_objects(vest_handle handle, size_t* objects) {
  return onWorld(handle, [&](World& w) {
    need(objects, "objects");
    *objects = w.objectCount();
  });
}

int vest_object_name(vest_handle handle, size_t object, char* text, size_t capacity) {
  return onObject(handle, object,
                  [&](World& w) { copyText(w.description().objects[object].name, text, capacity); });
}

int vest_knots(vest_handle handle, size_t object, size_t* knots) {
  return onObject(handle, object, [&](World& w) {
    need(knots, "knots");
    *knots = w.knotCount(object);
  });
}

int vest_positions(vest_handle handle, size_t object, float* xyz, size_t count) {
  return onObject(handle, object, [&](World& w) {
    need(xyz, "xyz"), needSize(count, 3 * w.knotCount(object), "xyz");
    w.positions(object, xyz);
  });
}

int vest_triangles(vest_handle handle, size_t object, uint32_t* indices, size_t* count) {
  return onObject(handle, object, [&](World& w) {
    need(count, "count");
    const auto& all = w.contactTriangles(object);
    const auto& alive = w.contactTriangleAlive(object);
    const auto living = [&](std::size_t i) { return i >= alive.size() || alive[i] != 0; };
    std::size_t there = 0;
    for (std::size_t i = 0; i < all.size(); ++i) there += living(i) ? 3 : 0;
    const std::size_t room = std::exchange(*count, there);
    if (!indices) return;
    if (room < there)
      badArgument("count: room for " + std::to_string(room) + " numbers (needed: " + std::to_string(there) +
                  ")");
    for (std::size_t i = 0; i < all.size(); ++i)
      if (living(i)) indices = std::copy(all[i].begin(), all[i].end(), indices);
  });
}

int vest_time(vest_handle handle, uint64_t* steps, double* seconds) {
  return onWorld(handle, [&](World& w) {
    need(steps, "steps"), need(seconds, "seconds");
    *steps = w.steps(), *seconds = w.time();
  });
}

int vest_hash(vest_handle handle, uint64_t* hash) {
  return onWorld(handle, [&](World& w) {
    need(hash, "hash");
    *hash = w.stateHash();
  });
}

int vest_save(vest_handle handle, uint8_t* bytes, size_t* size) {
  return onHandle(handle, [&](Entry& entry) {
    need(size, "size");
    std::vector<std::uint8_t> saved;
    if (auto* e = std::get_if<std::unique_ptr<Environment>>(&entry.what))
      (*e)->save(saved);
    else
      as<std::unique_ptr<Tissue>>(entry, "world and no environment")->world.save(saved);
    const std::size_t room = std::exchange(*size, saved.size());
    if (!bytes) return;
    if (room < saved.size())
      badArgument("size: room for " + std::to_string(room) +
                  " bytes (needed: " + std::to_string(saved.size()) + ")");
    std::copy(saved.begin(), saved.end(), bytes);
  });
}

int vest_restore(vest_handle handle, const uint8_t* bytes, size_t size) {
  return onHandle(handle, [&](Entry& entry) {
    need(bytes, "bytes");
    const std::vector<std::uint8_t> from(bytes, bytes + size);
    if (auto* e = std::get_if<std::unique_ptr<Environment>>(&entry.what))
      (*e)->restore(from);
    else
      as<std::unique_ptr<Tissue>>(entry, "world and no environment")->world.restore(from);
  });
}

}  // extern "C"
