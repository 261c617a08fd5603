#include "haemostasis.h"

#include <cmath>
#include <string>

#include "sections.h"

namespace vest::validate {

validation::Section haemostasisSection(const Options& options, const std::string& command) {
  namespace hs = bleeding::haemostasis;
  using validation::digits;
  validation::Section section("53_haemostasis", "Haemostasis: bleeding times, pressure, recovery", command);
  const haemodynamics::Circulation pelvis = haemodynamics::buildCirculation(
      haemodynamics::readVessels(options.shipped + "/../vessels/pelvis"), 0.01);
  const int artery = pelvis.model.find("external_iliac_artery_left");
  constexpr double kSheath = 3e-6, kNeedle = 2e-7;  // m²: 2 mm and 0.5 mm across
  const double pressed = hs::holeMinutes(pelvis.model, artery, kSheath, 0),
               free = hs::holeMinutes(pelvis.model, artery, kSheath, 1e-6),
               needle = hs::holeMinutes(pelvis.model, artery, kNeedle, 1e-7),
               held = hs::holeMinutes(pelvis.model, artery, kNeedle, 0), skin = hs::surfaceMinutes(false),
               gauze = hs::surfaceMinutes(true);
  section.text(
      "Minutes until a clot holds, or until a cut surface seeps a tenth of what it did at first. Patients of "
      "print had heparin "
      "where a catheter or a graft was placed; the model's has none, so that the lower end of print is what "
      "it is held to.");
  const auto minutes = [](double t) { return std::isinf(t) ? std::string("not within an hour") : digits(t); };
  section.table({"what bleeds", "here, min", "print"},
                {{"a hole of 2 mm in an artery, pressed so that nothing flows", minutes(pressed),
                  "3: gauze stopped 56 of 85 bleeding aortas within 3 min (PubMed 27466878); 14 ± 6: "
                  "femoral artery after a "
                  "catheter, by hand (J. Perianesth. Nurs. 2012); 14.5: suture lines of grafts, by pressure, "
                  "heparin (28 patients, "
                  "2002, acemap 349726292); 22 and 34: femoral artery (Am. J. Crit. Care 1995, 4:149; Semler "
                  "1985, Radiology 154:234)"},
                 {"the same, left alone", minutes(free), "arteries are not left alone"},
                 {"a hole of 0.5 mm in an artery, pressed", minutes(held),
                  "5 … 10: pressure after a needle in the wrist's artery (MedlinePlus, arterial stick)"},
                 {"the same, left alone", minutes(needle), "2 … 9: bleeding time of skin (Ivy)"},
                 {"a cut surface, left alone", minutes(skin), "2 … 9: bleeding time of skin (Ivy)"},
                 {"a cut surface under gauze", minutes(gauze),
                  "3, as above; the model's half of the time left alone is assumed"}});
  section.text("Abstracts of these papers were read, not the papers. Ivy's range is that of text books.");
  section.atLeast("pressed hole: minutes", pressed, 3, "min");
  section.atMost("pressed hole: minutes", pressed, 34, "min");
  section.atLeast("hole left alone: minutes", free, 60, "min");
  section.atLeast("needle's hole left alone: minutes", needle, 2, "min");
  section.atMost("needle's hole left alone: minutes", needle, 9, "min");
  section.atMost("needle's hole pressed, over left alone", held / needle, 1, "no unit");
  section.atLeast("cut surface left alone: minutes", skin, 2, "min");
  section.atMost("cut surface left alone: minutes", skin, 9, "min");
  section.atMost("cut surface under gauze: minutes", gauze, 3, "min");
  section.text("### Recovery of tissue without blood");
  section.text(
      "An artery is shut for three minutes and opened. Print: muscle of the hand, 25 subjects (Crit. Care "
      "2009, 13(Suppl "
      "1), doi:10.1186/cc7404); the lowest of eleven (PubMed 22697622).");
  const hs::Release r = hs::release();
  section.table({"what", "here", "print"},
                {{"saturation falls by, % in the first minute", digits(100 * r.fall), "11.2"},
                 {"lowest, %", digits(100 * r.lowest), "39 ± 13"},
                 {"rises by, %/min", digits(100 * r.rise), "213"},
                 {"above rest, %", digits(100 * r.above), "15.0"},
                 {"a quarter of that is left after, min", digits(r.back), "2.4 (at rest)"}});
  section.atMost("saturation's fall differs by", 100 * std::fabs(r.fall - 0.112), 0.3, "%");
  section.atMost("lowest saturation differs by", 100 * std::fabs(r.lowest - 0.39), 13, "%");
  section.atMost("rise differs by", 100 * std::fabs(r.rise - 2.13), 60, "%/min");
  section.atMost("overshoot differs by", 100 * std::fabs(r.above - 0.15), 5, "%");
  section.atMost("recovery differs by", std::fabs(r.back - 2.4), 1.2, "min");
  return section;
}

}  // namespace vest::validate
