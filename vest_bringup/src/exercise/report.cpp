#include "vest_bringup/exercise/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include <nlohmann/json.hpp>

#include "vest_tissue/validation/svg_plot.h"

namespace vest::exercise {
namespace {

constexpr std::array<const char*, 3> kTools{"left", "right", "third"};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string number(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string base64(const std::string& bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i + k])) : 0U;
    };
    const unsigned word = byte(0) << 16U | byte(1) << 8U | byte(2);
    for (std::size_t k = 0; k < 4; ++k) out += digits[(word >> (18 - 6 * k)) & 63U];
  }
  const std::size_t rest = bytes.size() % 3;
  for (std::size_t k = 0; rest > 0 && k < 3 - rest; ++k) out[out.size() - 1 - k] = '=';
  return out;
}

std::string figure(const std::string& svg, const std::string& caption) {
  return "<figure>" + svg.substr(svg.find("<svg")) + "<figcaption>" + caption + "</figcaption></figure>\n";
}

/// One curve per hand that was there. @param value called as value(row, tool)
template <class Value>
validation::Plot overTime(const Trace& trace, const std::string& title, const std::string& label,
                          Value&& value) {
  validation::Plot plot;
  plot.title = title, plot.x_label = "time, s", plot.y_label = label;
  for (std::size_t tool = 0; tool < kTools.size(); ++tool) {
    validation::Curve curve;
    curve.label = kTools[tool];
    for (const Trace::Row& row : trace.rows()) {
      if (!row.tools[tool].present) continue;
      curve.x.push_back(row.t), curve.y.push_back(value(row.tools[tool]));
    }
    if (!curve.x.empty()) plot.curves.push_back(std::move(curve));
  }
  return plot;
}

std::string plots(const Report& r) {
  std::string out = "<h2>Motion and force</h2>\n<div class=\"plots\">\n";
  out += figure(toSvg(overTime(r.trace, "Force on the tool", "force, N",
                               [](const Trace::Row::Tool& t) { return std::round(1e2 * t.force) / 1e2; })),
                "Peaks are pulls and presses. Gentle hands stay low.");
  out += figure(toSvg(overTime(r.trace, "Speed of the tip", "speed, mm/s",
                               [](const Trace::Row::Tool& t) { return 1e3 * t.speed; })),
                "Few smooth hills are practised moves, many small ones are searching.");
  validation::Plot path;
  path.title = "Way of the tips, from above", path.x_label = "to the right, mm", path.y_label = "away, mm";
  for (std::size_t tool = 0; tool < kTools.size(); ++tool) {
    validation::Curve curve;
    curve.label = kTools[tool];
    for (const Trace::Row& row : r.trace.rows()) {
      if (!row.tools[tool].present) continue;
      curve.x.push_back(1e3 * row.tools[tool].tip.x()), curve.y.push_back(1e3 * row.tools[tool].tip.y());
    }
    if (!curve.x.empty()) path.curves.push_back(std::move(curve));
  }
  out += figure(toSvg(path), "The shorter the way, the better the plan.");
  return out + "</div>\n";
}

std::string motion(const session::motion::Figures& figures) {
  if (figures.tools.empty()) return "";
  std::string out =
      "<h2>Hands</h2>\n<table><tr><th>hand</th><th>path</th><th>economy</th><th>mean "
      "speed</th><th>turned</th>"
      "<th>along the tool</th><th>turns back</th><th>at rest</th><th>jerk, "
      "m/s³</th><th>SPARC</th><th>LDLJ</th></tr>\n";
  const auto cell = [&out](const std::optional<double>& value, double scale, const char* unit) {
    out += "<td class=\"n\">" +
           (value ? (*unit ? number("%.0f", scale * *value) : readable(*value)) + unit : "-") + "</td>";
  };
  for (const session::motion::ToolFigures& f : figures.tools) {
    out += "<tr><td>" + f.name + "</td>";
    cell(f.path, 1e3, " mm"), cell(f.economy, 100, " %"), cell(f.mean_speed, 1e3, " mm/s");
    cell(f.angular_path, 180 / M_PI, " °"), cell(f.depth_path, 1e3, " mm"), cell(f.depth_turns, 1, "");
    cell(f.idle_fraction, 100, " %"), cell(f.filtered_rms_jerk, 1, ""), cell(f.sparc, 1, ""),
        cell(f.ldlj, 1, "");
    out += "</tr>\n";
  }
  out += "</table>\n<p class=\"small\">";
  if (figures.bimanual)
    out += "Both hands move in " + readable(100 * *figures.bimanual) + " % of the time in which one does. ";
  return out +
         "Economy: the straight way through the places where a step of the task was done, over the path. "
         "SPARC "
         "and LDLJ tell how smooth motion is: nearer to zero is smoother.</p>\n";
}

std::string learning(const Learning& l) {
  if (l.attempts.size() < 2 && l.z.empty()) return "";
  std::string out = "<h2>Learning</h2>\n";
  if (const std::string words = toText(l); !words.empty()) out += "<p>" + escaped(words) + "</p>\n";
  out += "<div class=\"plots\">\n";
  validation::Plot totals, cusum;
  totals.title = "Learning curve", totals.x_label = "attempt", totals.y_label = "total";
  cusum.title = "CUSUM", cusum.x_label = "attempt", cusum.y_label = "sum, no unit";
  validation::Curve points, fitted, sums;
  points.label = "total", points.mark = validation::Mark::Points, fitted.label = "a + b n^-c";
  for (std::size_t i = 0; i < l.totals.size(); ++i) {
    const auto n = static_cast<double>(i + 1);
    points.x.push_back(n), points.y.push_back(l.totals[i]);
    sums.x.push_back(n), sums.y.push_back(l.cusum.sums[i]);
    if (!l.curve) continue;
    fitted.x.push_back(n), fitted.y.push_back(l.curve->a + l.curve->b * std::pow(n, -l.curve->c));
  }
  totals.curves.push_back(points);
  if (l.curve) totals.curves.push_back(fitted);
  const std::size_t left_out = l.attempts.size() - l.totals.size();
  out += figure(toSvg(totals),
                "All attempts that count" +
                    (left_out > 0 ? "; " + std::to_string(left_out) + " with a flag do not." : "."));
  sums.label = "attempts", cusum.curves.push_back(sums);
  for (const double limit : {kCusumLimit, -kCusumLimit})
    cusum.curves.push_back({limit > 0 ? "not yet" : "competent",
                            {1, std::max(2.0, static_cast<double>(l.totals.size()))},
                            {limit, limit},
                            validation::Mark::Line});
  out += figure(toSvg(cusum), "Below the lower line who fails at most 1 attempt in 20.");
  return out + "</div>\n";
}

/// Why an attempt counts for no curve; that it is a copy is known where it was kept.
std::vector<std::string> flagsOf(const Report& r) {
  if (r.trainee.empty() || r.learning.attempts.empty()) return flagWords(r.result.flags);
  std::vector<std::string> words;
  std::istringstream kept(r.learning.attempts.back().flags);
  for (std::string word; std::getline(kept, word, ',');) words.push_back(word);
  return words;
}

std::string whyNot(const std::string& flag) {
  if (flag == "copy") return "copy: the same input was handed in before";
  if (flag == "assisted") return "assisted: a teacher helped";
  if (flag == "practice") return "practice: the session did not keep real time";
  if (flag == "restored") return "restored: it began from a snapshot";
  if (flag == "other version")
    return "other version: its exercise has other marks than the one that VEST brings";
  if (flag == "fault") return "fault: a step of the simulation failed";
  return flag;
}

constexpr const char* kStyle =
    "body{font:16px/1.45 system-ui,sans-serif;color:#1b2733;max-width:1100px;margin:2em auto;padding:0 1em}"
    "h1{margin-bottom:.1em}h2{margin-top:1.6em}.verdict{display:inline-block;padding:.2em "
    ".8em;border-radius:.3em;"
    "color:#fff;font-weight:600}.passed{background:#00704f}.failed{background:#b33a00}"
    ".figures{display:flex;gap:2.5em;margin:1em 0}.figures b{display:block;font-size:2em}"
    "table{border-collapse:collapse;width:100%}td,th{padding:.35em .6em;border-bottom:1px solid #d5dce2;"
    "text-align:left}td.n{text-align:right;font-variant-numeric:tabular-nums}.plots{display:grid;"
    "grid-template-columns:1fr 1fr;gap:1em}figure{margin:0}figure svg,figure img{width:100%;height:auto}"
    // Printers of HTML know no grid.
    "@page{size:A4;margin:15mm}@media print{body{margin:0;font-size:12px;max-width:none}"
    ".figures,.plots{display:block}.figures div{display:inline-block;margin-right:2em}"
    ".plots figure{display:inline-block;width:48%;margin:0 1% 1em 0}td.n{white-space:nowrap}"
    "figure,tr{break-inside:avoid}h2,h2+p{break-after:avoid}}"
    "figcaption,.small{color:#56646f;font-size:.88em}.bad{color:#b33a00;font-weight:600}.good{color:#00704f}";

}  // namespace

void Trace::add(const scene::StepInput& input, const scene::StepReport& report) {
  time_ += input.dt;
  if (++steps_ % MotionLog::kEvery == 1) log_.add(time_, steps_, input);
  for (std::size_t i = 0; i < next_.tools.size(); ++i) {
    Row::Tool& tool = next_.tools[i];
    tool.present = input.tools[i].present;
    tool.tip = input.tools[i].position;
    tool.force = std::max(tool.force, report.contacts[i].wrench.head<3>().norm());
  }
  const double since = rows_.empty() ? 0.0 : rows_.back().t;
  if (!rows_.empty() && time_ - since < kEvery) return;
  next_.t = time_;
  for (std::size_t i = 0; i < next_.tools.size(); ++i)
    if (!rows_.empty() && rows_.back().tools[i].present)
      next_.tools[i].speed = (next_.tools[i].tip - rows_.back().tools[i].tip).norm() / (time_ - since);
  rows_.push_back(next_);
  next_ = Row{};
}

session::motion::Figures Trace::motion(const std::vector<Moment>& moments) const {
  const auto begun = std::find_if(moments.begin(), moments.end(),
                                  [](const Moment& m) { return m.kind == Moment::Kind::PhaseBegun; });
  return log_.figures(moments, begun != moments.end() ? static_cast<double>(begun->step) : 0.0);
}

std::string Trace::toCsv() const {
  std::string out = "t_s";
  for (const char* tool : kTools)
    for (const char* column : {"_x_m", "_y_m", "_z_m", "_speed_m_s", "_force_N"})
      out += std::string(",") + tool + column;
  out += "\n";
  for (const Row& row : rows_) {
    out += number("%.3f", row.t);
    for (const Row::Tool& t : row.tools)
      for (const double v : {t.tip.x(), t.tip.y(), t.tip.z(), t.speed, t.force})
        out += "," + number("%.6g", t.present ? v : std::nan(""));
    out += "\n";
  }
  return out;
}

std::string toHtml(const Report& report) {
  const Exercise& e = report.exercise;
  const Result& r = report.result;
  std::string h = "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                  escaped(e.title) + "</title><style>" + kStyle + "</style></head><body>\n";
  h += "<h1>" + escaped(e.title) + "</h1>\n<p class=\"small\">" +
       (report.trainee.empty() ? "" : "Trainee " + escaped(report.trainee) + " · ") + escaped(report.date) +
       "</p>\n<p>" + escaped(e.aim) + "</p>\n";
  const char* const verdict = r.passed ? "PASSED" : r.finished ? "NOT PASSED" : "NOT FINISHED";
  h += std::string("<p><span class=\"verdict ") + (r.passed ? "passed" : "failed") + "\">" + verdict +
       "</span></p>\n";
  h += "<div class=\"figures\"><div><b>" + number("%.0f", r.total) + "</b>points of 100</div><div><b>" +
       number("%.1f s", r.time) + "</b>of " + number("%.0f s", e.limit) + "</div><div><b>" +
       number("%.0f s", r.error_points) + "</b>for errors</div><div><b>" + number("%.0f %%", r.quality) +
       "</b>quality</div></div>\n";
  if (!r.failed_by.empty()) {
    h += "<h2>What to do better</h2>\n<ul>\n";
    for (const std::string& name : r.failed_by) h += "<li>" + escaped(textOf(e, name)) + "</li>\n";
    h += "</ul>\n";
  }
  for (const std::string& flag : flagsOf(report))
    h += "<p class=\"bad\">Counts for no learning curve. " + escaped(whyNot(flag)) + ".</p>\n";
  h += "<h2>Items</h2>\n<table><tr><th>item</th><th>what</th><th>value</th><th>pass</th><th>proficient</th>"
       "<th>points</th>";
  if (!report.learning.z.empty()) h += "<th>z</th>";
  h += "</tr>\n";
  for (std::size_t i = 0; i < r.items.size(); ++i) {
    const MetricInfo& info = infoOf(e.items[i].number.metric);
    std::string name = e.items[i].name;
    std::replace(name.begin(), name.end(), '_', ' ');
    h += "<tr><td>" + escaped(name) + "</td><td class=\"small\">" + escaped(std::string(info.meaning)) +
         "</td><td class=\"n " + (r.items[i].passed ? "good" : "bad") + "\">" + readable(r.items[i].value) +
         " " + escaped(unitOf(info)) + "</td><td class=\"n\">" + readable(e.items[i].pass) +
         "</td><td class=\"n\">" + readable(e.items[i].proficient) + "</td><td class=\"n\">" +
         number("%.0f", r.items[i].points) + "</td>";
    for (const ZScore& z : report.learning.z)
      if (z.name == e.items[i].name) h += "<td class=\"n\">" + number("%+.1f", z.z) + "</td>";
    h += "</tr>\n";
  }
  h += "</table>\n<h2>Course</h2>\n<table>\n";
  for (const Moment& m : r.moments) {
    const bool bad = m.kind == Moment::Kind::GateBroken || m.kind == Moment::Kind::ErrorMade ||
                     m.kind == Moment::Kind::WrongTool;
    h += "<tr><td class=\"n\">" + number("%.1f s", 1e-3 * static_cast<double>(m.step)) + "</td><td" +
         (bad ? " class=\"bad\"" : "") + ">" + escaped(describe(e, m)) + "</td></tr>\n";
  }
  for (const Note& n : report.notes)
    h += "<tr><td class=\"n\">" + number("%.1f s", n.t) + "</td><td>Teacher: " + escaped(n.text) +
         "</td></tr>\n";
  h += "</table>\n";
  if (!report.pictures.empty()) {
    h += "<h2>Moments</h2>\n<div class=\"plots\">\n";
    for (const Picture& p : report.pictures)
      h += "<figure><img alt=\"" + escaped(p.text) + "\" src=\"data:image/jpeg;base64," + base64(p.jpeg) +
           "\"><figcaption>" + number("%.1f s: ", p.t) + escaped(p.text) + "</figcaption></figure>\n";
    h += "</div>\n";
  }
  h += learning(report.learning);
  h += motion(report.trace.motion(r.moments));
  h += plots(report);
  h +=
      "<p class=\"small\">VEST " + escaped(report.version) + ", exercise " + escaped(r.exercise) + " " +
      escaped(r.hash) +
      ". Marks whose source is a script are provisional: they do not come from people.</p>\n</body></html>\n";
  return h;
}

std::string toXapi(const Report& report) {
  const Result& r = report.result;
  nlohmann::json j;
  // The specification wants an absolute URL here; this one leads nowhere (RFC 2606).
  j["actor"] = {{"objectType", "Agent"},
                {"account",
                 {{"homePage", "https://vest.invalid/trainees"},
                  {"name", report.trainee.empty() ? "nobody" : report.trainee}}}};
  const std::string verb = r.passed ? "passed" : "failed";
  j["verb"] = {{"id", "http://adlnet.gov/expapi/verbs/" + verb}, {"display", {{"en", verb}}}};
  j["object"] = {{"objectType", "Activity"},
                 {"id", "urn:vest:exercise:" + r.exercise},
                 {"definition",
                  {{"type", "http://adlnet.gov/expapi/activities/simulation"},
                   {"name", {{"en", report.exercise.title}}}}}};
  j["result"] = {{"score", {{"scaled", r.total / 100}, {"raw", r.total}, {"min", 0}, {"max", 100}}},
                 {"success", r.passed},
                 {"completion", r.finished},
                 {"duration", "PT" + number("%.2f", r.time) + "S"},
                 {"extensions", {{"urn:vest:flags", flagsOf(report)}}}};
  j["timestamp"] = report.date;
  return j.dump(2) + "\n";
}

}  // namespace vest::exercise
