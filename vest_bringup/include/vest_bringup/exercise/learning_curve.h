#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "vest_bringup/exercise/trainees.h"

namespace vest::exercise {

/// Law of practice (Newell & Rosenbloom 1981, with a plateau): total after n attempts is a + b·n^−c.
struct LearningCurve {
  double a = 0;    ///< points: the plateau
  double b = 0;    ///< points: at the first attempt above the plateau; negative where it was below
  double c = 0;    ///< no unit, kLeastRate … kMostRate
  double rms = 0;  ///< points, of what the curve leaves over
};
inline constexpr std::size_t kCurveFrom = 6;  ///< attempts
inline constexpr double kLeastRate = 0.05, kMostRate = 3;
/// Least squares over c, with a and b the straight line in n^−c. @param totals oldest first
/// @return nothing before kCurveFrom attempts
std::optional<LearningCurve> fitCurve(const std::vector<double>& totals);

/// Learning-curve CUSUM (Bolsin & Colson 2000): each attempt not passed adds 1 − s, each passed one takes s
/// away. At h the failure rate is kBadRate or more, at −h it is kGoodRate or less; both with an error of 10
/// %; the sum then begins anew.
inline constexpr double kGoodRate = 0.05, kBadRate = 0.15, kCusumStep = 0.092, kCusumLimit = 1.82;
struct Cusum {
  enum class Verdict { Open, Competent, NotYet };
  std::vector<double> sums;         ///< after each attempt, before it begins anew
  Verdict verdict = Verdict::Open;  ///< of the last limit that was reached
};
Cusum cusumOf(const std::vector<bool>& passed);

/// A number of a result that groups are compared by: total, quality, time_s, and each item by its name.
struct Figure {
  std::string name;
  double value = 0;  ///< NaN: not known
  bool higher_is_better = false;
};
/// @return nothing of an attempt whose JSON is none
std::vector<Figure> figuresOf(const Attempt& attempt);

/// What a group of people did at one version of an exercise; nobody's name is in it.
struct Reference {
  struct Of {
    std::string name;
    double mean = 0, deviation = 0;  ///< of the sample, by n − 1
  };
  std::string exercise, hash;
  std::size_t attempts = 0;
  std::vector<Of> figures;
};
inline constexpr std::size_t kReferenceFrom = 5;  ///< attempts
/// Of attempts that have no flags, all at the version of the newest.
/// @throws std::invalid_argument: fewer than kReferenceFrom
Reference referenceOf(const std::string& exercise, const std::vector<Attempt>& attempts);
std::string toJson(const Reference& reference);
/// Strict. @throws std::invalid_argument: file, field, what is allowed
Reference parseReference(const std::string& file, const std::string& text);
/// Where the group of an exercise is kept: beside the database.
std::string referenceFile(const std::string& database, const std::string& exercise);
/// The stored group, where there is one. @throws as parseReference
std::optional<Reference> storedReference(const std::string& database, const std::string& exercise);

/// Sample standard deviations by which a figure is better than the group's mean; negative: worse.
struct ZScore {
  std::string name;
  double z = 0;
};
/// Of the figures that the group has, and differs in. None where the attempt is at another version.
std::vector<ZScore> zScores(const Reference& reference, const Attempt& attempt);

/// A trainee's attempts at one exercise, oldest first. Those with a flag count for neither curve nor CUSUM.
struct Learning {
  std::vector<Attempt> attempts;
  std::vector<double> totals;  ///< of those that count
  std::optional<LearningCurve> curve;
  Cusum cusum;
  std::optional<Reference> reference;
  std::vector<ZScore> z;  ///< of the last attempt
};
Learning learningOf(std::vector<Attempt> attempts, std::optional<Reference> reference);
/// At most three sentences for people; empty where there is nothing to say.
std::string toText(const Learning& learning);
std::string toJson(const Learning& learning);
/// A row per attempt: attempt, date, total, quality, time_s, passed, counts, cusum.
std::string toCsv(const Learning& learning);

}  // namespace vest::exercise
