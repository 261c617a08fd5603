#include "vest_viz/texture/organ_texture.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/noise.hpp>
#include <glm/vec3.hpp>

#include "vest_viz/texture/noise.h"

namespace vest::texture {
namespace {

/// A tileable float picture.
struct Field {
  explicit Field(int n) : size(n), data(static_cast<std::size_t>(n) * n, 0.0f) {}
  float& at(int x, int y) { return data[static_cast<std::size_t>(wrap(y)) * size + wrap(x)]; }
  int wrap(int i) const { return i & (size - 1); }
  int size;
  std::vector<float> data;
};

/// Soft-edged line of `radius` texels through the points of a wandering, branching walk.
struct VesselPainter {
  Field* mask;
  Random* random;
  float tortuosity;

  void stamp(float x, float y, float radius, float strength) {
    const int reach = static_cast<int>(radius + 1.5f);
    const int cx = static_cast<int>(std::lround(x)), cy = static_cast<int>(std::lround(y));
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const float dx = cx + i - x, dy = cy + j - y;
        const float cover = std::clamp(radius + 0.5f - std::sqrt(dx * dx + dy * dy), 0.0f, 1.0f);
        float& value = mask->at(cx + i, cy + j);
        value = std::max(value, cover * strength);
      }
  }

  void grow(float x, float y, float heading, float radius, float length, float strength, int depth) {
    // The course bends slowly; round it the vessel winds (a mean-reverting walk), so that it never coils up.
    float course = heading, wobble = 0;
    const float phase = 6.28f * random->uniform();
    float until_branch = (0.08f + 0.2f * random->uniform()) * length;
    for (float s = 0; s < length; s += 1.0f) {
      const float r = std::max(0.28f, radius * (1.0f - 0.6f * s / length));
      // Thinner than a texel: paler instead.
      stamp(x, y, std::max(r, 0.5f), strength * std::min(1.0f, 0.35f + r));
      course += 0.012f * random->centred();
      wobble += -0.06f * wobble + tortuosity * random->centred();
      heading = course + wobble + 2.0f * tortuosity * std::sin(phase + s * 0.22f / std::max(r, 0.8f));
      x += std::cos(heading);
      y += std::sin(heading);
      if (depth > 0 && (until_branch -= 1.0f) < 0) {
        until_branch = (0.06f + 0.16f * random->uniform()) * length;
        const float side = random->uniform() < 0.5f ? -1.0f : 1.0f;
        grow(x, y, heading + side * (0.45f + 0.7f * random->uniform()), 0.72f * r,
             0.55f * (length - 0.6f * s), strength, depth - 1);
      }
    }
  }
};

float mixf(float a, float b, float t) {
  return a + (b - a) * t;
}
float smooth(float a, float b, float x) {
  const float t = std::clamp((x - a) / (b - a), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}
std::uint8_t byte(float v) {
  return static_cast<std::uint8_t>(std::clamp(v, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// Light that a place of a plain weave returns, 0 between threads … 1, as gauze.frag. @param p, q in threads
float weaveAt(float p, float q) {
  const auto across = [](float x) {
    return 1 - smooth(0.35f, 0.80f, 2 * std::fabs(x - std::floor(x) - 0.5f));
  };
  const int over = (static_cast<int>(p) + static_cast<int>(q)) & 1;
  return std::max(across(p) * (over == 1 ? 1.0f : 0.85f), across(q) * (over == 1 ? 0.85f : 1.0f));
}

/// Slopes and crest map of a height field in metres.
void encodeRelief(Field& height, double tile, Baked* out) {
  const int n = height.size;
  const float per_texel = static_cast<float>(n / tile);
  float low = 1e9f, high = -1e9f;
  for (float h : height.data) low = std::min(low, h), high = std::max(high, h);
  const float range = std::max(high - low, 1e-9f);
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const float du = 0.5f * (height.at(x + 1, y) - height.at(x - 1, y)) * per_texel;
      const float dv = 0.5f * (height.at(x, y + 1) - height.at(x, y - 1)) * per_texel;
      std::uint8_t* p = &out->relief[4 * (static_cast<std::size_t>(y) * n + x)];
      p[0] = byte(0.5f + 0.5f * du / kSlopeRange);
      p[1] = byte(0.5f + 0.5f * dv / kSlopeRange);
      p[2] = byte((height.at(x, y) - low) / range);
      p[3] = 255;
    }
}

std::vector<Style> makeStyles() {
  std::vector<Style> all;
  Style s;
  s.organ = "uterus";
  s.base = {0.80f, 0.51f, 0.46f}, s.second = {0.71f, 0.37f, 0.34f}, s.mottle = 0.5f;
  s.vessel_trees = 7, s.vessel_width = 0.00045, s.vessel_strength = 0.55f, s.capillaries = 70;
  s.relief = 0.00012, s.relief_length = 0.006, s.streak = 2.0f, s.wet = 0.9f, s.translucence = 0.25f;
  all.push_back(s);
  s = Style();
  s.organ = "tube";
  s.tile = 0.03;
  s.base = {0.83f, 0.42f, 0.39f}, s.second = {0.66f, 0.24f, 0.24f}, s.mottle = 0.6f;
  s.vessel_trees = 6, s.vessel_width = 0.0005, s.vessel_strength = 0.8f, s.capillaries = 120;
  s.relief = 0.00028, s.relief_length = 0.004, s.streak = 2.0f, s.wet = 1.0f, s.translucence = 0.45f;
  all.push_back(s);
  s = Style();
  s.organ = "ovary";
  s.tile = 0.03;
  s.base = {0.91f, 0.80f, 0.73f}, s.second = {0.84f, 0.60f, 0.54f}, s.mottle = 0.6f;
  s.vessel_trees = 3, s.vessel_width = 0.00025, s.vessel_strength = 0.4f, s.capillaries = 70;
  s.relief = 0.00035, s.relief_length = 0.006, s.crypts = 0.00018, s.wet = 0.9f, s.translucence = 0.2f;
  all.push_back(s);
  s = Style();
  s.organ = "ligament";
  s.tile = 0.05;
  s.base = {0.80f, 0.45f, 0.40f}, s.second = {0.62f, 0.25f, 0.23f}, s.mottle = 0.6f;
  s.vessel_trees = 9, s.vessel_width = 0.0009, s.vessel_strength = 0.85f, s.capillaries = 90, s.fat = 0.10f;
  s.relief = 0.0003, s.relief_length = 0.006, s.streak = 1.5f, s.wet = 0.7f, s.translucence = 0.6f;
  all.push_back(s);
  s = Style();
  s.organ = "artery";
  s.tile = 0.02;
  s.base = {0.68f, 0.31f, 0.26f}, s.second = {0.50f, 0.13f, 0.12f}, s.mottle = 0.8f;
  s.vessel_trees = 2, s.vessel_width = 0.0002, s.capillaries = 30;
  s.relief = 0.0003, s.relief_length = 0.004, s.streak = 3.0f, s.wet = 0.65f, s.translucence = 0.3f;
  all.push_back(s);
  s.organ = "vein";
  // Bluish through its thin wall, but never black: the wall and what covers it scatter light.
  s.base = {0.49f, 0.27f, 0.32f}, s.second = {0.35f, 0.14f, 0.20f}, s.mottle = 0.6f;
  all.push_back(s);
  s = Style();
  s.organ = "intestine";
  s.tile = 0.05;
  s.base = {0.84f, 0.52f, 0.45f}, s.second = {0.74f, 0.34f, 0.30f}, s.mottle = 0.5f;
  s.vessel_trees = 8, s.vessel_width = 0.0006, s.vessel_strength = 0.8f, s.capillaries = 90;
  s.relief = 0.0003, s.relief_length = 0.006, s.streak = 1.6f, s.wet = 0.95f, s.translucence = 0.35f;
  all.push_back(s);
  s = Style();
  s.organ = "cavity";
  s.tile = 0.16, s.span = 2;  // as wide as what is seen of it: no patch of fat comes twice
  s.base = {0.75f, 0.44f, 0.405f}, s.second = {0.60f, 0.27f, 0.25f}, s.mottle = 0.6f;
  s.vessel_trees = 24, s.vessel_width = 0.0010, s.vessel_strength = 0.72f, s.capillaries = 360;
  s.fat = 0.11f;
  s.relief = 0.0009, s.relief_length = 0.013, s.wet = 0.6f, s.translucence = 0.3f;
  all.push_back(s);
  s = Style();
  s.organ = "liver";  // brown red and smooth; a faint pale net under its capsule
  s.tile = 0.06;
  s.base = {0.41f, 0.20f, 0.16f}, s.second = {0.31f, 0.13f, 0.11f}, s.mottle = 0.6f;
  s.artery = {0.58f, 0.30f, 0.25f}, s.vein = s.artery, s.vessel_trees = 0, s.vessel_strength = 0.45f,
  s.capillaries = 160;
  s.relief = 0.0002, s.relief_length = 0.007, s.wet = 0.7f, s.translucence = 0.1f;
  all.push_back(s);
  s = Style();
  s.organ = "gallbladder";  // grey green where bile shines through a pale serosa
  s.tile = 0.06;
  s.base = {0.34f, 0.43f, 0.39f}, s.second = {0.50f, 0.46f, 0.38f}, s.mottle = 0.6f;
  s.vessel_trees = 6, s.vessel_width = 0.0006, s.vessel_strength = 0.6f, s.capillaries = 70;
  s.relief = 0.00015, s.relief_length = 0.007, s.wet = 1.0f, s.translucence = 0.35f;
  all.push_back(s);
  s = Style();
  s.organ = "duct";  // bile duct
  s.tile = 0.02;
  s.base = {0.64f, 0.56f, 0.38f}, s.second = {0.52f, 0.47f, 0.33f}, s.mottle = 0.6f;
  s.vessel_trees = 2, s.vessel_width = 0.0002, s.vessel_strength = 0.6f, s.capillaries = 30;
  s.relief = 0.0002, s.relief_length = 0.004, s.streak = 2.0f, s.wet = 0.9f, s.translucence = 0.35f;
  all.push_back(s);
  s = Style();
  s.organ = "areolar";  // loose tissue with fat
  s.tile = 0.04;
  s.base = {0.82f, 0.56f, 0.47f}, s.second = {0.72f, 0.38f, 0.34f}, s.mottle = 0.6f;
  s.vessel_trees = 4, s.vessel_width = 0.0004, s.vessel_strength = 0.7f, s.capillaries = 90, s.fat = 0.35f;
  s.relief = 0.0003, s.relief_length = 0.004, s.streak = 1.5f, s.wet = 0.85f, s.translucence = 0.6f;
  all.push_back(s);
  s.organ = "omentum";  // apron of fat
  s.fat = 0.9f, s.vessel_trees = 8, s.wet = 0.7f, s.relief = 0.0006, s.relief_length = 0.008, s.streak = 1.0f;
  all.push_back(s);
  s = Style();
  s.organ = "bone";  // ivory, faintly pink where vessels enter
  s.tile = 0.04;
  s.base = {0.88f, 0.80f, 0.67f}, s.second = {0.80f, 0.65f, 0.54f}, s.mottle = 0.5f;
  s.vessel_trees = 0, s.vessel_strength = 0.35f, s.capillaries = 60;
  s.relief = 0.00025, s.relief_length = 0.003, s.wet = 0.6f, s.translucence = 0.1f;
  all.push_back(s);
  s.organ = "cartilage";  // bluish white, smooth
  s.base = {0.84f, 0.86f, 0.84f}, s.second = {0.76f, 0.78f, 0.79f}, s.capillaries = 0;
  s.relief = 0.0001, s.relief_length = 0.006, s.wet = 0.95f, s.translucence = 0.3f;
  all.push_back(s);
  // Inside colours, for cut faces and the inner walls of tubes.
  s = Style();
  s.organ = "cut_muscle";  // firm, pale red, fibres and opened vessels
  s.tile = 0.02;
  s.base = {0.80f, 0.36f, 0.33f}, s.second = {0.60f, 0.15f, 0.14f}, s.mottle = 0.9f;
  s.vessel_trees = 3, s.vessel_width = 0.0004, s.vessel_strength = 0.9f, s.capillaries = 150;
  s.relief = 0.0005, s.relief_length = 0.002, s.streak = 3.0f, s.wet = 1.0f, s.translucence = 0.35f;
  all.push_back(s);
  s.organ = "cut_connective";  // ragged, yellow lobules between red
  s.base = {0.80f, 0.40f, 0.30f}, s.second = {0.58f, 0.13f, 0.12f}, s.fat = 0.35f;
  s.relief = 0.0006, s.streak = 1.5f;
  all.push_back(s);
  s.organ = "cut_pale";  // cortex of the ovary, wall of a vessel
  s.base = {0.90f, 0.72f, 0.64f}, s.second = {0.72f, 0.30f, 0.28f}, s.mottle = 0.6f, s.fat = 0.0f;
  s.relief = 0.0003, s.streak = 2.0f;
  all.push_back(s);
  s.organ = "cut_mucosa";  // inside of bowel and tube: red velvet in folds
  s.base = {0.85f, 0.42f, 0.36f}, s.second = {0.70f, 0.20f, 0.19f}, s.mottle = 0.7f;
  s.relief = 0.0005, s.relief_length = 0.003, s.streak = 3.0f, s.crypts = 0.0002;
  all.push_back(s);
  // Squares of a calibration board: paper, matt and without pattern.
  s = Style();
  s.organ = "board_white";
  s.base = s.second = {0.93f, 0.93f, 0.93f};
  s.mottle = 0, s.vessel_trees = 0, s.capillaries = 0, s.vessel_strength = 0, s.relief = 0, s.wet = 0,
  s.translucence = 0;
  all.push_back(s);
  s.organ = "board_black";
  s.base = s.second = {0.16f, 0.16f, 0.16f};
  all.push_back(s);
  // Things of a training box: matt plastic, steel, rubber, and gauze of woven threads.
  s.organ = "board";
  s.base = s.second = {0.30f, 0.36f, 0.40f};
  all.push_back(s);
  s.organ = "peg";
  s.base = s.second = {0.80f, 0.81f, 0.83f}, s.wet = 0.6f;
  all.push_back(s);
  s.organ = "rubber";
  s.base = s.second = {0.20f, 0.42f, 0.72f}, s.wet = 0.2f;
  all.push_back(s);
  s.organ = "gauze";
  s.base = {0.92f, 0.91f, 0.87f}, s.second = {0.84f, 0.82f, 0.77f}, s.mottle = 0.2f, s.wet = 0,
  s.translucence = 0.05f;
  s.weave = 0.0008, s.relief = 0.0001, s.relief_length = 0.002;
  all.push_back(s);
  s = Style();
  s.vessel_trees = 6, s.vessel_strength = 0.72f, s.capillaries = 90, s.mottle = 0.6f;
  s.second = {0.60f, 0.27f, 0.25f}, s.relief = 0.0005, s.relief_length = 0.013, s.wet = 0.6f;
  s.organ = "";
  s.tile = 0.04, s.base = {0.80f, 0.45f, 0.41f}, s.fat = 0.0f, s.vessel_width = 0.0006, s.vessel_trees = 6;
  all.push_back(s);
  return all;
}

}  // namespace

const Style& styleOf(const std::string& organ) {
  static const std::vector<Style> kStyles = makeStyles();
  for (const Style& style : kStyles)
    if (style.organ == organ) return style;
  return kStyles.back();
}

const Style& insideOf(const std::string& organ) {
  if (organ == "ovary" || organ == "artery" || organ == "vein" || organ == "duct") return styleOf("cut_pale");
  if (organ == "intestine" || organ == "gallbladder") return styleOf("cut_mucosa");
  if (organ == "gauze") return styleOf("gauze");
  if (organ == "uterus" || organ == "tube" || organ == "liver") return styleOf("cut_muscle");
  return styleOf("cut_connective");
}

Baked bake(const Style& s, int n, std::uint32_t seed) {
  Baked out;
  out.size = n;
  out.tile = s.tile;
  out.albedo.assign(4u * n * n, 255);
  out.relief.assign(4u * n * n, 255);
  Random random(seed);
  Field vein(n), artery(n), capillary(n), height(n);
  const float texels_per_metre = static_cast<float>(n / s.tile);
  const float radius = 0.5f * static_cast<float>(s.vessel_width) * texels_per_metre;
  const float reach = static_cast<float>(n) / static_cast<float>(s.span);
  for (int i = 0; i < s.vessel_trees; ++i) {
    const float x = n * random.uniform(), y = n * random.uniform(), a = 6.2832f * random.uniform();
    const float r = radius * (0.45f + 0.8f * random.uniform()),
                length = reach * (0.45f + 0.5f * random.uniform());
    VesselPainter{&vein, &random, 0.11f}.grow(x, y, a, r, length, 1.0f, 3);
    // Arteries run beside veins, thinner and more tortuous.
    const float off = 3.2f * r + 2.0f;
    VesselPainter{&artery, &random, 0.15f}.grow(x - off * std::sin(a), y + off * std::cos(a), a, 0.6f * r,
                                                0.9f * length, 0.9f, 2);
  }
  for (int i = 0; i < s.capillaries; ++i)
    VesselPainter{&capillary, &random, 0.22f}.grow(
        n * random.uniform(), n * random.uniform(), 6.2832f * random.uniform(),
        0.3f + 0.35f * random.uniform(), reach * (0.03f + 0.08f * random.uniform()),
        0.35f + 0.4f * random.uniform(), 2);

  const int waves = std::max(1, static_cast<int>(std::lround(s.tile / s.relief_length)));
  const int waves_u = std::max(1, static_cast<int>(std::lround(waves / s.streak)));
  const auto span = static_cast<float>(s.span);
  const int lobules = std::max(4, static_cast<int>(s.tile / 0.0038));
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const float u = (x + 0.5f) / n, v = (y + 0.5f) / n;
      const std::size_t k = static_cast<std::size_t>(y) * n + x;
      const float warp = 0.02f / span * periodicFbm(u, v, 4 * s.span, 4 * s.span, 2, seed + 5);
      const float low = periodicFbm(u + warp, v - warp, 3 * s.span, 3 * s.span, 4, seed + 11);
      const float fine = periodicFbm(u, v, waves_u * 3, waves * 3, 3, seed + 23);
      const float coarse = periodicFbm(u + warp, v + warp, waves_u, waves, 3, seed + 37);
      float h = static_cast<float>(s.relief) * (coarse + 0.15f * fine);
      Colour c;
      const float m = std::clamp(s.mottle * (0.5f + 0.8f * low + 0.25f * fine), 0.0f, 1.0f);
      for (int i = 0; i < 3; ++i) c[i] = mixf(s.base[i], s.second[i], m);
      // The film of fluid is not even: wet patches beside drier ones.
      float wet =
          s.wet *
          (0.12f + 0.95f * smooth(-0.05f, 0.55f,
                                  periodicFbm(u, v, 5 * s.span, 5 * s.span, 3, seed + 83) + 0.3f * coarse));
      if (s.crypts > 0) {
        const Cell cell = periodicCell(u + warp, v, std::max(3, static_cast<int>(s.tile / 0.004)), seed + 3);
        const float groove = 1.0f - smooth(0.02f, 0.35f, cell.second - cell.nearest);
        h -= static_cast<float>(s.crypts) * groove;
        for (int i = 0; i < 3; ++i) c[i] *= 1.0f - 0.09f * groove * (i == 0 ? 0.5f : 1.0f);
      }
      if (s.weave > 0) {
        const auto threads =
            static_cast<float>(2 * std::lround(0.5 * s.tile / s.weave));  // in pairs: no seam
        const float top = weaveAt(u * threads, v * threads);
        h += static_cast<float>(s.relief) * top;
        for (int i = 0; i < 3; ++i) c[i] *= 0.6f + 0.4f * top;
      }
      float veil = 0;  // how far fat hides the vessels
      if (s.fat > 0) {
        // Threshold chosen so that about `fat` of the surface lies above it (fbm is about normal, deviation
        // 0.35).
        const float field =
            periodicFbm(u - warp, v + 2 * warp, 2 * s.span, 2 * s.span, 5, seed + 53) + 0.10f * fine;
        const float threshold = 0.42f - 0.9f * s.fat;
        const float cover = smooth(threshold - 0.14f, threshold + 0.24f, field);
        if (cover > 0) {
          // Soft round lobules of two sizes, drawn out of shape; what lies between them shines through pink.
          const float wu = u + 0.8f * warp + 0.010f / span * coarse, wv = v + 0.010f / span * low;
          const Cell lobe = periodicCell(wu, wv, lobules, seed + 61);
          const Cell small = periodicCell(wu + 0.004f / span * fine, wv, lobules * 2, seed + 63);
          const auto dome = [](float d) { return std::max(0.0f, 1.0f - d * d); };
          const float bump = 0.75f * dome(lobe.nearest) + 0.25f * dome(small.nearest);
          const float crease =
              (1.0f - smooth(0.0f, 0.35f, lobe.second - lobe.nearest)) * smooth(-0.5f, 0.6f, coarse);
          const float shade = 0.74f + 0.28f * bump + 0.12f * ((lobe.id & 255u) / 255.0f - 0.5f);
          const float blush = std::clamp(0.16f + 0.35f * low + 0.35f * crease, 0.0f, 0.7f);
          const Colour fat{0.96f * shade, 0.61f * shade, 0.32f * shade};
          for (int i = 0; i < 3; ++i) c[i] = mixf(c[i], mixf(fat[i], c[i], blush), 0.92f * cover);
          h += cover * (0.0005f + 0.0006f * bump);
          wet *= 1.0f - 0.35f * cover;
          veil = 0.6f * cover;
        }
      }
      const float cap = capillary.data[k] * 0.75f;
      for (int i = 0; i < 3; ++i) c[i] = mixf(c[i], s.artery[i], s.vessel_strength * cap * 0.8f);
      for (int i = 0; i < 3; ++i) c[i] = mixf(c[i], s.vein[i], (1 - veil) * s.vessel_strength * vein.data[k]);
      for (int i = 0; i < 3; ++i)
        c[i] = mixf(c[i], s.artery[i], (1 - veil) * s.vessel_strength * artery.data[k]);
      h += 0.00008f * std::max(vein.data[k], artery.data[k]);
      height.data[k] = h;
      std::uint8_t* p = &out.albedo[4 * k];
      for (int i = 0; i < 3; ++i) p[i] = byte(c[i]);
      p[3] = byte(wet);
    }
  encodeRelief(height, s.tile, &out);
  return out;
}

Baked bakeMicro(int n, std::uint32_t seed) {
  Baked out;
  out.size = n;
  out.tile = 0.006;
  out.albedo.assign(4u * n * n, 255);
  out.relief.assign(4u * n * n, 255);
  Field height(n);
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const float u = (x + 0.5f) / n, v = (y + 0.5f) / n;
      const float cells = periodicCell(u + 0.03f * periodicFbm(u, v, 6, 6, 1, seed), v, 11, seed + 1).nearest;
      height.at(x, y) = 0.00005f * periodicFbm(u, v, 5, 5, 4, seed + 2) + 0.00003f * (0.5f - cells);
    }
  encodeRelief(height, out.tile, &out);
  return out;
}

std::array<float, 3> tintAt(float x, float y, float z, const Style& s) {
  if (s.weave > 0) return {1, 1, 1};  // a cloth is one colour
  const glm::vec3 p(x, y, z);
  const float broad = glm::perlin(p * 28.0f) + 0.5f * glm::perlin(p * 60.0f + 7.0f);
  const float flush = glm::perlin(p * 90.0f + 3.0f) + 0.6f * glm::perlin(p * 200.0f + 9.0f);
  const float light = 1.0f + 0.28f * broad, red = 0.22f * s.mottle * flush;
  return {light * (1 + 0.3f * red), light * (1 - red), light * (1 - red)};
}

}  // namespace vest::texture
