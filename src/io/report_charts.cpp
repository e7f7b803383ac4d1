#include "report_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "planar_vslam/geometry/angles.h"
#include "svg_panel.h"

namespace planar_vslam::io {
namespace {

using Points = std::vector<std::pair<double, double>>;

constexpr const char* kTruth = "#7a7a7a";
constexpr const char* kOdometry = "#d98e04";
constexpr const char* kEstimate = "#0b62c4";
constexpr const char* kLoop = "#c43c0b";
constexpr double kWidth = 560.0, kLeft = 58.0, kRight = 12.0;  // px
constexpr double kGap = 1.0;                                   // s, over which no line is drawn

std::string Svg(double height, const std::string& name, const std::string& content) {
  return fmt::format("<svg class=\"chart\" role=\"img\" aria-label=\"{}\" viewBox=\"0 0 {:.0f} {:.0f}\">\n{}</svg>\n",
                     name, kWidth, height, content);
}

double Yaw(const Rigid3& T) { return ProjectToPlane(T).angle; }

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void Add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

// Of what is drawn: entries without a name are left out.
std::string Legend(const std::vector<std::pair<const char*, std::string>>& entries) {
  constexpr double kLine = 20.0, kText = 26.0, kApart = 18.0, kY = 16.0, kSize = 12.0;  // px
  constexpr double kLetter = 0.6 * kSize;                                               // as wide as one is at most
  std::string svg;
  double x = kLeft;
  for (const auto& [color, name] : entries) {
    if (name.empty()) continue;
    svg += fmt::format("<line x1=\"{0:.0f}\" y1=\"12\" x2=\"{1:.0f}\" y2=\"12\" stroke=\"{2}\" stroke-width=\"3\"/>\n",
                       x, x + kLine, color);
    svg += SvgText(x + kText, kY, name, "start", kSize);
    x += kText + kLetter * static_cast<double>(name.size()) + kApart;
  }
  return svg;
}

using Value = std::function<double(const Rigid3&)>;

// A value over time, in pieces: nothing is drawn across a gap.
std::string TimeLine(const SvgPanel& panel, const Trajectory& poses, const Value& value, Timestamp start,
                     const char* color, double width) {
  std::string svg;
  Points piece;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    constexpr double kWrapped = 3.0;  // rad; a heading beyond +-180 deg comes in at the other end
    const bool gap = i > 0 && (SecondsBetween(poses[i - 1].stamp, poses[i].stamp) > kGap ||
                               std::abs(Yaw(poses[i].T_map_base) - Yaw(poses[i - 1].T_map_base)) > kWrapped);
    if (gap) {
      svg += panel.Line(piece, color, width);
      piece.clear();
    }
    piece.emplace_back(SecondsBetween(start, poses[i].stamp), value(poses[i].T_map_base));
  }
  return svg + panel.Line(piece, color, width);
}

std::string Bands(const RunPicture& run, double seconds, const PixelBox& box) {
  std::string svg;
  const Timestamp start = run.trajectory.front().stamp;
  for (const auto& [from, to] : run.by_sight) {
    const double a = std::max(0.0, SecondsBetween(start, from)) / seconds * box.width;
    const double b = std::min(seconds, SecondsBetween(start, to)) / seconds * box.width;
    if (b <= a) continue;
    svg += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"#ececec\"/>\n",
                       box.left + a, box.top, b - a, box.height);
  }
  return svg;
}

double Duration(const Trajectory& trajectory) {
  return std::max(1e-3, SecondsBetween(trajectory.front().stamp, trajectory.back().stamp));
}

std::string PoseChart(const RunPicture& run, const PixelBox& box, const Value& value, double least_range,
                      const std::string& label) {
  Range range;
  for (const StampedPose& pose : run.trajectory) range.Add(value(pose.T_map_base));
  for (const StampedPose& pose : run.truth) range.Add(value(pose.T_map_base));
  const double middle = 0.5 * (range.low + range.high);
  const double half = 0.55 * std::max(least_range, range.high - range.low);
  const double seconds = Duration(run.trajectory);
  const Timestamp start = run.trajectory.front().stamp;
  const SvgPanel panel(box, 0.0, seconds, middle - half, middle + half, false);
  return Bands(run, seconds, box) + panel.Axes("", label) + TimeLine(panel, run.truth, value, start, kTruth, 2.5) +
         TimeLine(panel, run.trajectory, value, start, kEstimate, 1.5);
}

Points Flat(const Trajectory& trajectory) {
  Points points;
  for (const StampedPose& pose : trajectory)
    points.emplace_back(pose.T_map_base.translation.x(), pose.T_map_base.translation.y());
  return points;
}

}  // namespace

std::string TopViewChart(const RunPicture& run) {
  if (run.trajectory.empty()) return "";
  Range x, y;
  for (const Trajectory* poses : {&run.trajectory, &run.truth, &run.odometry}) {
    for (const auto& [px, py] : Flat(*poses)) x.Add(px), y.Add(py);
  }
  if (run.grid.has_value()) {
    const Eigen::Vector2d far =
        run.grid->origin + run.grid->resolution * Eigen::Vector2d(run.grid->width, run.grid->height);
    x.Add(run.grid->origin.x()), x.Add(far.x());
    y.Add(run.grid->origin.y()), y.Add(far.y());
  }
  constexpr double kHeight = 540.0;
  const PixelBox box{kLeft, 28.0, kWidth - kLeft - kRight, kHeight - 74.0};
  const SvgPanel panel(box, x.low, x.high, y.low, y.high, true);
  std::string svg = Legend({{kEstimate, "trajectory"},
                            {kOdometry, run.odometry.empty() ? "" : "odometry"},
                            {kTruth, run.truth.empty() ? "" : "truth"},
                            {kLoop, run.loops.empty() ? "" : "loop closed"}});
  if (run.grid.has_value()) svg += panel.Cells(*run.grid, Rigid2());
  svg += panel.Axes("x [m]", "y [m]");
  svg += panel.Line(Flat(run.truth), kTruth, 2.5) + panel.Line(Flat(run.odometry), kOdometry, 1.5);
  svg += panel.Line(Flat(run.trajectory), kEstimate, 1.5);
  for (const StampedPose& keyframe : run.keyframes) {
    const bool loop = std::find(run.loops.begin(), run.loops.end(), keyframe.stamp) != run.loops.end();
    const Eigen::Vector3d& p = keyframe.T_map_base.translation;
    svg += panel.Dot(p.x(), p.y(), loop ? kLoop : kEstimate);
  }
  return Svg(kHeight, "trajectory over the grid, from above", svg);
}

std::string PoseCharts(const RunPicture& run) {
  if (run.trajectory.size() < 2) return "";
  constexpr double kEach = 118.0, kBetween = 34.0, kTop = 8.0;  // px
  const std::tuple<const char*, Value, double> rows[] = {
      {"x [m]", [](const Rigid3& T) { return T.translation.x(); }, 0.1},
      {"y [m]", [](const Rigid3& T) { return T.translation.y(); }, 0.1},
      {"z [m]", [](const Rigid3& T) { return T.translation.z(); }, 0.1},
      {"yaw [deg]", [](const Rigid3& T) { return RadiansToDegrees(Yaw(T)); }, 5.0}};
  std::string svg;
  double top = kTop;
  for (const auto& [label, value, least_range] : rows) {
    svg += PoseChart(run, {kLeft, top, kWidth - kLeft - kRight, kEach}, value, least_range, label);
    top += kEach + kBetween;
  }
  svg += SvgText(kLeft + 0.5 * (kWidth - kLeft - kRight), top + 2.0, "time since the first pose [s]", "middle", 12.0);
  return Svg(top + 10.0, "x, y, z and yaw over time", svg);
}

std::string CovarianceChart(const RunPicture& run) {
  if (run.covariances.size() < 2) return "";
  const Timestamp start = run.covariances.front().stamp;
  Points along, turn;
  Range range;
  for (const StampedCovariance& at : run.covariances) {
    constexpr double kCentimetres = 100.0;
    const double seconds = SecondsBetween(start, at.stamp);
    along.emplace_back(seconds, kCentimetres * std::sqrt(std::max(0.0, at.covariance.topLeftCorner<2, 2>().trace())));
    turn.emplace_back(seconds, RadiansToDegrees(std::sqrt(std::max(0.0, at.covariance(2, 2)))));
    range.Add(along.back().second), range.Add(turn.back().second);
  }
  constexpr double kHeight = 240.0;
  const PixelBox box{kLeft, 28.0, kWidth - kLeft - kRight, kHeight - 76.0};
  const SvgPanel panel(box, 0.0, std::max(1e-3, along.back().first), 0.0, 1.05 * range.high, false);
  return Svg(kHeight, "standard deviation of the live pose over time",
             Legend({{kEstimate, "position [cm]"}, {kLoop, "heading [deg]"}}) +
                 panel.Axes("time since the first pose [s]", "std. deviation") + panel.Line(along, kEstimate, 1.5) +
                 panel.Line(turn, kLoop, 1.5));
}

std::string ScaleChart(const RunPicture& run) {
  constexpr double kShown = 5.0;  // %: what is known worse says nothing that the picture could show
  const std::tuple<const std::vector<ScalePoint>*, const char*, const char*> sources[] = {
      {&run.floor, kTruth, "floor"},
      {&run.wheels, kOdometry, "wheels"},
      {&run.laser, kLoop, "laser"},
      {&run.together, kEstimate, "together +- 1 sigma"}};
  Range driven, off;
  std::vector<std::pair<const char*, std::string>> legend;
  std::vector<std::pair<Points, const char*>> lines;
  for (const auto& [source, color, name] : sources) {
    Points line;
    for (const ScalePoint& point : *source) {
      if (point.sigma > kShown) continue;
      line.emplace_back(point.driven, point.off);
      driven.Add(point.driven), off.Add(point.off - point.sigma), off.Add(point.off + point.sigma);
    }
    if (line.size() < 2) continue;
    legend.emplace_back(color, name);
    lines.emplace_back(std::move(line), color);
  }
  if (lines.empty() || driven.high <= driven.low) return "";
  constexpr double kHeight = 240.0, kLeast = 0.1;  // px, %
  const double middle = 0.5 * (off.low + off.high), half = 0.55 * std::max(kLeast, off.high - off.low);
  const PixelBox box{kLeft, 28.0, kWidth - kLeft - kRight, kHeight - 76.0};
  const SvgPanel panel(box, driven.low, driven.high, middle - half, middle + half, false);
  std::string svg = Legend(legend) + panel.Axes("driven [m]", "map is short by [%]");
  for (const auto& [line, color] : lines) svg += panel.Line(line, color, 1.5);
  for (const double side : {-1.0, 1.0}) {
    Points bound;
    for (const ScalePoint& point : run.together) {
      if (point.sigma <= kShown) bound.emplace_back(point.driven, point.off + side * point.sigma);
    }
    svg += panel.Line(bound, kEstimate, 0.5);
  }
  return Svg(kHeight, "what the sources of scale say over the distance driven", svg);
}

}  // namespace planar_vslam::io
