#pragma once

#include <array>
#include <cstddef>

namespace vest::haemodynamics {

/// Drugs on vessels and heart, by kDrugs. All have one form: what is given comes to its place of effect with
/// a lag and fades there. With A the amount there, x = A/half, and the sum over all drugs, which compete for
/// the same receptors (Gaddum's competition of agonists: assumed),
///
///     E = x/(1 + sum x),   dA/dt = comes/lag − A/time,   d(comes)/dt = given − comes/lag
///
/// a drug adds `resistance` E to that of the vessels (in units of rest), gives `volume` E of the veins' blood
/// back, and adds `rate` E to the heart rate (in units of rest). The baroreflex narrows the same muscle: of a
/// drug's effect the share 1 − tone/kMostTone is left beside it. ("May be ineffective if severe peripheral
/// vasoconstriction exists": AHFS monograph of phenylephrine. That form: assumed.) The force of the heart is
/// not in it: the model's heart pumps what returns.
struct Drug {
  const char* name;         ///< of the trainer's parameter
  bool infused;             ///< given in kg/s until changed; else a bolus, kg
  double most;              ///< greatest bolus, kg, or infusion, kg/s
  double lag, time;         ///< s
  double half;              ///< kg
  double resistance, rate;  ///< no unit
  double volume;            ///< m³
};

enum DrugIndex : std::size_t { kPhenylephrine, kNoradrenaline, kEphedrine, kDrugCount };

/// What the whole reflex and the brain's ischaemic response come to together.
constexpr double kMostTone = 2;

/// Effects are tuned, for 70 kg, to the papers below, by numbers of their abstracts, which were seen.
/// Patients under anaesthesia keep a fifth of their reflex there (tuned with them).
///
/// Phenylephrine. Half-life 5 min (label of Vazculep, section 12.3 [not checked in print]); labels that were
/// seen say that 0.5 mg act for 15 … 20 min. Lag: assumed. Effects: 2 µg/kg, mean pressure +34 (13) mmHg and
/// output +1.0 (0.7) l/min after 5 min (Kalmar et al. 2018, J. Clin. Monit. Comput. 32, 969); 0.1 mg, 51 (12)
/// to 81 (13) mmHg, output 3.7 (1.1) to 3.4 (0.9) l/min (Nissen et al. 2010, Neurocrit. Care 12, 17); pigs,
/// 4 µg/kg, 72 (6) to 100 (6) mmHg, 7.0 (0.8) to 6.0 (1.1) l/min, and after 21 ml/kg were lost 40 (7) to
/// 65 (9) mmHg, 4.1 (0.6) to 4.9 (0.7) l/min (Cannesson et al. 2012, J. Appl. Physiol. 113, 281). It does
/// little to the heart itself (labels). Most: an ampoule of 500 µg; labels ask for 40 … 250.
///
/// Noradrenaline. Its effect ends 1 … 2 min after the infusion (Swiss product information, section on
/// pharmacokinetics): half-life 1 min (assumed; in plasma 2 min, Beloeil et al. 2005, Br. J. Anaesth. 95,
/// 782). Lag: assumed. Potency between two: 8 µg (95 %: 6 … 10) as a bolus equal 100 µg of phenylephrine
/// (Ngan Kee 2017, Anesthesiology 127, 934), and 0.04 (0.02) µg/kg/min more raise the mean pressure by 20
/// mmHg (Maas et al. 2013, Crit. Care Med. 41, 143: after heart surgery). Full effects: phenylephrine's
/// (assumed). Heart rate: assumed; it stimulates the heart, which the reflex hides. Most: 1 µg/kg/min; 0.01 …
/// 0.4 are usual.
///
/// Ephedrine. Acts within 2 … 5 min for 10 … 60 min (teaching page masteranesthesia.com), longer than
/// phenylephrine (Xia et al. 2016, Experimental and Therapeutic Medicine 12, 1141): lag and half-life of 15
/// min are assumed. Effects: 0.1 mg/kg, mean pressure +8.3 mmHg (95 %: 6.0 … 10.8) and output +7.4 % (5.2
/// … 9.7) after 5 min (BMC Anesthesiol. 2023, doi 10.1186/s12871-023-02244-4); 0.15 mg/kg, +25 % under
/// propofol after 3 min, heart rate up when awake alone (a trial of 40 patients, whose citation is not
/// known here); 10 mg, 53 (9) to 79 (8) mmHg, 3.2 (1.2) to 5.0 (1.3) l/min (Nissen 2010). More by output
/// than by vessels (label of Hospira). Later doses do less; that is not in it but by E. Most: an ampoule of
/// 50 mg, which the label allows in all; it asks for 5 … 10.
constexpr std::array<Drug, kDrugCount> kDrugs = {{
    {"phenylephrine", false, 5.0e-7, 30, 433, 5.0e-8, 0.9, 0.0, 2.5e-4},
    {"noradrenaline", true, 1.2e-9, 15, 87, 3.6e-9, 0.9, 0.1, 2.5e-4},
    {"ephedrine", false, 5.0e-5, 60, 1298, 2.0e-5, 0.5, 0.2, 4.5e-4},
}};

/// What all drugs together add: the sums above, before the reflex takes its share.
struct DrugEffect {
  double resistance = 0, rate = 0;  ///< no unit
  double volume = 0;                ///< m³
};

}  // namespace vest::haemodynamics
