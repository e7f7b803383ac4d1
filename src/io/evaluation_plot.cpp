#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "evaluation_pairs.h"
#include "planar_vslam/io/evaluation.h"
#include "svg_panel.h"

namespace planar_vslam {
namespace {

using Points = std::vector<std::pair<double, double>>;

constexpr const char* kTruthColor = "#7a7a7a";
constexpr const char* kEstimateColor = "#0b62c4";
constexpr const char* kBesideColor = "#d98e04";
constexpr const char* kErrorColor = "#c43c0b";

// Picture and panels, px.
constexpr double kWidth = 860.0, kHeight = 1000.0;
constexpr io::PixelBox kTopView{70.0, 70.0, 760.0, 620.0};
constexpr io::PixelBox kErrorView{70.0, 760.0, 760.0, 180.0};

struct TimedPoint {
  Timestamp stamp;
  double x, y;
};

// Continuous pieces: nothing is drawn across a gap.
std::vector<Points> Pieces(const std::vector<TimedPoint>& points) {
  std::vector<Points> pieces;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool gap = i == 0 || SecondsBetween(points[i - 1].stamp, points[i].stamp) > io::kLongestGapSeconds;
    if (gap) pieces.emplace_back();
    pieces.back().emplace_back(points[i].x, points[i].y);
  }
  return pieces;
}

std::string Lines(const io::SvgPanel& panel, const std::vector<TimedPoint>& points, const char* color, double width) {
  std::string svg;
  for (const Points& piece : Pieces(points)) svg += panel.Line(piece, color, width);
  return svg;
}

std::vector<TimedPoint> TopView(const Trajectory& trajectory, const Similarity3& to_truth) {
  std::vector<TimedPoint> points;
  for (const StampedPose& pose : trajectory) {
    const Eigen::Vector3d p = to_truth.Apply(pose.T_map_base.translation);
    points.push_back({pose.stamp, p.x(), p.y()});
  }
  return points;
}

// Corners of what the grid knows, as seen in the truth's frame.
std::vector<TimedPoint> KnownCorners(const OccupancyGrid2d& grid, const Rigid2& T_truth_grid) {
  int left = grid.width, right = -1, bottom = grid.height, top = -1;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      if (grid.At(x, y) < 0) continue;
      left = std::min(left, x), right = std::max(right, x);
      bottom = std::min(bottom, y), top = std::max(top, y);
    }
  }
  std::vector<TimedPoint> corners;
  if (right < left) return corners;
  for (const int x : {left, right + 1}) {
    for (const int y : {bottom, top + 1}) {
      const Eigen::Vector2d p = T_truth_grid * (grid.origin + grid.resolution * Eigen::Vector2d(x, y));
      corners.push_back({{}, p.x(), p.y()});
    }
  }
  return corners;
}

io::SvgPanel TopViewPanel(const std::vector<const std::vector<TimedPoint>*>& contents) {
  double x_min = contents.front()->front().x, x_max = x_min, y_min = contents.front()->front().y, y_max = y_min;
  for (const auto* points : contents) {
    for (const TimedPoint& point : *points) {
      x_min = std::min(x_min, point.x);
      x_max = std::max(x_max, point.x);
      y_min = std::min(y_min, point.y);
      y_max = std::max(y_max, point.y);
    }
  }
  constexpr double kMargin = 0.04;  // share of the larger side left free around the lines
  const double margin = kMargin * std::max(x_max - x_min, y_max - y_min);
  return {kTopView, x_min - margin, x_max + margin, y_min - margin, y_max + margin, true};
}

std::string LegendEntry(double x, const char* color, const std::string& name) {
  constexpr double kY = 52.0, kStroke = 26.0, kFontSize = 13.0;  // px
  return fmt::format(
             "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" stroke-width=\"3\"/>\n", x,
             kY - 4.0, x + kStroke, kY - 4.0, color) +
         io::SvgText(x + kStroke + 6.0, kY, name, "start", kFontSize);
}

std::string ErrorOverTime(const Trajectory& estimate, const Trajectory& truth, const Similarity3& truth_from_estimate) {
  std::vector<TimedPoint> points;
  double largest = 0.0;
  for (const io::PosePair& pair : io::PairByStamp(estimate, truth)) {
    const double error = (truth_from_estimate.Apply(pair.estimate.translation) - pair.truth.translation).norm();
    points.push_back({pair.stamp, SecondsBetween(truth.front().stamp, pair.stamp), error});
    largest = std::max(largest, error);
  }
  constexpr double kHeadroom = 1.05;
  const double duration = SecondsBetween(truth.front().stamp, truth.back().stamp);
  const io::SvgPanel panel(kErrorView, 0.0, duration, 0.0, kHeadroom * largest, false);
  return panel.Axes("time since the truth's first pose [s]", "position error [m]") +
         Lines(panel, points, kErrorColor, 1.5);
}

std::string Heading(const TrajectoryErrors& errors, const PlotLayers& layers) {
  constexpr double kTitleY = 26.0, kTitleSize = 16.0, kPercent = 100.0;
  std::string svg = io::SvgText(kTopView.left, kTitleY,
                                fmt::format("ATE {:.3f} m RMSE, {:.3f} m max; {:.1f} % of the truth covered",
                                            errors.ate.rmse, errors.ate.max, kPercent * errors.coverage),
                                "start", kTitleSize);
  svg += LegendEntry(kTopView.left, kTruthColor, "ground truth");
  svg += LegendEntry(kTopView.left + 140.0, kEstimateColor, "estimate, aligned (dot: start)");
  if (!layers.beside.empty()) svg += LegendEntry(kTopView.left + 390.0, kBesideColor, layers.beside_name);
  return svg;
}

// The layers from the bottom up.
std::string TopViewOf(const Trajectory& estimate, const Trajectory& truth, const TrajectoryErrors& errors,
                      const PlotLayers& layers) {
  const Rigid2 T_truth_grid = ProjectToPlane(errors.truth_from_estimate.T_target_source);
  const std::vector<TimedPoint> truth_points = TopView(truth, Similarity3{});
  const std::vector<TimedPoint> estimate_points = TopView(estimate, errors.truth_from_estimate);
  const std::vector<TimedPoint> beside_points = TopView(layers.beside, layers.truth_from_beside);
  const std::vector<TimedPoint> corners =
      layers.grid.has_value() ? KnownCorners(*layers.grid, T_truth_grid) : std::vector<TimedPoint>();
  const io::SvgPanel panel = TopViewPanel({&truth_points, &estimate_points, &beside_points, &corners});
  std::string svg = layers.grid.has_value() ? panel.Cells(*layers.grid, T_truth_grid) : "";
  svg += panel.Axes("x [m]", "y [m]");
  svg += Lines(panel, truth_points, kTruthColor, 2.5);
  svg += Lines(panel, beside_points, kBesideColor, 1.5);
  svg += Lines(panel, estimate_points, kEstimateColor, 1.5);
  if (!estimate_points.empty()) svg += panel.Dot(estimate_points.front().x, estimate_points.front().y, kEstimateColor);
  return svg;
}

}  // namespace

Expected<bool> WriteSvgPlot(const Trajectory& estimate, const Trajectory& truth, const TrajectoryErrors& errors,
                            const std::filesystem::path& path, const PlotLayers& layers) {
  if (truth.empty()) return Error{fmt::format("{}: no truth to plot", path.string())};
  const std::string svg = Heading(errors, layers) + TopViewOf(estimate, truth, errors, layers) +
                          ErrorOverTime(estimate, truth, errors.truth_from_estimate);
  return io::WriteSvg(svg, kWidth, kHeight, path);
}

}  // namespace planar_vslam
