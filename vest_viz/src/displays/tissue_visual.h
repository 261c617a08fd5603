#pragma once

#include <array>
#include <atomic>
#include <future>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "dynamic_mesh.h"
#include "ogre_vector.h"
#include "vest_viz/inspect/slice.h"
#include "vest_viz/instrument/jaws.h"
#include "vest_viz/mesh/coarse.h"
#include "vest_viz/mesh/field_smoother.h"
#include "vest_viz/mesh/mark.h"
#include "vest_viz/mesh/occlusion.h"
#include "vest_viz/mesh/store.h"
#include "vest_viz/mesh/sunken_wall.h"

namespace Ogre {
class ManualObject;
}

namespace vest::displays {

/// Draws what a mesh::Store holds: one DynamicMesh per object, coloured by what happened to the tissue
/// (bleeding, coagulation, char, lost perfusion), and the wire net of its living links on demand.
class TissueVisual {
 public:
  /// @param quality 0 simple, 1 standard, 2 fine
  /// @param depth_in_alpha for the finishing pass of the endoscopic view, which draws healthy, uncut skins
  /// with fewer triangles unless it is fine
  TissueVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, int quality, bool depth_in_alpha);
  ~TissueVisual();

  /// Uploads what changed since the last call; call after store.rebuildSkins(), in update(), never in a
  /// callback.
  void update(const mesh::Store& store);
  /// @param light view space position in m and intensity; goes to every object's shader
  void setLight(const Ogre::Vector4& light);
  /// Where down is in view space, and the session's time in s: films of blood run.
  void setMoment(const Ogre::Vector4& down_and_time);
  /// Instruments that darken the skin beside them: two ends each in view space (m), the radius in w; 0: none.
  using Shafts = std::array<Ogre::Vector4, 6>;
  void setShafts(const Shafts& shafts);
  /// Shadows of two of them: three rows of instrument::CastShadow each, in view space.
  using Shadows = std::array<Ogre::Vector4, 6>;
  void setShadows(const Shadows& shadows);
  /// Jaws by the object that they hold: its skin is drawn between them, from the next update() on.
  using Held = std::map<std::string, std::vector<instrument::Jaws>>;
  void setHeld(Held held) { held_ = std::move(held); }
  /// A cavity's wall hangs so far down, m (GasState::sunk), but round the lens (m, world) and over shafts:
  /// from the next update() on.
  void setSunk(double metres, const Eigen::Vector3d& lens, std::vector<mesh::TentPole> shafts);
  /// Skin of an object as it is drawn; x y z per vertex, m, in world.
  const std::vector<float>& drawnSkin(const mesh::Store& store, std::size_t index) const {
    const std::vector<float>& all = store.skin(index).positions;
    return index < parts_.size() && parts_[index].pressed.size() == all.size() ? parts_[index].pressed : all;
  }
  /// @param bias levels by which textures are finer than the pixels that are drawn; for pictures that are
  /// enlarged
  void setMipBias(float bias);
  void setAlpha(float alpha);
  void showSurface(bool show);
  void showLinks(bool show);
  /// Only objects whose name or organ is in the set, none whose name or organ is in it behind a `-`; where
  /// all words are such ones, all others are shown.
  void setFilter(const std::set<std::string>& names);
  /// How skins are coloured.
  struct Colouring {
    enum class By { Look, Field, Object, Organ, Material, Layer };
    By by = By::Look;
    std::uint8_t field = 0;   ///< kind of vest_msgs/TissueField
    float low = 0, high = 1;  ///< of the scale, unit of the kind
    bool operator==(const Colouring& o) const {
      return by == o.by && field == o.field && low == o.low && high == o.high;
    }
  };
  void setColouring(const Colouring& colouring, const mesh::Store& store);
  /// False while a worker still looks how open vertices lie and which triangles can be left out.
  bool settled() const { return !baking_.valid(); }
  /// What lies on the side to which the plane's normal points is not drawn; null: everything is. A sliced
  /// skin in By::Look has its organ's plain colour.
  void setSlice(const inspect::Plane* plane, const mesh::Store& store);
  /// By the filter.
  bool shows(const std::string& name, const std::string& organ) const {
    if (filter_.count("-" + name) != 0 || filter_.count("-" + organ) != 0) return false;
    return shows_others_ || filter_.count(name) != 0 || filter_.count(organ) != 0;
  }
  /// Empty, or why shaders are not supported.
  const std::string& warning() const { return warning_; }
  std::size_t vertexCount() const { return vertices_; }

 private:
  /// Outer skin, inner wall and cut faces of an object, each with its look; the second look shows what
  /// happened to the tissue and is only used where something did.
  static constexpr std::size_t kGroups = 3;
  struct Part {
    std::unique_ptr<DynamicMesh> mesh;
    std::array<Ogre::MaterialPtr, kGroups> plain, marked;
    Ogre::MaterialPtr coloured;
    std::array<std::string, kGroups> styles;
    std::array<bool, kGroups> present{};
    mesh::Mark mark;
    bool cull = false;
    std::string name, organ;
    std::uint64_t version = 0, coarse_version = 0;  ///< shapes that are drawn and that `coarse` was made of
    std::vector<std::uint32_t> coarse;              ///< fewer triangles; empty: none, or not yet
    std::vector<mesh::LeftOut> left_out;            ///< by `coarse`, of what can be bent
    bool is_bent = false;                           ///< so that fewer triangles would hide it
    bool stale = false;                             ///< to be built again though the shape is the same
    mesh::Refined refined;                ///< of a wall, where organs lie on it; empty: none, or not yet
    std::vector<float> occlusion;         ///< empty until it is baked
    std::vector<float> coarse_occlusion;  ///< the same for `coarse`; empty: the same
    std::vector<std::uint8_t> state;
    mesh::FieldSmoother smoother;  ///< of what happened to the tissue
    std::uint64_t smoother_version = 0;
    std::vector<float> pressed, pressed_normals;  ///< while jaws hold it or it sinks, else empty
  };
  void rebuildAll(const mesh::Store& store);
  void beginBaking(const mesh::Store& store);
  void takeBaked();
  void rebuildPart(const mesh::Store& store, std::size_t index);
  bool judgeBend(const mesh::Store& store, std::size_t index);
  /// What jaws hold lies between them; a wall sinks. @return true if vertices are to be drawn anew
  bool press(const mesh::Store& store, std::size_t index);
  void upload(const mesh::Store& store, std::size_t index);
  void updateState(const mesh::Store& store, std::size_t index);
  void updateColours(const mesh::Store& store, std::size_t index);
  void destroy(Part* part);
  void prepare(const Ogre::MaterialPtr& material, bool cull);
  template <class F>
  void forEachMaterial(F&& f);
  void drawLinks(const mesh::Store& store);
  void applyVisibility();
  bool visible(const Part& part) const { return show_surface_ && shows(part.name, part.organ); }
  /// Whether the vertices that `refined` adds are drawn.
  bool fine(const Part& part) const {
    return !part.refined.middles.empty() && part.coarse_version == part.version && !coloured();
  }
  bool coloured() const { return sliced_ || colouring_.by != Colouring::By::Look; }
  void recolour(const mesh::Store& store);

  Ogre::SceneManager* manager_;
  Ogre::SceneNode* node_;
  int quality_;
  bool depth_in_alpha_;
  Colouring colouring_;
  bool sliced_ = false;
  Ogre::Vector4 slice_{0, 0, 0, 1};  ///< what has slice · (x, y, z, 1) < 0 is not drawn
  std::vector<Part> parts_;
  std::vector<std::uint8_t> layer_;  ///< of one object, for updateState()
  std::uint64_t shape_version_ = 0, field_version_ = 0;
  std::vector<std::string> names_;  ///< of the objects drawn
  std::size_t vertices_ = 0;
  Ogre::ManualObject* links_ = nullptr;
  Ogre::MaterialPtr link_material_;
  bool show_surface_ = true, show_links_ = false;
  float alpha_ = 1.0f, mip_bias_ = 0.0f;
  Held held_;
  double sunk_ = 0;  ///< m
  Eigen::Vector3d lens_{0, 0, 0};
  std::vector<mesh::TentPole> tent_poles_;
  std::set<std::string> filter_;
  bool shows_others_ = true;  ///< the filter names none to be shown
  using Triangles = std::vector<std::uint32_t>;
  std::atomic<bool> stop_{false};
  struct Baked {
    std::vector<Triangles> coarse;              ///< per part
    std::vector<std::vector<float>> occlusion;  ///< per part and vertex
    std::vector<std::vector<mesh::LeftOut>> left_out;
    std::vector<mesh::Refined> refined;
  };
  std::future<Baked> baking_;  ///< reads stop_
  std::string warning_;
};

}  // namespace vest::displays
