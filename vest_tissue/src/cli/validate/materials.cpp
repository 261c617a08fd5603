#include <cmath>

#include "sections.h"
#include "vest_tissue/material/database.h"

namespace vest::validate {

using material::Condition;

validation::Section materialsSection(const Options&, const std::string& command) {
  validation::Section s("10_materials", "Materials", command);
  const auto database = material::readDatabase(material::databasePath());
  s.text(
      "σ(ε) = E·ε·(1 + a2·ε + a3·ε² + a4·ε³) in tension, E·ε in compression. Every number of "
      "vest_tissue/data/materials.yaml stands beside its source, or says\nthat it is assumed; "
      "`rosrun vest_tissue vest_material show NAME` prints them.");
  std::vector<std::vector<std::string>> rows;
  int sourced = 0, numbers = 0;
  validation::Plot soft{"Stress and strain, in vivo", "strain, no unit", "stress, kPa", {}, false, false};
  for (const auto& t : database.tissues) {
    for (const auto& [key, q] : t.in_vivo) {
      (void)key;
      ++numbers;
      sourced += !q.assumed;
    }
    const auto& e = t.at("youngs_modulus");
    rows.push_back({t.name, validation::digits(1e-3 * e.value),
                    validation::digits(1e-3 * t.law(Condition::PostMortem).youngs_modulus),
                    e.assumed ? "assumed" : e.source});
    if (t.name != "liver" && t.name != "spleen" && t.name != "uterus" && t.name != "kidney" &&
        t.name != "fat_soft")
      continue;
    validation::Curve c;
    c.label = t.name;
    for (int i = -15; i <= 40; ++i) {
      c.x.push_back(0.01 * i);
      c.y.push_back(1e-3 * material::stress(t.law(), 0.01 * i));
    }
    soft.curves.push_back(c);
  }
  s.table({"material", "E in vivo, kPa", "E post mortem, kPa", "source of E"}, rows);
  s.plot("curves", soft);
  s.text("Of " + std::to_string(numbers) + " numbers of living tissue, " + std::to_string(sourced) +
         " are from print, the others are assumed, with the reason.");
  s.atLeast("materials in the database", static_cast<double>(database.tissues.size()), 16, "no unit");
  s.atLeast("numbers with a publication", sourced, 60, "no unit");

  const material::Law law{4200.0, 0.7, 3.0, 11.0, 0.5};
  std::vector<material::Point> points;
  for (double e = -0.1; e < 0.505; e += 0.02) points.push_back({e, material::stress(law, e)});
  const auto fit = material::fitLaw(points);
  s.atMost("fit of E, a2 … a4 to the curve that they make, greatest residual over greatest stress",
           fit.greatest / material::stress(law, 0.5), 1e-9, "no unit");
  return s;
}

}  // namespace vest::validate
