#include "planar_vslam/io/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "planar_vslam/io/evaluation.h"
#include "report_charts.h"
#include "stamp_text.h"
#include "text_table.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Dark: pictures are turned to their negatives, their hues kept.
constexpr const char* kStyle =
    ":root{color-scheme:light dark;--ink:#202020;--paper:#fff;--line:#d8d8d8;--soft:#f5f5f3}"
    "@media(prefers-color-scheme:dark){:root{--ink:#e6e6e6;--paper:#141414;--line:#3a3a3a;--soft:#1e1e1e}"
    ".chart{filter:invert(1) hue-rotate(180deg)}}"
    "body{margin:0 auto;max-width:72rem;padding:1rem;background:var(--paper);color:var(--ink);"
    "font:16px/1.5 system-ui,sans-serif}"
    "main{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,30rem),1fr));gap:1.5rem}"
    "h1{font-size:1.4rem}h2{font-size:1.1rem;margin:.2rem 0}.chart{width:100%;height:auto;background:#fff}"
    "table{border-collapse:collapse;width:100%;font-size:.9rem}td,th{text-align:left;padding:.2rem .5rem;"
    "border-bottom:1px solid var(--line);overflow-wrap:anywhere}td.n,th.n{text-align:right;white-space:nowrap}"
    "section{min-width:0;overflow-x:auto}@media(max-width:40rem){table{font-size:.75rem}td,th{padding:.2rem}}"
    ".bar{display:block;height:.5rem;background:#0b62c4}.wide{grid-column:1/-1}";

std::string Escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else
      safe += c;
  }
  return safe;
}

std::string Section(const char* id, const char* title, const std::string& content) {
  return fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, title, content);
}

std::string Row(const std::string& name, const std::string& value) {
  return fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", Escaped(name), Escaped(value));
}

std::string Plain(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

std::string Number(const Json& json, const char* key, const char* format) {
  return json.contains(key) && json[key].is_number() ? fmt::format(fmt::runtime(format), json[key].get<double>()) : "-";
}

std::string Findings(const Json& report) {
  const Json findings = report.value("findings", Json::array());
  if (findings.empty()) return "<p>Nothing contradicts anything.</p>\n";
  std::string html = "<ul>\n";
  for (const Json& finding : findings) html += fmt::format("<li>{}</li>\n", Escaped(Plain(finding)));
  return html + "</ul>\n";
}

std::string Counts(const Json& report) {
  std::string html = "<table>\n";
  const Json frames = report.value("frames", Json::object());
  for (const auto& [state, count] : frames.items()) html += Row("images " + state, Plain(count));
  for (const char* key : {"keyframes", "points", "metric", "slips", "odometry_rejected", "laser_links"}) {
    if (report.contains(key)) html += Row(key, Plain(report[key]));
  }
  html += Row("loops", std::to_string(report.value("loops", Json::array()).size()));
  html += Row("recorded", Number(report, "recorded_seconds", "{:.1f} s"));
  const Json timing = report.value("timing", Json::object());
  html += Row("times real time", Number(timing, "real_time_factor", "{:.1f}"));
  return html + "</table>\n";
}

std::string Scale(const Json& report) {
  const Json scale = report.value("scale", Json());
  if (!scale.is_object()) return "<p>Unknown.</p>\n";
  std::string html =
      "<table>\n<tr><th>source</th><th class=\"n\">off by [%]</th><th class=\"n\">known to [%]</th></tr>\n";
  const auto row = [&html](const std::string& name, const Json& source) {
    constexpr double kPercent = 100.0;
    if (!source.is_object()) return;
    html += fmt::format("<tr><td>{}</td><td class=\"n\">{:+.2f}</td><td class=\"n\">{:.2f}</td></tr>\n", name,
                        kPercent * source.value("log_correction", 0.0), kPercent * source.value("sigma", 0.0));
  };
  for (const char* name : {"wheels", "laser", "floor"}) row(name, scale.value(name, Json()));
  row("together", scale);
  return html +
         fmt::format("</table>\n<p>Known after {} driven.</p>\n", Number(scale, "known_after_meters", "{:.2f} m"));
}

std::string Stages(const Json& report) {
  const Json stages = report.value("timing", Json::object()).value("stages_ms", Json::object());
  if (stages.empty()) return "<p>Not recorded.</p>\n";
  double most = 0.0;
  for (const auto& [name, times] : stages.items()) most = std::max(most, times.value("sum", 0.0));
  std::string html =
      "<table>\n<tr><th>stage</th><th class=\"n\">count</th><th class=\"n\">median [ms]</th><th class=\"n\">99 % "
      "[ms]</th><th>sum</th></tr>\n";
  for (const auto& [name, times] : stages.items()) {
    const double share = most > 0.0 ? times.value("sum", 0.0) / most : 0.0;
    html += fmt::format(
        "<tr><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{:.2f}</td><td class=\"n\">{:.2f}</td><td><span "
        "class=\"bar\" style=\"width:{:.0f}%\"></span></td></tr>\n",
        Escaped(name), times.value("count", 0L), times.value("p50", 0.0), times.value("p99", 0.0), 100.0 * share);
  }
  return html + "</table>\n";
}

std::string Configuration(const Json& report) {
  std::string html = "<details><summary>all keys</summary><table>\n";
  const Json configuration = report.value("configuration", Json::object());
  for (const auto& [key, value] : configuration.items()) html += Row(key, Plain(value));
  return html + "</table></details>\n";
}

Expected<Json> ReadReport(const fs::path& path) {
  std::ifstream file(path);
  if (!file) return Error{path.string() + ": cannot be read; expected the folder of a run"};
  Json report = Json::parse(file, nullptr, false);
  if (!report.is_object()) return Error{path.string() + ": no JSON object; expected the report of a run"};
  return report;
}

// The stretches of status.csv with a state of sight.
Expected<std::vector<std::pair<Timestamp, Timestamp>>> ReadSight(const fs::path& path) {
  Expected<io::TextTable> table = io::TextTable::Open(path, io::Separator::kComma);
  if (!table) return table.error();
  std::vector<std::pair<Timestamp, Timestamp>> stretches;
  bool inside = false;
  while (table->NextLine()) {
    const auto& fields = table->fields();
    if (fields.size() < 2) return table->ErrorHere("expected t,state,...");
    if (fields[0] == "t") continue;
    const io::StampText stamp = io::ParseStamp(fields[0]);
    if (stamp.kind != io::StampText::Kind::kStamp) return table->ErrorHere("expected a time in seconds first");
    const bool by_sight = fields[1] == "tracking" || fields[1] == "relocalized";
    if (by_sight && !inside) stretches.emplace_back(stamp.stamp, stamp.stamp);
    if (by_sight) stretches.back().second = stamp.stamp;
    inside = by_sight;
  }
  return stretches;
}

// Where the keyframes are. Those of a map that grew over several drives have the stamps of each: in no order.
Expected<Trajectory> ReadKeyframes(const fs::path& path) {
  Expected<io::TextTable> table = io::TextTable::Open(path, io::Separator::kBlank);
  if (!table) return table.error();
  Trajectory keyframes;
  while (table->NextLine()) {
    const auto& fields = table->fields();
    constexpr std::size_t kFields = 8;  // t x y z qx qy qz qw
    if (fields.size() < kFields) return table->ErrorHere("expected t x y z qx qy qz qw");
    const io::StampText stamp = io::ParseStamp(fields[0]);
    const std::optional<double> x = io::ParseNumber(fields[1]), y = io::ParseNumber(fields[2]);
    if (stamp.kind != io::StampText::Kind::kStamp || !x.has_value() || !y.has_value()) {
      return table->ErrorHere("expected numbers t x y z qx qy qz qw");
    }
    keyframes.push_back({stamp.stamp, Embed3(Rigid2(*x, *y, 0.0))});
  }
  return keyframes;
}

// The trajectory in the frame of the map, moved there as a whole.
Trajectory Moved(Trajectory trajectory, const Rigid3& T_map_own) {
  for (StampedPose& pose : trajectory) pose.T_map_base = T_map_own * pose.T_map_base;
  return trajectory;
}

Expected<bool> AddTruth(const fs::path& path, io::RunPicture* run) {
  Expected<Trajectory> truth = ReadTrajectory(path);
  if (!truth) return truth.error();
  const Expected<TrajectoryErrors> errors = EvaluateTrajectory(run->trajectory, *truth, EvaluationAlignment::kSe2);
  if (!errors) return Error{fmt::format("{}: {}", path.string(), errors.error().message)};
  run->truth = Moved(std::move(*truth), errors->truth_from_estimate.T_target_source.Inverse());
  return true;
}

Expected<bool> AddOdometry(const fs::path& path, io::RunPicture* run) {
  Expected<Trajectory> odometry = ReadTrajectory(path);
  if (!odometry) return odometry.error();
  if (odometry->empty() || run->trajectory.empty()) return true;
  const auto first = std::find_if(odometry->begin(), odometry->end(), [run](const StampedPose& pose) {
    return !(pose.stamp < run->trajectory.front().stamp);
  });
  if (first == odometry->end()) return Error{path.string() + ": ends before the run starts; expected odometry of it"};
  const Rigid3 T_map_odom = run->trajectory.front().T_map_base * first->T_map_base.Inverse();
  run->odometry = Moved(std::move(*odometry), T_map_odom);
  return true;
}

std::vector<io::ScalePoint> ScaleOf(const Json& history, const char* source) {
  constexpr double kPercent = 100.0;
  std::vector<io::ScalePoint> points;
  const Json driven = history.value("driven_meters", Json::array()), said = history.value(source, Json::array());
  for (std::size_t i = 0; i < std::min(driven.size(), said.size()); ++i) {
    if (!said[i].is_array() || said[i].size() != 2) continue;
    points.push_back(
        {driven[i].get<double>(), kPercent * said[i][0].get<double>(), kPercent * said[i][1].get<double>()});
  }
  return points;
}

void AddScale(const Json& report, io::RunPicture* run) {
  const Json scale = report.value("scale", Json());
  const Json history = scale.is_object() ? scale.value("history", Json::object()) : Json::object();
  run->together = ScaleOf(history, "together");
  run->wheels = ScaleOf(history, "wheels");
  run->laser = ScaleOf(history, "laser");
  run->floor = ScaleOf(history, "floor");
}

Expected<io::RunPicture> ReadRun(const ReportInput& input, const Json& report) {
  io::RunPicture run;
  const auto read = [&input](const char* name, Trajectory* into) -> Expected<bool> {
    Expected<Trajectory> trajectory = ReadTrajectory(input.folder / name);
    if (!trajectory) return trajectory.error();
    *into = std::move(*trajectory);
    return true;
  };
  if (Expected<bool> done = read("trajectory.txt", &run.trajectory); !done) return done.error();
  if (fs::exists(input.folder / "keyframes.txt")) {
    Expected<Trajectory> keyframes = ReadKeyframes(input.folder / "keyframes.txt");
    if (!keyframes) return keyframes.error();
    run.keyframes = std::move(*keyframes);
  }
  Expected<std::vector<std::pair<Timestamp, Timestamp>>> sight = ReadSight(input.folder / "status.csv");
  if (!sight) return sight.error();
  run.by_sight = std::move(*sight);
  if (fs::exists(input.folder / "covariance_live.csv")) {
    Expected<std::vector<StampedCovariance>> covariances = ReadCovariances(input.folder / "covariance_live.csv");
    if (!covariances) return covariances.error();
    run.covariances = std::move(*covariances);
  }
  if (fs::exists(input.folder / "map.yaml")) {
    Expected<OccupancyGrid2d> grid = ReadMapServerFiles(input.folder / "map.yaml");
    if (!grid) return grid.error();
    run.grid = std::move(*grid);
  }
  for (const Json& loop : report.value("loops", Json::array())) {
    run.loops.push_back(Timestamp::FromSeconds(loop.value("t", 0.0)));
  }
  AddScale(report, &run);
  if (input.truth.has_value()) {
    if (Expected<bool> done = AddTruth(*input.truth, &run); !done) return done.error();
  }
  if (input.odometry.has_value()) {
    if (Expected<bool> done = AddOdometry(*input.odometry, &run); !done) return done.error();
  }
  return run;
}

std::string Page(const std::string& name, const Json& report, const io::RunPicture& run) {
  const std::string none = "<p>There is no map to draw.</p>\n";
  const auto drawn = [&none](const std::string& chart) { return chart.empty() ? none : chart; };
  return fmt::format(
             "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" "
             "content=\"width=device-width, initial-scale=1\"/><title>{0}</title><style>{1}</style></head>\n<body>"
             "<h1>{0}</h1>\n<main>\n",
             Escaped("Run: " + name), kStyle) +
         Section("findings", "Findings", Findings(report)) + Section("counts", "Counts", Counts(report)) +
         Section("top_view", "Trajectory over the grid", drawn(io::TopViewChart(run))) +
         Section("poses", "Pose over time (grey: found by sight)", drawn(io::PoseCharts(run))) +
         Section("covariance", "How well the live pose is known", drawn(io::CovarianceChart(run))) +
         Section("scale", "Scale and its sources", io::ScaleChart(run) + Scale(report)) +
         Section("stages", "Time per stage", Stages(report)) +
         Section("configuration", "Configuration", Configuration(report)) + "</main></body></html>\n";
}

}  // namespace

Expected<bool> WriteReportPage(const ReportInput& input, const fs::path& page) {
  const Expected<Json> report = ReadReport(input.folder / "report.json");
  if (!report) return report.error();
  std::ofstream file;
  try {
    const Expected<io::RunPicture> run = ReadRun(input, *report);
    if (!run) return run.error();
    file.open(page, std::ios::binary);
    file << Page(fs::absolute(input.folder).filename().string(), *report, *run);
  } catch (const Json::exception& wrong) {
    return Error{fmt::format("{}: {}", (input.folder / "report.json").string(), wrong.what())};
  }
  file.close();
  if (!file) return Error{page.string() + ": cannot be written"};
  return true;
}

}  // namespace planar_vslam
