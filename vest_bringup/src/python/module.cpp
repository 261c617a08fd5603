#include <algorithm>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "vest_bringup/vest.h"

// Python's side of vest.h: handles as objects, codes as exceptions, arrays of NumPy filled in place. The
// interpreter is free while VEST computes.

namespace py = pybind11;

namespace {

using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

void check(int code, vest_handle handle) {
  if (code == VEST_OK) return;
  const std::string text = vest_error(handle);
  if (code == VEST_BAD_ARGUMENT || code == VEST_REFUSED) throw py::value_error(text);
  throw std::runtime_error(text);
}

/// Runs a call without the interpreter's lock. @param handle whose error to tell
template <class Call>
void run(vest_handle handle, Call call) {
  int code;
  {
    const py::gil_scoped_release free;
    code = call();
  }
  check(code, handle);
}

struct Handle {
  vest_handle id = 0;
  Handle() = default;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close(); }
  void close() {
    if (id != 0) vest_close(id);
    id = 0;
  }
};

struct Simulated : Handle {
  std::vector<std::string> objects() const {
    std::size_t count = 0;
    check(vest_objects(id, &count), id);
    std::vector<std::string> names(count);
    for (std::size_t i = 0; i < count; ++i) {
      char text[256];
      check(vest_object_name(id, i, text, sizeof text), id);
      names[i] = text;
    }
    return names;
  }
  std::size_t index(const py::object& object) const {
    const auto names = objects();
    const auto said = py::str(py::repr(object)).cast<std::string>();
    if (!py::isinstance<py::str>(object)) {
      py::detail::make_caster<std::size_t> number;
      if (number.load(object, true)) return py::detail::cast_op<std::size_t>(number);
      throw py::value_error("object: " + said + " (allowed: a name, or 0 to " +
                            std::to_string(names.size() - 1) + ")");
    }
    const auto found = std::find(names.begin(), names.end(), object.cast<std::string>());
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
    std::string all;
    for (const auto& n : names) all += (all.empty() ? "" : ", ") + n;
    throw py::value_error("object: " + said + " is not in the scene (allowed: " + all + ")");
  }
  py::array_t<float> positions(const py::object& object) const {
    const std::size_t which = index(object);
    std::size_t knots = 0;
    check(vest_knots(id, which, &knots), id);
    py::array_t<float> xyz({knots, std::size_t{3}});
    check(vest_positions(id, which, xyz.mutable_data(), 3 * knots), id);
    return xyz;
  }
  py::array_t<std::uint32_t> triangles(const py::object& object) const {
    const std::size_t which = index(object);
    std::size_t count = 0;
    check(vest_triangles(id, which, nullptr, &count), id);
    py::array_t<std::uint32_t> indices({count / 3, std::size_t{3}});
    check(vest_triangles(id, which, indices.mutable_data(), &count), id);
    return indices;
  }
  std::uint64_t steps() const {
    std::uint64_t steps = 0;
    double seconds = 0;
    check(vest_time(id, &steps, &seconds), id);
    return steps;
  }
  double time() const {
    std::uint64_t steps = 0;
    double seconds = 0;
    check(vest_time(id, &steps, &seconds), id);
    return seconds;
  }
  std::uint64_t hash() const {
    std::uint64_t value = 0;
    check(vest_hash(id, &value), id);
    return value;
  }
  py::bytes save() const {
    std::size_t size = 0;
    check(vest_save(id, nullptr, &size), id);
    std::string bytes(size, '\0');
    check(vest_save(id, reinterpret_cast<std::uint8_t*>(bytes.data()), &size), id);
    return py::bytes(bytes);
  }
  void restore(const py::bytes& bytes) {
    char* data = nullptr;
    Py_ssize_t size = 0;
    if (PyBytes_AsStringAndSize(bytes.ptr(), &data, &size) != 0) throw py::error_already_set();
    run(id, [&] {
      return vest_restore(id, reinterpret_cast<const std::uint8_t*>(data), static_cast<std::size_t>(size));
    });
  }
};

struct World : Simulated {
  World(const std::string& scene, int threads) {
    const vest_world_options options{sizeof options, scene.c_str(), threads};
    run(0, [&] { return vest_world_new(&options, &id); });
  }
  void step(const py::object& n) {
    const auto whole = py::reinterpret_steal<py::object>(PyNumber_Index(n.ptr()));  // of NumPy, too
    const long long steps = whole && !py::isinstance<py::bool_>(n) ? PyLong_AsLongLong(whole.ptr()) : -1;
    PyErr_Clear();
    if (steps < 0) {
      throw py::value_error("n: " + py::repr(n).cast<std::string>() + " (allowed: 0 or more whole steps)");
    }
    run(id, [&] { return vest_world_step(id, static_cast<std::uint64_t>(steps)); });
  }
  void stepInput(const py::object& message);
};

/// What a message or another object with its fields holds; a field that it does not have is `otherwise`.
template <class T>
T get(const py::handle& of, const char* field, T otherwise) {
  return py::hasattr(of, field) ? of.attr(field).cast<T>() : otherwise;
}
py::list list(const py::handle& of, const char* field) {
  return py::hasattr(of, field) ? py::list(of.attr(field)) : py::list();
}
template <class T, std::size_t N>
void fill(const py::handle& of, const char* field, T (&to)[N]) {
  if (!py::hasattr(of, field)) return;
  const auto values = of.attr(field).cast<std::vector<T>>();
  if (values.size() != N)
    throw py::value_error(std::string(field) + ": " + std::to_string(values.size()) +
                          " numbers (allowed: " + std::to_string(N) + ")");
  std::copy(values.begin(), values.end(), to);
}

void World::stepInput(const py::object& m) {
  vest_input input{};
  input.struct_size = sizeof input;
  input.step = get<std::uint64_t>(m, "step", 0), input.dt = get(m, "dt", 0.0);
  input.seed = get(m, "seed", 1U), input.load_over = get(m, "load_over", 0.0);
  input.sunk = get(m, "sunk", 0.0);
  if (get(m, "command", 0) != 0)
    throw py::value_error("command: only steps are taken (allowed: 0; use save and restore)");
  const py::list tools = list(m, "tools");
  if (tools.size() > 4) throw py::value_error("tools: " + std::to_string(tools.size()) + " (allowed: 4)");
  for (vest_tool& t : input.tools) t.orientation[3] = 1, t.sight[2] = 1;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    vest_tool& t = input.tools[i];
    const py::handle from = tools[i];
    t.present = get(from, "present", false) ? 1 : 0, t.tool = get(from, "tool", 0);
    t.functions = get(from, "functions", 0U), t.jaw = get(from, "jaw", 0.0);
    fill(from, "position", t.position), fill(from, "orientation", t.orientation);
    fill(from, "pivot", t.pivot), fill(from, "sight", t.sight);
  }
  std::vector<std::string> texts;  // reserved: pointers into it stay
  const py::list edits = list(m, "edits"), dilatations = list(m, "dilatations"),
                 requests = list(m, "requests");
  texts.reserve(2 * edits.size() + dilatations.size() + requests.size());
  const auto kept = [&texts](const py::handle& text) {
    return texts.emplace_back(text.cast<std::string>()).c_str();
  };
  std::vector<vest_edit> all_edits;
  for (const auto e : edits)
    all_edits.push_back({kept(e.attr("object")), kept(e.attr("parameter")), e.attr("value").cast<double>()});
  std::vector<vest_dilatation> all_dilatations;
  for (const auto d : dilatations) {
    vest_dilatation to{kept(d.attr("vessel_segment")), {}};
    fill(d, "dilatation", to.dilatation);
    all_dilatations.push_back(to);
  }
  std::vector<const char*> all_requests;
  for (const auto r : requests) all_requests.push_back(kept(r));
  std::vector<vest_impact> impacts;
  for (const auto i : list(m, "impacts")) {
    vest_impact to{};
    to.object = static_cast<std::uint32_t>(index(i.attr("object"))),
    to.triangle = i.attr("element").cast<std::uint32_t>();
    fill(i, "barycentric", to.weights);
    const py::object momentum = i.attr("momentum");
    const char* const axes[] = {"x", "y", "z"};
    for (int k = 0; k < 3; ++k) to.momentum[k] = momentum.attr(axes[k]).cast<double>();
    impacts.push_back(to);
  }
  std::vector<vest_load> loads;
  for (const auto l : list(m, "loads")) {
    const auto object = static_cast<std::uint32_t>(index(l.attr("object")));
    const auto knots = l.attr("knots").cast<std::vector<std::uint32_t>>();
    const auto floats = [&l](const char* field) { return l.attr(field).cast<std::vector<float>>(); };
    const auto forces = floats("forces"), damping = floats("damping"), stiffness = floats("stiffness"),
               depth = floats("depth");
    if (forces.size() != 3 * knots.size() || damping.size() != knots.size() ||
        stiffness.size() != knots.size() || depth.size() != knots.size())
      throw py::value_error("loads: the lists have other lengths than knots (forces: three times)");
    for (std::size_t k = 0; k < knots.size(); ++k)
      loads.push_back({object,
                       knots[k],
                       {forces[3 * k], forces[3 * k + 1], forces[3 * k + 2]},
                       damping[k],
                       stiffness[k],
                       depth[k]});
  }
  input.edits = all_edits.data(), input.edit_count = all_edits.size();
  input.impacts = impacts.data(), input.impact_count = impacts.size();
  input.loads = loads.data(), input.load_count = loads.size();
  input.dilatations = all_dilatations.data(), input.dilatation_count = all_dilatations.size();
  input.requests = all_requests.data(), input.request_count = all_requests.size();
  run(id, [&] { return vest_world_step_input(id, &input); });
}

struct Model : Handle {
  Model(const std::string& task, const std::string& scene, const std::string& box, const std::string& vessels,
        int skip, double limit) {
    const vest_model_options options{
        sizeof options, task.c_str(), scene.c_str(), box.c_str(), vessels.empty() ? nullptr : vessels.c_str(),
        skip,           limit};
    run(0, [&] { return vest_model_load(&options, &id); });
  }
  std::size_t actionSize() const {
    std::size_t numbers = 0;
    check(vest_model_action_size(id, &numbers), id);
    return numbers;
  }
  std::size_t observationSize() const {
    std::size_t numbers = 0;
    check(vest_model_observation_size(id, &numbers), id);
    return numbers;
  }
  std::vector<std::string> observationNames() const {
    std::vector<std::string> names(observationSize());
    for (std::size_t i = 0; i < names.size(); ++i) {
      char text[256];
      check(vest_model_observation_name(id, i, text, sizeof text), id);
      names[i] = text;
    }
    return names;
  }
};

struct Environment : Simulated {
  Environment(const Model& model, int threads)
      : action_size(model.actionSize()), observation_size(model.observationSize()) {
    run(model.id, [&] { return vest_env_new(model.id, threads, &id); });
  }
  py::array_t<float> reset(std::uint64_t seed) {
    py::array_t<float> seen(static_cast<py::ssize_t>(observation_size));
    float* const to = seen.mutable_data();
    run(id, [&] { return vest_reset(id, seed, to, observation_size); });
    return seen;
  }
  py::tuple step(const Floats& action) {
    py::array_t<float> seen(static_cast<py::ssize_t>(observation_size));
    float* const to = seen.mutable_data();
    vest_result result{};
    result.struct_size = sizeof result;
    run(id, [&] {
      return vest_step(id, action.data(), static_cast<std::size_t>(action.size()), to, observation_size,
                       &result);
    });
    return py::make_tuple(seen, result.reward, result.terminated != 0, result.truncated != 0, result.score,
                          result.passed != 0);
  }
  py::tuple picture(int width, int height) {
    py::array_t<std::uint8_t> rgb({std::max(height, 0), std::max(width, 0), 3});
    py::array_t<float> depth({std::max(height, 0), std::max(width, 0)});
    run(id, [to = rgb.mutable_data(), far = depth.mutable_data(), n = static_cast<std::size_t>(depth.size()),
             width, height, this] { return vest_picture(id, width, height, to, 3 * n, far, n); });
    return py::make_tuple(rgb, depth);
  }
  py::array_t<float> expert() const {
    py::array_t<float> action(static_cast<py::ssize_t>(action_size));
    check(vest_expert(id, action.mutable_data(), action_size), id);
    return action;
  }
  py::array_t<float> observe() const {
    py::array_t<float> seen(static_cast<py::ssize_t>(observation_size));
    check(vest_observe(id, seen.mutable_data(), observation_size), id);
    return seen;
  }
  std::string result() const {
    std::size_t size = 0;
    check(vest_exercise_result(id, nullptr, &size), id);
    std::string json(size, '\0');
    check(vest_exercise_result(id, json.data(), &size), id);
    json.resize(size - 1);
    return json;
  }
  std::size_t action_size, observation_size;
};

struct Environments : Handle {
  Environments(const Model& model, std::size_t n, int threads)
      : count(n), action_size(model.actionSize()), observation_size(model.observationSize()) {
    run(model.id, [&] { return vest_vec_new(model.id, n, threads, &id); });
  }
  py::array_t<float> reset(
      const py::array_t<std::uint64_t, py::array::c_style | py::array::forcecast>& seeds) {
    py::array_t<float> seen({count, observation_size});
    float* const to = seen.mutable_data();
    run(id, [&] {
      return vest_vec_reset(id, seeds.data(), static_cast<std::size_t>(seeds.size()), to,
                            count * observation_size);
    });
    return seen;
  }
  py::tuple step(const Floats& actions) {
    py::array_t<float> seen({count, observation_size});
    float* const to = seen.mutable_data();
    std::vector<vest_result> results(count);
    for (vest_result& r : results) r.struct_size = sizeof r;
    run(id, [&] {
      return vest_vec_step(id, actions.data(), static_cast<std::size_t>(actions.size()), to,
                           count * observation_size, results.data(), count);
    });
    const auto n = static_cast<py::ssize_t>(count);
    py::array_t<double> reward(n), score(n);
    py::array_t<bool> terminated(n), truncated(n), passed(n);
    for (py::ssize_t i = 0; i < n; ++i) {
      const vest_result& r = results[static_cast<std::size_t>(i)];
      reward.mutable_at(i) = r.reward, score.mutable_at(i) = r.score;
      terminated.mutable_at(i) = r.terminated != 0, truncated.mutable_at(i) = r.truncated != 0;
      passed.mutable_at(i) = r.passed != 0;
    }
    return py::make_tuple(seen, reward, terminated, truncated, score, passed);
  }
  py::tuple pictures(int width, int height) {
    const auto n = static_cast<int>(count);
    py::array_t<std::uint8_t> rgb({n, std::max(height, 0), std::max(width, 0), 3});
    py::array_t<float> depth({n, std::max(height, 0), std::max(width, 0)});
    run(id,
        [to = rgb.mutable_data(), far = depth.mutable_data(), all = static_cast<std::size_t>(depth.size()),
         width, height, this] { return vest_vec_picture(id, width, height, to, 3 * all, far, all); });
    return py::make_tuple(rgb, depth);
  }
  py::array_t<float> expert() const {
    py::array_t<float> actions({count, action_size});
    check(vest_vec_expert(id, actions.mutable_data(), count * action_size), id);
    return actions;
  }
  std::size_t count, action_size, observation_size;
};

std::vector<std::string> taskNames() {
  std::vector<std::string> names;
  while (const char* name = vest_task_name(names.size())) names.emplace_back(name);
  return names;
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.attr("__version__") = vest_version();
  m.def("task_names", &taskNames);
  m.def("task_scene", [](const std::string& task) { return std::string(vest_task_scene(task.c_str())); });
  m.attr("action_size") = vest_action_size();
  m.attr("observation_size") = vest_observation_size();
  py::class_<Simulated>(m, "Simulated")
      .def_property_readonly("objects", &Simulated::objects, "Names of the objects, scene order.")
      .def("positions", &Simulated::positions, py::arg("object"),
           "Knots of an object (name or index): float32, knots x 3, m, world. A copy.")
      .def("triangles", &Simulated::triangles, py::arg("object"),
           "Living triangles of an object's touched surface: uint32, n x 3, rows of positions().")
      .def_property_readonly("steps", &Simulated::steps, "Simulated steps since loading or reset.")
      .def_property_readonly("time", &Simulated::time, "Simulated time, s.")
      .def("hash", &Simulated::hash, "XXH64 of the tissue's State, as sessions record it: int.")
      .def("save", &Simulated::save, "Everything that evolves, as bytes.")
      .def("restore", &Simulated::restore, py::arg("bytes"),
           "Takes what save() gave. All or nothing: ValueError.")
      .def("close", &Simulated::close, "Frees it now; later calls raise RuntimeError.");
  py::class_<World, Simulated>(m, "World", "The tissue of a scene, without instruments, blood and ROS.")
      .def(py::init([](const py::object& scene, int threads) {
             const py::object path = py::module::import("os").attr("fspath")(scene);
             return std::make_unique<World>(path.cast<std::string>(), threads);
           }),
           py::arg("scene_path"), py::arg("threads") = 1,
           "Loads a scene file; threads: 1 to 64. ValueError: it is refused, with file and line.")
      .def("step", &World::step, py::arg("n") = 1, "n steps of the scene's dt, without instruments.")
      .def("step_input", &World::stepInput, py::arg("input"),
           "One step with what it consumes: a vest_msgs/StepInput, or any object with some of its fields. "
           "Recorded inputs give the recorded hash(). ValueError: a field is out of range, nothing moved.");
  py::class_<Model>(m, "Model")
      .def(py::init<const std::string&, const std::string&, const std::string&, const std::string&, int,
                    double>())
      .def_property_readonly("action_size", &Model::actionSize, "Numbers of an action.")
      .def_property_readonly("observation_size", &Model::observationSize, "Numbers of an observation.")
      .def_property_readonly("observation_names", &Model::observationNames, "What they are, with units.")
      .def("close", &Model::close);
  py::class_<Environment, Simulated>(m, "Environment")
      .def(py::init<const Model&, int>())
      .def("reset", &Environment::reset)
      .def("step", &Environment::step)
      .def("observe", &Environment::observe)
      .def("result", &Environment::result)
      .def("picture", &Environment::picture)
      .def("expert", &Environment::expert);
  py::class_<Environments>(m, "Environments")
      .def(py::init<const Model&, std::size_t, int>())
      .def("reset", &Environments::reset)
      .def("step", &Environments::step)
      .def("pictures", &Environments::pictures)
      .def("expert", &Environments::expert)
      .def("close", &Environments::close);
}
