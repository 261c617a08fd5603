#include "vest_tissue/ros/conversions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "vest_instruments/ros/frames.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/net/skin.h"
#include "vest_tissue/ros/drawn_scene.h"
#include "vest_tissue/scene/event_words.h"
#include "vest_tissue/scene/request.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::ros_shell {
namespace {

/// SutureThread::id of threads that tissue hangs on: beyond those of any suture.
constexpr std::uint32_t kSuspensionThreads = 0xffff0000u;

using scene::Description;

geometry_msgs::Pose poseMsg(const Eigen::Isometry3d& X) {
  geometry_msgs::Pose p;
  const Eigen::Quaterniond q(X.linear());
  p.position.x = X.translation().x();
  p.position.y = X.translation().y();
  p.position.z = X.translation().z();
  p.orientation.x = q.x();
  p.orientation.y = q.y();
  p.orientation.z = q.z();
  p.orientation.w = q.w();
  return p;
}

geometry_msgs::Vector3 vectorMsg(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 m;
  m.x = v.x();
  m.y = v.y();
  m.z = v.z();
  return m;
}

std::string instrumentWord(std::int8_t instrument) {
  if (instrument < 0 || instrument >= tools::kInstrumentCount) return "";
  return std::string(tools::instrumentName(static_cast<tools::Instrument>(instrument)));
}

std::string objectWord(std::size_t object, const Description& description) {
  const std::size_t objects = description.objects.size();
  if (object < objects) return description.objects[object].name;
  // Events count sutures behind the objects.
  return object - objects < description.sutures.size() ? description.sutures[object - objects].rod.name : "";
}

bool finite(const geometry_msgs::Pose& p) {
  return std::isfinite(p.position.x) && std::isfinite(p.position.y) && std::isfinite(p.position.z) &&
         std::isfinite(p.orientation.x) && std::isfinite(p.orientation.y) && std::isfinite(p.orientation.z) &&
         std::isfinite(p.orientation.w);
}

void skinToMsg(const scene::Skin& skin, std::vector<std::uint32_t>& start, std::vector<std::uint32_t>& knots,
               std::vector<float>& weights) {
  start = skin.binding_start;
  knots = skin.binding_knots;
  weights = skin.binding_weights;
}

template <class Triangles>
std::vector<std::uint32_t> flat(const Triangles& triangles) {
  std::vector<std::uint32_t> out;
  out.reserve(3 * triangles.size());
  for (const auto& t : triangles) out.insert(out.end(), {t[0], t[1], t[2]});
  return out;
}

std_msgs::ColorRGBA colour(const std::string& organ) {
  const auto rgb = [](float r, float g, float b) {
    std_msgs::ColorRGBA c;
    c.r = r, c.g = g, c.b = b, c.a = 1.0F;
    return c;
  };
  if (organ == "artery") return rgb(0.75F, 0.15F, 0.12F);
  if (organ == "vein") return rgb(0.35F, 0.20F, 0.40F);
  if (organ == "ovary") return rgb(0.90F, 0.85F, 0.78F);
  if (organ == "ligament" || organ == "cavity") return rgb(0.80F, 0.50F, 0.42F);
  return rgb(0.82F, 0.45F, 0.42F);
}

}  // namespace

void toMsg(const scene::StepFrame& frame, const Description& description, vest_msgs::StepInput& msg) {
  const scene::StepInput& in = frame.input;
  msg.header.frame_id = frameId("world");
  msg.step = in.step;
  msg.dt = in.dt;
  msg.seed = in.seed;
  msg.command = static_cast<std::uint8_t>(frame.command);
  msg.command_argument = frame.command_argument;
  for (std::size_t i = 0; i < in.tools.size(); ++i) {
    const scene::ToolInput& t = in.tools[i];
    vest_msgs::ToolInput& m = msg.tools[i];
    m.present = t.present;
    m.tool = static_cast<std::uint8_t>(t.tool);
    m.functions = t.functions;
    for (std::size_t k = 0; k < 3; ++k) m.position[k] = t.position[static_cast<Eigen::Index>(k)];
    m.orientation = {t.orientation.x(), t.orientation.y(), t.orientation.z(), t.orientation.w()};
    for (std::size_t k = 0; k < 3; ++k) m.pivot[k] = t.pivot[static_cast<Eigen::Index>(k)];
    m.jaw = t.jaw;
    m.sight = {t.sight.x(), t.sight.y(), t.sight.z()};
  }
  msg.edits.resize(in.edits.size());
  for (std::size_t i = 0; i < in.edits.size(); ++i) {
    msg.edits[i].object = in.edits[i].object;
    msg.edits[i].parameter = in.edits[i].parameter;
    msg.edits[i].value = in.edits[i].value;
  }
  msg.impacts.resize(in.impacts.size());
  for (std::size_t i = 0; i < in.impacts.size(); ++i) {
    msg.impacts[i].object = objectWord(in.impacts[i].object, description);
    msg.impacts[i].element = in.impacts[i].triangle;
    std::copy(in.impacts[i].weights.begin(), in.impacts[i].weights.end(), msg.impacts[i].barycentric.begin());
    msg.impacts[i].momentum = vectorMsg(in.impacts[i].momentum);
  }
  msg.loads.clear();
  for (std::size_t i = 0; i < in.loads.size(); ++i) {
    const scene::KnotLoad& l = in.loads[i];
    if (i == 0 || l.object != in.loads[i - 1].object) {
      msg.loads.emplace_back();
      msg.loads.back().object = objectWord(l.object, description);
    }
    msg.loads.back().knots.push_back(l.knot);
    msg.loads.back().forces.insert(msg.loads.back().forces.end(), l.force.begin(), l.force.end());
    msg.loads.back().damping.push_back(l.damping);
    msg.loads.back().stiffness.push_back(l.stiffness);
    msg.loads.back().depth.push_back(l.depth);
  }
  msg.load_over = in.load_over;
  msg.sunk = in.sunk;
  msg.dilatations.resize(in.dilatations.size());
  for (std::size_t i = 0; i < in.dilatations.size(); ++i) {
    msg.dilatations[i].vessel_segment.assign(in.dilatations[i].vessel_segment.view());
    std::copy_n(in.dilatations[i].dilatation.begin(), scene::DilatationInput::kPlaces,
                msg.dilatations[i].dilatation.begin());
  }
  msg.requests.clear();
  for (const auto& r : in.requests) msg.requests.push_back(scene::requestText(r, description));
}

void fromMsg(const vest_msgs::StepInput& msg, const Description& description, scene::StepInput& in) {
  in.step = msg.step;
  in.dt = msg.dt;
  in.seed = msg.seed;
  for (std::size_t i = 0; i < in.tools.size(); ++i) {
    const vest_msgs::ToolInput& m = msg.tools[i];
    scene::ToolInput& t = in.tools[i];
    if (m.tool >= tools::kToolKindCount) {
      throw std::invalid_argument("step " + std::to_string(msg.step) + ": tools[" + std::to_string(i) +
                                  "].tool is " + std::to_string(m.tool) + " (allowed: 0 to 10)");
    }
    t.present = m.present;
    t.tool = static_cast<tools::ToolKind>(m.tool);
    t.functions = m.functions;
    t.position = {m.position[0], m.position[1], m.position[2]};
    t.orientation =
        Eigen::Quaterniond(m.orientation[3], m.orientation[0], m.orientation[1], m.orientation[2]);
    t.pivot = {m.pivot[0], m.pivot[1], m.pivot[2]};
    t.jaw = m.jaw;
    t.sight = {m.sight[0], m.sight[1], m.sight[2]};
  }
  in.edits.clear();
  for (const auto& e : msg.edits) in.edits.push_back({e.object, e.parameter, e.value});
  in.impacts.clear();
  const auto indexOf = [&](const char* field, const std::string& name) {
    const auto object = std::find_if(description.objects.begin(), description.objects.end(),
                                     [&](const scene::Object& o) { return o.name == name; });
    if (object == description.objects.end()) {
      throw std::invalid_argument("step " + std::to_string(msg.step) + ": " + field + " name the object '" +
                                  name + "', which the scene does not have");
    }
    return static_cast<std::uint16_t>(object - description.objects.begin());
  };
  for (const auto& m : msg.impacts) {
    scene::ImpactInput impact;
    impact.object = indexOf("impacts", m.object);
    impact.triangle = m.element;
    std::copy(m.barycentric.begin(), m.barycentric.end(), impact.weights.begin());
    impact.momentum = {m.momentum.x, m.momentum.y, m.momentum.z};
    in.impacts.push_back(impact);
  }
  in.loads.clear();
  for (const auto& m : msg.loads) {
    const std::uint16_t object = indexOf("loads", m.object);
    const std::size_t knots = m.knots.size();
    if (m.forces.size() != 3 * knots || m.damping.size() != knots || m.stiffness.size() != knots ||
        m.depth.size() != knots) {
      throw std::invalid_argument(
          "step " + std::to_string(msg.step) + ": loads of " + m.object + " have " +
          std::to_string(m.forces.size()) + " forces, " + std::to_string(m.damping.size()) + " dampings, " +
          std::to_string(m.stiffness.size()) + " stiffnesses and " + std::to_string(m.depth.size()) +
          " depths (allowed: three forces, and one of the others, for each of " + std::to_string(knots) +
          " knots)");
    }
    for (std::size_t i = 0; i < knots; ++i)
      in.loads.push_back({object,
                          m.knots[i],
                          {m.forces[3 * i], m.forces[3 * i + 1], m.forces[3 * i + 2]},
                          m.damping[i],
                          m.stiffness[i],
                          m.depth[i]});
  }
  in.load_over = msg.load_over;
  in.sunk = msg.sunk;
  in.dilatations.clear();
  for (const auto& d : msg.dilatations) {
    scene::DilatationInput& to = in.dilatations.emplace_back();
    to.vessel_segment = scene::VesselName(d.vessel_segment);
    std::copy_n(d.dilatation.begin(), scene::DilatationInput::kPlaces, to.dilatation.begin());
  }
  in.requests.clear();
  for (const auto& text : msg.requests) in.requests.push_back(scene::parseRequest(text, description));
}

bool fromMsg(const vest_msgs::InstrumentStates& msg, scene::ToolSample& sample) {
  bool good = true;
  for (scene::ToolInput& t : sample.tools) t.functions = 0;  // of what is not told well, nothing is on
  for (const vest_msgs::InstrumentState& s : msg.instruments) {
    std::size_t i = 0;
    while (i < tools::kInstrumentCount && tools::instrumentName(static_cast<tools::Instrument>(i)) != s.name)
      ++i;
    const double norm = s.tip.orientation.x * s.tip.orientation.x +
                        s.tip.orientation.y * s.tip.orientation.y +
                        s.tip.orientation.z * s.tip.orientation.z + s.tip.orientation.w * s.tip.orientation.w;
    if (i == tools::kInstrumentCount || s.tool >= tools::kToolKindCount || !finite(s.tip) ||
        !finite(s.shaft) || !std::isfinite(s.joint_position[4]) || !std::isfinite(s.sight[0]) ||
        !std::isfinite(s.sight[1]) || !std::isfinite(s.sight[2]) || std::abs(norm - 1.0) > 1e-3) {
      good = false;
      continue;
    }
    scene::ToolInput& t = sample.tools[i];
    if (!s.valid && !t.present) continue;
    t.present = s.tool != vest_msgs::InstrumentState::TOOL_NONE;
    t.tool = static_cast<tools::ToolKind>(s.tool);
    t.functions = s.valid ? s.functions : 0;
    t.position = {s.tip.position.x, s.tip.position.y, s.tip.position.z};
    t.orientation = Eigen::Quaterniond(s.tip.orientation.w, s.tip.orientation.x, s.tip.orientation.y,
                                       s.tip.orientation.z);
    t.pivot = {s.shaft.position.x, s.shaft.position.y, s.shaft.position.z};
    t.jaw = t.tool == tools::ToolKind::Endoscope ? 0.0 : s.joint_position[4];
    t.sight = {s.sight[0], s.sight[1], s.sight[2]};
  }
  return good;
}

void toMsg(const scene::ContactFrame& frame, double age, vest_msgs::ContactModels& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = frame.step;
  msg.contacts.resize(frame.contacts.size());
  for (std::size_t i = 0; i < frame.contacts.size(); ++i) {
    const scene::ContactModel& c = frame.contacts[i];
    vest_msgs::ContactModel& m = msg.contacts[i];
    m.instrument = instrumentWord(static_cast<std::int8_t>(i));
    m.in_contact = c.in_contact;
    m.grasping = c.grasping;
    m.step = c.step;
    m.age = age;
    m.proxy = poseMsg(c.proxy);
    m.velocity.linear = vectorMsg(c.velocity.head<3>());
    m.velocity.angular = vectorMsg(c.velocity.tail<3>());
    m.wrench.force = vectorMsg(c.wrench.head<3>());
    m.wrench.torque = vectorMsg(c.wrench.tail<3>());
    for (std::size_t k = 0; k < 36; ++k) {
      const auto row = static_cast<Eigen::Index>(k / 6), column = static_cast<Eigen::Index>(k % 6);
      m.stiffness[k] = c.stiffness(row, column);
      m.damping[k] = c.damping(row, column);
    }
    m.planes.resize(static_cast<std::size_t>(c.plane_count));
    for (std::size_t k = 0; k < m.planes.size(); ++k) {
      m.planes[k].normal = vectorMsg(c.planes[k].normal);
      m.planes[k].offset = c.planes[k].offset;
    }
    m.radius = c.radius;
    m.pinch_force = c.pinch_force;
    m.jaw_torque = c.jaw_torque;
  }
}

void toMsg(const scene::Event& e, const Description& description, vest_msgs::TissueEvent& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = e.step;
  msg.kind = static_cast<std::uint8_t>(e.kind);
  msg.instrument = instrumentWord(e.instrument);
  msg.object = objectWord(e.object, description);
  msg.element = e.element;
  std::copy(e.barycentric.begin(), e.barycentric.end(), msg.barycentric.begin());
  msg.position.x = e.position.x();
  msg.position.y = e.position.y();
  msg.position.z = e.position.z();
  msg.station = e.station;
  msg.area = e.area;
  msg.force = e.force;
  msg.energy = e.energy;
  if (e.object < description.objects.size())
    msg.vessel_segment = description.objects[e.object].tube.vessel_segment;
  msg.text = msg.object +
             (msg.kind < scene::kEventWords.size() ? " " + std::string(scene::kEventWords[msg.kind]) : "") +
             (msg.instrument.empty() ? "" : " by " + msg.instrument);
}

void toMsg(const scene::World& world, vest_msgs::TissueTopology& msg) {
  const Description& description = world.description();
  msg.header.frame_id = frameId("world");
  msg.revision = world.revision();
  msg.step = world.steps();
  msg.scene = description.name;
  msg.scene_hash = description.hash;
  msg.objects.clear();
  msg.objects.resize(world.objectCount());
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const scene::Object& o = description.objects[i];
    const scene::Topology& t = world.topology(i);
    vest_msgs::TissueObject& m = msg.objects[i];
    m.name = o.name;
    m.id = static_cast<std::uint16_t>(i);
    m.segmentation_label = static_cast<std::uint16_t>(i + 1);
    m.organ = o.organ;
    m.material = o.material;
    m.roles = o.roles;
    m.model = static_cast<std::uint8_t>(o.model);
    m.revision = t.revision;
    m.knot_count = static_cast<std::uint32_t>(world.knotCount(i));
    for (const Eigen::Vector3d& p : o.rest_position) {
      for (int k = 0; k < 3; ++k) m.rest_position.push_back(static_cast<float>(p[k]));
    }
    m.knot_fixed = o.fixed;
    for (const std::uint32_t k : t.doubled_knots) {  // copies rest where their knot does
      for (std::size_t e = 0; e < 3; ++e) m.rest_position.push_back(float(m.rest_position[3 * k + e]));
      if (!m.knot_fixed.empty()) m.knot_fixed.push_back(std::uint8_t(m.knot_fixed[k]));
    }
    for (const scene::Link& l : t.links) {
      m.link_knots.insert(m.link_knots.end(),
                          {l.knot0, l.kind == scene::LinkKind::Bending ? l.knot2 : l.knot1});
      m.link_kind.push_back(static_cast<std::uint8_t>(l.kind));
    }
    m.link_alive = t.link_alive;
    m.triangles = flat(t.skin.triangles);
    for (std::size_t k = 0; k < t.triangle_alive.size() && k < t.skin.triangles.size(); ++k) {
      // Indices never shift: a dead triangle stays, without area.
      if (t.triangle_alive[k] == 0)
        std::fill_n(m.triangles.begin() + static_cast<std::ptrdiff_t>(3 * k), 3, 0U);
    }
    m.triangle_layer = t.skin.layer;
    for (const auto& uv : t.skin.texture_coordinates)
      m.texture_coordinates.insert(m.texture_coordinates.end(), {uv[0], uv[1]});
    skinToMsg(t.skin, m.binding_start, m.binding_knots, m.binding_weights);
    for (const auto& corner : world.state().objects[i].tissue.corner)
      m.tetrahedra.insert(m.tetrahedra.end(), corner.begin(), corner.end());
    if (!m.tetrahedra.empty()) m.tetrahedron_material = o.fem->cell_material;
    tubeToMsg(o.tube, m);
  }
}

void toMsg(const scene::TopologyDelta& d, vest_msgs::TissueTopologyDelta& msg) {
  msg.header.frame_id = frameId("world");
  msg.from_revision = d.from_revision;
  msg.revision = d.revision;
  msg.object = d.object;
  msg.object_revision = d.object_revision;
  msg.removed_links = d.removed_links;
  msg.added_link_knots.clear();
  msg.added_link_kind.clear();
  for (const scene::Link& l : d.added_links) {
    msg.added_link_knots.insert(msg.added_link_knots.end(),
                                {l.knot0, l.kind == scene::LinkKind::Bending ? l.knot2 : l.knot1});
    msg.added_link_kind.push_back(static_cast<std::uint8_t>(l.kind));
  }
  msg.doubled_knots = d.doubled_knots;
  msg.removed_triangles = d.removed_triangles;
  msg.added_triangles = flat(d.added_triangles);
  msg.added_triangle_layer = d.added_triangle_layer;
  msg.added_texture_coordinates.clear();
  for (const auto& uv : d.added_skin.texture_coordinates) {
    msg.added_texture_coordinates.insert(msg.added_texture_coordinates.end(), {uv[0], uv[1]});
  }
  skinToMsg(d.added_skin, msg.added_binding_start, msg.added_binding_knots, msg.added_binding_weights);
  msg.rebound_vertices = d.rebound_vertices;
  skinToMsg(d.rebound_skin, msg.rebound_start, msg.rebound_knots, msg.rebound_weights);
}

void toMsg(const scene::StateFrame& frame, vest_msgs::TissueState& msg) {
  msg.header.frame_id = frameId("world");
  msg.revision = frame.revision;
  msg.step = frame.step;
  msg.time = frame.time;
  msg.positions.assign(frame.positions.begin(), frame.positions.end());
  msg.fields.resize(frame.has_fields ? frame.fields.size() : 0);
  for (std::size_t f = 0; f < msg.fields.size(); ++f) {
    const scene::FieldFrame& from = frame.fields[f];
    vest_msgs::TissueField& field = msg.fields[f];
    field.kind = static_cast<std::uint8_t>(from.kind);
    field.minimum = from.minimum;
    field.maximum = from.maximum;
    field.data.resize(from.values.size());
    const float scale = 255.0F / (from.maximum - from.minimum);
    for (std::size_t i = 0; i < from.values.size(); ++i) {
      const float s = (from.values[i] - from.minimum) * scale;
      field.data[i] = static_cast<std::uint8_t>(s > 0.0F ? std::min(s, 255.0F) + 0.5F : 0.0F);
    }
  }
}

void toMsg(const scene::StateFrame& frame, const Description& description,
           vest_msgs::TissueAttachments& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = frame.step;
  msg.attachments.resize(frame.attachments.size());
  for (std::size_t i = 0; i < frame.attachments.size(); ++i) {
    const scene::Attachment& a = frame.attachments[i];
    vest_msgs::TissueAttachment& m = msg.attachments[i];
    m.id = a.id;
    m.kind = a.kind;
    m.object = objectWord(a.anchor.object, description);
    m.element = 0;
    for (std::size_t k = 0; k < 3; ++k) m.barycentric[k] = a.anchor.weights[k];
    m.pose = poseMsg(a.pose);
    m.station = a.station;
    m.closure = a.closure;
    m.instrument = instrumentWord(a.instrument);
  }
}

void toMsg(const scene::StateFrame& frame, const Description& description, vest_msgs::SutureStates& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = frame.step;
  msg.slings.resize(frame.slings.size());
  for (std::size_t i = 0; i < frame.slings.size(); ++i) {
    const scene::SlingView& s = frame.slings[i];
    vest_msgs::SutureSling& m = msg.slings[i];
    m.id = static_cast<std::uint32_t>(s.id);
    m.object = s.around ? objectWord(s.object, description) : "";
    m.rest_length = s.rest_length;
    m.tension = s.tension;
    m.positions.clear();
    for (const Eigen::Vector3d& p : s.positions)
      for (int k = 0; k < 3; ++k) m.positions.push_back(static_cast<float>(p[k]));
    m.knot.x = s.knot.x(), m.knot.y = s.knot.y(), m.knot.z = s.knot.z();
    m.tied = s.tied;
  }
  msg.threads.resize(frame.threads.size());
  for (std::size_t i = 0; i < frame.threads.size(); ++i) {
    const scene::ThreadView& t = frame.threads[i];
    const scene::Suture& suture = description.sutures.at(t.suture);
    vest_msgs::SutureThread& m = msg.threads[i];
    m.id = static_cast<std::uint32_t>(t.suture) << 16 | t.first;
    m.kind = suture.kind;
    m.material = suture.material;
    m.radius = suture.rod.section.radius;
    m.positions.clear();
    for (const Eigen::Vector3d& p : t.positions)
      for (int k = 0; k < 3; ++k) m.positions.push_back(static_cast<float>(p[k]));
    m.tension.assign(t.tension.begin(), t.tension.end());
  }
  for (const scene::SuspensionView& s : frame.suspensions) {
    vest_msgs::SutureThread& m = msg.threads.emplace_back();
    m.id = kSuspensionThreads | static_cast<std::uint16_t>(s.id);
    m.kind = vest_msgs::SutureThread::MONOFIL;
    m.radius = interaction::kSuspensionRadius;
    for (const Eigen::Vector3d& p : {s.tissue, s.wall})
      for (int k = 0; k < 3; ++k) m.positions.push_back(static_cast<float>(p[k]));
    m.tension = {static_cast<float>(s.force.norm())};
  }
  msg.needles.resize(frame.needles.size());
  for (std::size_t i = 0; i < frame.needles.size(); ++i) {
    const scene::NeedleView& n = frame.needles[i];
    vest_msgs::SutureNeedle& m = msg.needles[i];
    m.id = n.suture;
    m.thread = static_cast<std::uint32_t>(n.suture) << 16;
    m.threaded = n.threaded;
    m.wire_radius = n.radius;
    m.instrument = instrumentWord(n.instrument);
    m.positions.clear();
    for (const Eigen::Vector3d& p : n.positions)
      for (int k = 0; k < 3; ++k) m.positions.push_back(static_cast<float>(p[k]));
  }
}

void toMarkers(const vest_msgs::TissueTopology& topology, const scene::StateFrame& frame,
               visualization_msgs::MarkerArray& msg) {
  msg.markers.resize(topology.objects.size());
  std::size_t first = 0;
  std::vector<float> skin;
  for (std::size_t i = 0; i < topology.objects.size(); ++i) {
    const vest_msgs::TissueObject& o = topology.objects[i];
    visualization_msgs::Marker& m = msg.markers[i];
    m.header.frame_id = frameId("world");
    m.ns = "tissue";
    m.id = static_cast<int>(i);
    m.type = visualization_msgs::Marker::TRIANGLE_LIST;
    m.action = visualization_msgs::Marker::ADD;
    m.pose.orientation.w = 1.0;
    m.scale.x = m.scale.y = m.scale.z = 1.0;
    m.color = colour(o.organ);
    m.points.clear();
    const std::size_t vertices = o.binding_start.empty() ? 0 : o.binding_start.size() - 1;
    if (3 * (first + o.knot_count) > frame.positions.size()) break;
    skin.resize(3 * vertices);
    net::rebuildSkin(frame.positions.data() + 3 * first, o.binding_start.data(), o.binding_knots.data(),
                     o.binding_weights.data(), vertices, skin.data());
    m.points.resize(o.triangles.size());
    for (std::size_t k = 0; k < o.triangles.size(); ++k) {
      const float* p = skin.data() + 3 * static_cast<std::size_t>(o.triangles[k]);
      m.points[k].x = p[0];
      m.points[k].y = p[1];
      m.points[k].z = p[2];
    }
    first += o.knot_count;
  }
}

void toMsg(const volume::Brick& brick, vest_msgs::ImageVolume& m) {
  m.header.frame_id = frameId("world");
  m.value_unit = brick.unit;
  for (int a = 0; a < 3; ++a) {
    m.size[a] = brick.size[a];
    m.origin[a] = brick.origin[a];
    m.reduced[a] = brick.reduced[a];
    for (int b = 0; b < 3; ++b) m.axes[3 * a + b] = brick.axes(a, b);
  }
  m.slope = brick.slope, m.intercept = brick.intercept;
  m.nothing = volume::Brick::kNothing;
  m.stored = brick.stored;
}

}  // namespace vest::ros_shell
