#include "vest_bringup/exercise/learning_curve.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "vest_instruments/files/read.h"
#include "vest_instruments/files/strict_json.h"

namespace vest::exercise {
namespace {

using nlohmann::json;

constexpr std::size_t kMostReferenceBytes = 1U << 20U;

std::string formatted(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

/// The curve with this c.
LearningCurve curveAt(double c, const std::vector<double>& totals) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const auto count = static_cast<double>(totals.size());
  const auto x = [c](std::size_t i) { return std::pow(static_cast<double>(i + 1), -c); };
  for (std::size_t i = 0; i < totals.size(); ++i) sx += x(i), sy += totals[i];
  const double mx = sx / count, my = sy / count;
  for (std::size_t i = 0; i < totals.size(); ++i)
    sxx += (x(i) - mx) * (x(i) - mx), sxy += (x(i) - mx) * (totals[i] - my);
  LearningCurve curve{0, sxy / sxx, c, 0};
  curve.a = my - curve.b * mx;
  for (std::size_t i = 0; i < totals.size(); ++i) {
    const double off = totals[i] - curve.a - curve.b * x(i);
    curve.rms += off * off;
  }
  curve.rms = std::sqrt(curve.rms / count);
  return curve;
}

double finite(const json& j, const std::string& file, const char* key, double least) {
  const auto at = j.find(key);
  if (at == j.end() || !at->is_number() || !(at->get<double>() >= least) ||
      std::abs(at->get<double>()) > 1e12)
    throw std::invalid_argument(file + ": " + key + ": must be a number of " + formatted("%g", least) +
                                " or more (allowed: a file that vest_trainee reference wrote)");
  return at->get<double>();
}

std::string word(const json& j, const std::string& file, const char* key) {
  const auto at = j.find(key);
  if (at == j.end() || !at->is_string() || at->get<std::string>().size() > 100)
    throw std::invalid_argument(file + ": " + key +
                                ": must be a word (allowed: a file that vest_trainee reference wrote)");
  return at->get<std::string>();
}

}  // namespace

std::optional<LearningCurve> fitCurve(const std::vector<double>& totals) {
  if (totals.size() < kCurveFrom) return std::nullopt;
  // The squares have one valley in most data, not in all: the best of a grid in ln c, then golden sections.
  constexpr int kGrid = 60;
  const double low = std::log(kLeastRate), step = (std::log(kMostRate) - low) / kGrid;
  const auto at = [&](double ln) { return curveAt(std::exp(ln), totals); };
  int best = 0;
  for (int i = 1; i <= kGrid; ++i)
    if (at(low + i * step).rms < at(low + best * step).rms) best = i;
  double from = low + std::max(0, best - 1) * step, to = low + std::min(kGrid, best + 1) * step;
  const double golden = 0.6180339887498949;
  for (int i = 0; i < 60; ++i) {
    const double inner = to - golden * (to - from), outer = from + golden * (to - from);
    if (at(inner).rms <= at(outer).rms)
      to = outer;
    else
      from = inner;
  }
  return at(0.5 * (from + to));
}

Cusum cusumOf(const std::vector<bool>& passed) {
  Cusum c;
  double sum = 0;
  for (const bool good : passed) {
    sum += good ? -kCusumStep : 1 - kCusumStep;
    c.sums.push_back(sum);
    if (std::abs(sum) < kCusumLimit) continue;
    c.verdict = sum > 0 ? Cusum::Verdict::NotYet : Cusum::Verdict::Competent;
    sum = 0;
  }
  return c;
}

std::vector<Figure> figuresOf(const Attempt& a) {
  std::vector<Figure> figures;
  json j;
  try {
    j = files::parseJson(a.json);
  } catch (const files::Refused&) {
    return figures;
  }
  const auto items = j.find("items");
  if (items == j.end() || !items->is_array()) return figures;
  figures = {{"total", a.total, true}, {"quality", a.quality, true}, {"time_s", a.time, false}};
  for (const auto& item : *items) {
    if (!item.is_object() || !item.contains("name") || !item["name"].is_string() || !item.contains("value") ||
        !(item["value"].is_number() || item["value"].is_null()))
      continue;
    const double value = item["value"].is_number() ? item["value"].get<double>() : std::nan("");
    figures.push_back({item["name"], value, item.contains("better") && item["better"] == "higher"});
  }
  return figures;
}

Reference referenceOf(const std::string& exercise, const std::vector<Attempt>& attempts) {
  Reference r;
  r.exercise = exercise;
  std::vector<std::vector<Figure>> all;
  const Attempt* newest = nullptr;
  for (const Attempt& a : attempts)
    if (a.flags.empty() && (newest == nullptr || a.date >= newest->date)) newest = &a;
  for (const Attempt& a : attempts)
    if (a.flags.empty() && a.exercise_hash == newest->exercise_hash) {
      auto figures = figuresOf(a);
      if (std::any_of(figures.begin(), figures.end(), [](const Figure& f) { return std::isnan(f.value); }))
        continue;
      if (!figures.empty() && (all.empty() || figures.size() == all.front().size()))
        all.push_back(std::move(figures));
    }
  if (all.size() < kReferenceFrom)
    throw std::invalid_argument("exercise '" + exercise + "': " + std::to_string(all.size()) +
                                " attempts without a flag (allowed: a group of " +
                                std::to_string(kReferenceFrom) + " or more)");
  r.hash = newest->exercise_hash, r.attempts = all.size();
  const auto n = static_cast<double>(all.size());
  for (std::size_t f = 0; f < all.front().size(); ++f) {
    Reference::Of of{all.front()[f].name, 0, 0};
    for (const auto& one : all) of.mean += one.at(f).value / n;
    for (const auto& one : all)
      of.deviation += (one.at(f).value - of.mean) * (one.at(f).value - of.mean) / (n - 1);
    of.deviation = std::sqrt(of.deviation);
    r.figures.push_back(of);
  }
  return r;
}

std::string toJson(const Reference& r) {
  json j{
      {"vest_reference", 1}, {"exercise", r.exercise}, {"exercise_hash", r.hash}, {"attempts", r.attempts}};
  j["figures"] = json::array();
  for (const auto& f : r.figures)
    j["figures"].push_back({{"name", f.name}, {"mean", f.mean}, {"deviation", f.deviation}});
  return j.dump(2) + "\n";
}

Reference parseReference(const std::string& file, const std::string& text) {
  json j;
  try {
    j = files::parseJson(text);
  } catch (const files::Refused& why) {
    throw std::invalid_argument(file + ": line " + std::to_string(why.line) + ": " + why.what());
  }
  if (!j.is_object() || !j.contains("figures") || !j["figures"].is_array() || j["figures"].size() > 200)
    throw std::invalid_argument(
        file + ": is no reference group (allowed: a file that vest_trainee reference wrote)");
  Reference r;
  if (finite(j, file, "vest_reference", 1) != 1)
    throw std::invalid_argument(file + ": vest_reference: a newer VEST wrote it (allowed: 1)");
  r.exercise = word(j, file, "exercise"), r.hash = word(j, file, "exercise_hash");
  r.attempts = static_cast<std::size_t>(finite(j, file, "attempts", kReferenceFrom));
  for (const auto& f : j["figures"])
    r.figures.push_back(
        {word(f, file, "name"), finite(f, file, "mean", -1e12), finite(f, file, "deviation", 0)});
  return r;
}

std::string referenceFile(const std::string& database, const std::string& exercise) {
  return (std::filesystem::path(database).parent_path() / ("reference_" + exercise + ".json")).string();
}

std::optional<Reference> storedReference(const std::string& database, const std::string& exercise) {
  const std::string file = referenceFile(database, exercise);
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return std::nullopt;
  return parseReference(file, files::read(file, kMostReferenceBytes));
}

std::vector<ZScore> zScores(const Reference& reference, const Attempt& attempt) {
  std::vector<ZScore> z;
  if (attempt.exercise != reference.exercise || attempt.exercise_hash != reference.hash) return z;
  for (const Figure& f : figuresOf(attempt))
    for (const auto& of : reference.figures)
      if (of.name == f.name && of.deviation > 0 && !std::isnan(f.value))
        z.push_back({f.name, (f.higher_is_better ? 1 : -1) * (f.value - of.mean) / of.deviation});
  return z;
}

Learning learningOf(std::vector<Attempt> attempts, std::optional<Reference> reference) {
  Learning l;
  l.attempts = std::move(attempts);
  std::vector<bool> passed;
  for (const Attempt& a : l.attempts)
    if (a.flags.empty()) l.totals.push_back(a.total), passed.push_back(a.passed);
  l.curve = fitCurve(l.totals);
  l.cusum = cusumOf(passed);
  if (reference && !l.attempts.empty()) l.z = zScores(*reference, l.attempts.back());
  l.reference = std::move(reference);
  return l;
}

std::string toText(const Learning& l) {
  std::string out;
  if (l.curve)
    out += "Learning curve of " + std::to_string(l.totals.size()) +
           " attempts: " + formatted("%.0f", l.curve->a) + formatted(" %+.0f", l.curve->b) +
           formatted("·n^−%.2g points.", l.curve->c);
  if (l.cusum.verdict != Cusum::Verdict::Open || l.curve) {
    out += out.empty() ? "" : " ";
    out += l.cusum.verdict == Cusum::Verdict::Competent ? "CUSUM: competent, at most 1 attempt in 20 fails."
           : l.cusum.verdict == Cusum::Verdict::NotYet  ? "CUSUM: not yet, more than 1 attempt in 7 fails."
                                                        : "CUSUM: not decided yet.";
  }
  for (const ZScore& z : l.z)
    if (z.name == "total")
      out += (out.empty() ? "" : " ") + formatted("Total %+.1f standard deviations", z.z) +
             " from the reference group of " + std::to_string(l.reference->attempts) + ".";
  return out;
}

std::string toJson(const Learning& l) {
  json j;
  j["attempts"] = json::array();
  std::size_t counted = 0;
  for (const Attempt& a : l.attempts) {
    json row{{"date", a.date},   {"total", a.total},   {"quality", a.quality},
             {"time_s", a.time}, {"passed", a.passed}, {"flags", a.flags}};
    row["cusum"] = a.flags.empty() ? json(l.cusum.sums[counted++]) : json(nullptr);
    j["attempts"].push_back(row);
  }
  j["curve"] = nullptr;
  if (l.curve) j["curve"] = {{"a", l.curve->a}, {"b", l.curve->b}, {"c", l.curve->c}, {"rms", l.curve->rms}};
  constexpr const char* kVerdicts[] = {"open", "competent", "not yet"};
  j["cusum"] = {{"verdict", kVerdicts[static_cast<int>(l.cusum.verdict)]},
                {"good_rate", kGoodRate},
                {"bad_rate", kBadRate},
                {"step", kCusumStep},
                {"limit", kCusumLimit}};
  j["reference_attempts"] = l.reference ? l.reference->attempts : 0;
  j["z"] = json::object();
  for (const ZScore& z : l.z) j["z"][z.name] = z.z;
  return j.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string toCsv(const Learning& l) {
  std::string out = "attempt,date,total,quality,time_s,passed,counts,cusum\n";
  std::size_t counted = 0;
  for (std::size_t i = 0; i < l.attempts.size(); ++i) {
    const Attempt& a = l.attempts[i];
    std::string date = a.date;
    date.erase(
        std::remove_if(date.begin(), date.end(), [](char c) { return c == ',' || c == '"' || c == '\n'; }),
        date.end());
    out += std::to_string(i + 1) + "," + date + formatted(",%.17g", a.total) +
           formatted(",%.17g", a.quality) + formatted(",%.17g", a.time) + (a.passed ? ",1" : ",0") +
           (a.flags.empty() ? ",1," : ",0,");
    if (a.flags.empty()) out += formatted("%.17g", l.cusum.sums[counted++]);
    out += "\n";
  }
  return out;
}

}  // namespace vest::exercise
